//! A dilatation of its own in each element, kept from one iteration to the next.
//!
//! Before it is condensed, the energy of an element has two fields, `u` and the coefficients
//! `t` of `theta - 1`, with the pressure `K t`:
//!
//! `L(u, t) = sum_q w U_iso(F) + K t^T b(u) - K/2 t^T M t`.
//!
//! A Newton step on both, `t` condensed, is `(A + K t . b'' + K G M^-1 G^T) du = -f(u)` with
//! `G = db/du`, and `t' = M^-1 (b + G^T du)`: force and volumetric stiffness are those of the
//! condensed element, and so are its equilibria. But the geometric stiffness takes the pressure
//! that the last step arrived at to first order, and not `K M^-1 b`, into which the second order of
//! that step entered times `K` (Magisano, Leonetti & Garcea 2017: mixed integration points).

use super::geometry::{ElementGeometry, displacement_gradient};
use papilla_solid::tensor::{Kinematics, UNIT, double_dot, trace};

/// Coefficients of `theta - 1` in the dilatation basis of an element.
pub type Dilatation = [f64; 4];

/// What an element keeps, and how far it is from equilibrium with it.
#[derive(Debug)]
pub struct IndependentDilatation<'a> {
    /// The dilatation.
    pub theta_minus_1: Dilatation,
    /// Overwritten with `K G (t - M^-1 b)`, N, one per node: added to the force of the condensed
    /// element it is `dL/du`.
    pub lag_n: &'a mut [[f64; 3]],
}

