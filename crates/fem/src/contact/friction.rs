//! Coulomb friction of a contact point, as an augmented Lagrangian.
//!
//! Within a step the bound `s = mu lambda_n` is that of the last multiplier update, so the
//! tangential traction has a potential: with the slip `g` since the last equilibrium, in
//! the tangent plane, and `q = lambda_t + eps g`,
//!
//! `|q| <= s` (stick): `|q|^2 / 2 eps`;  `|q| > s` (slip): `s |q| / eps - s^2 / 2 eps`,
//!
//! and force and symmetric tangent are its derivatives. The update sets `lambda_t` to `q` cut to
//! the bound, the bound to the new pressure and the plane to the new normal, until none changes:
//! then Coulomb's law holds (Simo & Laursen 1992, made symmetric by the lagged bound).

use papilla_vector::norm;
use serde::{Deserialize, Serialize};

/// Tangential state of every contact point during a step.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct FrictionTrial {
    /// Coefficient of friction.
    pub coefficient: f64,
    /// One entry a contact point.
    pub points: Vec<FrictionPoint>,
    /// Energy turned into heat so far, mJ.
    pub heat_mj: f64,
}

/// Tangential state of one contact point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FrictionPoint {
    /// Traction of the skin on the indenter, MPa per undeformed area.
    pub traction_mpa: [f64; 3],
    /// Largest traction, MPa.
    pub bound_mpa: f64,
    /// Normal of the tangent plane.
    pub normal: [f64; 3],
    /// Position less the indenter's displacement at the last equilibrium, mm.
    pub anchor_mm: [f64; 3],
}

/// Energy, force and tangent of friction at one point.
#[derive(Clone, Copy, Debug)]
pub struct PointFriction {
    /// Potential, mJ.
    pub energy_mj: f64,
    /// Its derivative by the point's place, N.
    pub force_n: [f64; 3],
    /// Second derivative, N/mm.
    pub stiffness: [[f64; 3]; 3],
    /// Traction cut to the bound, MPa.
    pub traction_mpa: [f64; 3],
    /// Whether the point slips.
    pub slips: bool,
}

impl PointFriction {
    /// Friction of a point at `relative_mm` (position less the indenter's
    /// displacement); `None` where nothing presses.
    #[must_use]
    pub fn new(
        point: &FrictionPoint,
        relative_mm: [f64; 3],
        area: f64,
        penalty: f64,
    ) -> Option<Self> {
        let s = point.bound_mpa;
        if !(s > 0.0) {
            return None;
        }
        let n = point.normal;
        let tangential = |v: [f64; 3]| -> [f64; 3] {
            let along: f64 = (0..3).map(|i| v[i] * n[i]).sum();
            std::array::from_fn(|i| v[i] - along * n[i])
        };
        let g = tangential(std::array::from_fn(|i| relative_mm[i] - point.anchor_mm[i]));
        // A multiplier kept from another normal is turned into this plane.
        let kept = tangential(point.traction_mpa);
        let q: [f64; 3] = std::array::from_fn(|i| kept[i] + penalty * g[i]);
        let size = norm(q);
        let plane = |i: usize, j: usize| f64::from(u8::from(i == j)) - n[i] * n[j];
        if size <= s {
            return Some(Self {
                energy_mj: 0.5 * area * size * size / penalty,
                force_n: q.map(|v| area * v),
                stiffness: std::array::from_fn(|i| {
                    std::array::from_fn(|j| area * penalty * plane(i, j))
                }),
                traction_mpa: q,
                slips: false,
            });
        }
        let d = q.map(|v| v / size);
        Some(Self {
            energy_mj: area * (s * size - 0.5 * s * s) / penalty,
            force_n: d.map(|v| area * s * v),
            stiffness: std::array::from_fn(|i| {
                std::array::from_fn(|j| area * penalty * s / size * (plane(i, j) - d[i] * d[j]))
            }),
            traction_mpa: d.map(|v| s * v),
            slips: true,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Force and tangent are derivatives of the potential, in stick and in slip.
        #[test]
        fn derivatives_match_differences(
            x in prop::array::uniform3(-0.02f64..0.02), kept in prop::array::uniform3(-0.01f64..0.01),
            bound in 0.001f64..0.05,
        ) {
            let normal = [0.6, 0.0, 0.8];
            let point = FrictionPoint { traction_mpa: kept, bound_mpa: bound, normal, anchor_mm: [0.001, -0.002, 0.0] };
            let at = |p: [f64; 3]| PointFriction::new(&point, p, 0.3, 2.0).unwrap();
            let found = at(x);
            let h = 1e-6;
            for i in 0..3 {
                let moved = |s: f64| { let mut p = x; p[i] += s * h; at(p) };
                let (plus, minus) = (moved(1.0), moved(-1.0));
                prop_assume!(plus.slips == minus.slips);
                let force = (plus.energy_mj - minus.energy_mj) / (2.0 * h);
                prop_assert!((force - found.force_n[i]).abs() < 1e-8);
                for j in 0..3 {
                    let stiffness = (plus.force_n[j] - minus.force_n[j]) / (2.0 * h);
                    prop_assert!((stiffness - found.stiffness[i][j]).abs() < 1e-5);
                }
            }
            prop_assert!(norm(found.traction_mpa) <= bound * (1.0 + 1e-12));
        }
    }

    #[test]
    fn nothing_presses_nothing_rubs() {
        assert!(PointFriction::new(&FrictionPoint::default(), [1.0; 3], 1.0, 1.0).is_none());
    }
}