/// `M^-1 (b + G^T du)`: the dilatation at `u` plus its linear change by `step`, both mm.
#[must_use]
pub fn next_dilatation(
    geometry: ElementGeometry<'_>,
    finite: bool,
    u: &[[f64; 3]],
    step: &[[f64; 3]],
) -> Dilatation {
    let m = geometry.inverse_gram.len().isqrt();
    let mut b = [0.0; 4];
    let points = geometry.gradients.chunks_exact(u.len());
    for ((gradients, weight), basis) in points.zip(geometry.weights).zip(geometry.basis) {
        let k = Kinematics::new(displacement_gradient(u, gradients));
        let change = displacement_gradient(step, gradients);
        let (growth, by_h) = if finite { (k.j_minus_1, &k.cof) } else { (trace(&k.h), &UNIT) };
        let linear = double_dot(&change, by_h);
        for r in 0..m {
            b[r] += weight * basis[r] * (growth + linear);
        }
    }
    std::array::from_fn(|r| {
        if r < m { (0..m).map(|c| geometry.inverse_gram[r * m + c] * b[c]).sum() } else { 0.0 }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::{
        BlockGeometry, ConstitutiveModel, Elastic, ElementKind, HistoryVariables,
    };
    use papilla_solid::{LinearElastic, NeoHookean};
    use std::sync::Arc;

    const H: f64 = 1e-6;

    fn wave(size: f64, phase: f64, kind: ElementKind) -> Vec<[f64; 3]> {
        let value = |a: usize, i: usize| size * (phase + 1.7 * a as f64 + 2.9 * i as f64).sin();
        let moves = |a, i| if i < kind.dimension() { value(a, i) } else { 0.0 };
        (0..kind.nodes()).map(|a| std::array::from_fn(|i| moves(a, i))).collect()
    }

    fn plus(u: &[[f64; 3]], s: f64, d: &[[f64; 3]]) -> Vec<[f64; 3]> {
        u.iter().zip(d).map(|(u, d)| std::array::from_fn(|i| u[i] + s * d[i])).collect()
    }

    struct Found {
        total_n: Vec<[f64; 3]>,
        lag_n: Vec<[f64; 3]>,
        stiffness: Vec<f64>,
        own: Dilatation,
        gap_squared_mm3: f64,
    }

    fn at(
        solid: &dyn ConstitutiveModel,
        g: ElementGeometry<'_>,
        u: &[[f64; 3]],
        t: Dilatation,
    ) -> Found {
        let n = u.len();
        let (mut force, mut lag_n) = (vec![[0.0; 3]; n], vec![[0.0; 3]; n]);
        let mut stiffness = vec![0.0; 9 * n * n];
        let independent = Some(IndependentDilatation { theta_minus_1: t, lag_n: &mut lag_n });
        let (memory, dense) = (HistoryVariables::default(), Some(stiffness.as_mut_slice()));
        let state = solid.evaluate_with(g, u, memory, independent, &mut force, dense).unwrap();
        Found {
            total_n: plus(&force, 1.0, &lag_n),
            lag_n,
            stiffness,
            own: state.theta_minus_1,
            gap_squared_mm3: state.gap_squared_mm3,
        }
    }

    fn close(found: &[f64], expected: &[f64], what: &str) {
        let scale = expected.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        for (f, e) in found.iter().zip(expected) {
            assert!((f - e).abs() <= 1e-7 * scale, "{what}: {f} is not {e}");
        }
    }

    #[test]
    fn the_tangent_is_that_of_both_fields_with_the_dilatation_condensed() {
        let solids = [
            Elastic::shared(NeoHookean { mu_mpa: 0.7 }, 50.0),
            Elastic::shared(LinearElastic { mu_mpa: 0.7 }, 50.0),
        ];
        for kind in [ElementKind::Hex8, ElementKind::Hex27, ElementKind::Tet10, ElementKind::Quad9]
        {
            let nodes: Vec<_> = (0..kind.nodes()).map(|a| kind.node_xi(a)).collect();
            let nodes = plus(&nodes, 1.0, &wave(0.05, 0.4, kind));
            let connectivity: Vec<u32> = (0..kind.nodes() as u32).collect();
            let block = BlockGeometry::new(kind, &nodes, &connectivity).unwrap();
            let g = block.element(0);
            let (u, d) = (wave(0.06, 0.0, kind), wave(1.0, 2.0, kind));
            let none = vec![[0.0; 3]; kind.nodes()];
            let m = g.inverse_gram.len().isqrt();
            let t: Dilatation =
                std::array::from_fn(|r| if r < m { 0.03 - 0.02 * r as f64 } else { 0.0 });
            for solid in &solids {
                let what = format!("{kind:?}, finite strain: {}", solid.is_finite_strain());
                linear_change(solid, g, &u, &d, &what);
                let here = at(solid.as_ref(), g, &u, t);
                let [ahead, behind] =
                    [H, -H].map(|s| at(solid.as_ref(), g, &plus(&u, s, &d), t).total_n);
                let now = next_dilatation(g, solid.is_finite_strain(), &u, &none);
                let after = next_dilatation(g, solid.is_finite_strain(), &u, &d);
                let moved = std::array::from_fn(|r| t[r] + after[r] - now[r]);
                let pushed = at(solid.as_ref(), g, &u, moved).lag_n;
                let n = kind.nodes();
                let (mut product, mut expected) = (vec![0.0; 3 * n], vec![0.0; 3 * n]);
                for row in 0..3 * n {
                    let (a, i) = (row / 3, row % 3);
                    for column in 0..3 * n {
                        let upper = if a <= column / 3 { (row, column) } else { (column, row) };
                        let entry = here.stiffness[upper.0 * 3 * n + upper.1];
                        product[row] += entry * d[column / 3][column % 3];
                    }
                    expected[row] = (ahead[a][i] - behind[a][i]) / (2.0 * H)
                        + (pushed[a][i] - here.lag_n[a][i]);
                }
                close(&product, &expected, &what);
            }
        }
    }

    /// The dilatation's change is linear in the step; with its own an element is the condensed one.
    fn linear_change(
        solid: &Arc<dyn ConstitutiveModel>,
        g: ElementGeometry<'_>,
        u: &[[f64; 3]],
        d: &[[f64; 3]],
        what: &str,
    ) {
        let [ahead, behind] = [H, -H].map(|s| at(solid.as_ref(), g, &plus(u, s, d), [0.0; 4]).own);
        let none = vec![[0.0; 3]; u.len()];
        let now = next_dilatation(g, solid.is_finite_strain(), u, &none);
        let after = next_dilatation(g, solid.is_finite_strain(), u, d);
        let found: Vec<f64> = (0..4).map(|r| after[r] - now[r]).collect();
        let expected: Vec<f64> = (0..4).map(|r| (ahead[r] - behind[r]) / (2.0 * H)).collect();
        close(&found, &expected, what);
        let own = at(solid.as_ref(), g, u, [0.0; 4]).own;
        close(&now, &own, what);
        let same = at(solid.as_ref(), g, u, own);
        assert!(same.gap_squared_mm3 == 0.0 && same.lag_n.as_flattened().iter().all(|f| *f == 0.0));
        // Off by a constant: its square times the volume.
        let off = at(solid.as_ref(), g, u, [own[0] + 0.1, own[1], own[2], own[3]]);
        let volume: f64 = g.weights.iter().sum();
        close(&[off.gap_squared_mm3], &[0.01 * volume * g.basis[0][0].powi(2)], what);
    }
}
