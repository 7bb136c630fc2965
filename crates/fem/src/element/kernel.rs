//! The mean-dilatation element: energy, internal force and tangent.
//!
//! Three-field (Simo, Taylor & Pister 1985) with the dilatation `theta` and the
//! pressure in one discontinuous basis `psi`, both condensed on the element. As
//! the volumetric law is `K/2 (theta - 1)^2`, the condensed energy is
//!
//! `W = sum_q w U_iso(F) + K/2 b^T M^-1 b`,  `b_m = integral psi_m (J - 1) dV`,
//!
//! so `theta - 1 = psi . M^-1 b` is the projection of `J - 1` and force and
//! tangent are plain derivatives: symmetric, and consistent by construction.
//! With a law of small strain `J - 1` is `tr H` and its second derivative vanishes.

use super::geometry::{ElementGeometry, displacement_gradient};
use super::independent::{Dilatation, IndependentDilatation};
use papilla_solid::Isochoric;
use papilla_solid::tensor::{Kinematics, Mat3, UNIT, cofactor_derivative, trace};

/// Where an element turned inside out.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("J = {j:.3e} at quadrature point {point}")]
pub struct Inverted {
    /// Quadrature point in the element.
    pub point: usize,
    /// Volume ratio there.
    pub j: f64,
}

/// What one evaluation of an element found.
#[derive(Clone, Copy, Debug)]
pub struct ElementState {
    /// Stored energy, mJ.
    pub energy_mj: f64,
    /// Smallest volume ratio `J` at a quadrature point.
    pub j_min: f64,
    /// Coefficients of `theta - 1` in the dilatation basis.
    pub theta_minus_1: Dilatation,
    /// What a independent dilatation differs from it by, squared and integrated, mm3; 0
    /// without one.
    pub gap_squared_mm3: f64,
}

/// Where an element's laws come from.
pub trait Points {
    /// Law of a point.
    type At: Isochoric;
    /// Law of the quadrature point `q`.
    fn at(&self, q: usize) -> Self::At;
}

/// Largest `3 * nodes * dilatation functions`.
const VOLUME_GRADIENTS_MAX: usize = 4 * 27;
/// Largest number of quadrature points.
const POINTS_MAX: usize = 27;
/// Largest number of nodes.
const NODES_MAX: usize = 27;

/// Evaluates one element with nodal displacements `u` (mm) and the bulk modulus
/// `bulk_mpa`; `points` gives the isochoric law of each quadrature point.
///
/// Overwrites `force` (N, one per node) and, if given, the tangent `stiffness`
/// (N/mm; dense row-major `3 n x 3 n`, blocks with node `a <= b` only). With a dilatation
/// independent the tangent takes its pressure, see [`IndependentDilatation`].
///
/// # Errors
/// [`Inverted`] where `J <= 0`; outputs are then meaningless.
#[inline(always)]
pub fn evaluate<P: Points>(
    geometry: ElementGeometry<'_>,
    law: &P,
    bulk_mpa: f64,
    u: &[[f64; 3]],
    independent: Option<IndependentDilatation<'_>>,
    force: &mut [[f64; 3]],
    stiffness: Option<&mut [f64]>,
) -> Result<ElementState, Inverted> {
    let n = u.len();
    let points = geometry.weights.len();
    let m = geometry.inverse_gram.len().isqrt();
    debug_assert!(points <= POINTS_MAX && m * n <= VOLUME_GRADIENTS_MAX);
    let mut kinematics = [const { None::<Kinematics> }; POINTS_MAX];
    let mut volume_gradient = [[0.0; 3]; VOLUME_GRADIENTS_MAX];
    let mut b = [0.0; 4];
    let mut j_min = f64::INFINITY;
    for q in 0..points {
        let gradients = &geometry.gradients[q * n..(q + 1) * n];
        let k = Kinematics::new(displacement_gradient(u, gradients));
        // NaN fails the test too.
        if !(k.j() > 0.0) && (P::At::FINITE || k.j().is_nan()) {
            return Err(Inverted { point: q, j: k.j() });
        }
        j_min = j_min.min(k.j());
        let (growth, by_h) = if P::At::FINITE { (k.j_minus_1, k.cof) } else { (trace(&k.h), UNIT) };
        for r in 0..m {
            let weight = geometry.weights[q] * geometry.basis[q][r];
            b[r] += weight * growth;
            add_times(&mut volume_gradient[r * n..(r + 1) * n], weight, &by_h, gradients);
        }
        kinematics[q] = Some(k);
    }
    let theta: Dilatation = std::array::from_fn(|r| {
        if r < m { (0..m).map(|c| geometry.inverse_gram[r * m + c] * b[c]).sum() } else { 0.0 }
    });
    let bulk = bulk_mpa;
    let mut energy = 0.5 * bulk * (0..m).map(|r| b[r] * theta[r]).sum::<f64>();
    set_volumetric(force, bulk, &theta, &volume_gradient[..m * n]);
    let held = independent.as_ref().map_or(theta, |c| c.theta_minus_1);
    let at_point =
        |c: &Dilatation, q: usize| -> f64 { (0..m).map(|r| c[r] * geometry.basis[q][r]).sum() };
    let mut gap_squared_mm3 = 0.0;
    if let Some(c) = independent {
        let gap: Dilatation = std::array::from_fn(|r| held[r] - theta[r]);
        set_volumetric(c.lag_n, bulk, &gap, &volume_gradient[..m * n]);
        for (q, weight) in geometry.weights.iter().enumerate() {
            gap_squared_mm3 += weight * at_point(&gap, q).powi(2);
        }
    }
    let mut stiffness = stiffness;
    if let Some(s) = stiffness.as_deref_mut() {
        volumetric_stiffness(s, bulk, geometry.inverse_gram, &volume_gradient[..m * n], n, m);
    }
    for (q, k) in kinematics.iter().take(points).flatten().enumerate() {
        let gradients = &geometry.gradients[q * n..(q + 1) * n];
        let weight = geometry.weights[q];
        let law = law.at(q);
        let (density, stress) = law.energy_and_first_piola(k);
        energy += weight * density;
        add_times(force, weight, &stress, gradients);
        if let Some(s) = stiffness.as_deref_mut() {
            let pressure = bulk * at_point(&held, q);
            add_point_stiffness(s, &point_tangent(&law, k, pressure, weight), gradients);
        }
    }
    if let Some(s) = stiffness {
        by_nodes(s, n);
    }
    Ok(ElementState { energy_mj: energy, j_min, theta_minus_1: theta, gap_squared_mm3 })
}

/// `force[a] = K sum_r theta_r g_r[a]`.
#[inline(always)]
fn set_volumetric(force: &mut [[f64; 3]], bulk: f64, theta: &Dilatation, g: &[[f64; 3]]) {
    let n = force.len();
    let m = g.len() / n;
    for (a, f) in force.iter_mut().enumerate() {
        *f =
            std::array::from_fn(|i| bulk * (0..m).map(|r| theta[r] * g[r * n + a][i]).sum::<f64>());
    }
}

/// `weight (A + pressure d cof / dF)`.
#[inline(always)]
fn point_tangent<L: Isochoric>(
    law: &L,
    k: &Kinematics,
    pressure: f64,
    weight: f64,
) -> papilla_solid::tensor::Tensor4 {
    let mut a = law.tangent(k);
    let d = if L::FINITE { cofactor_derivative(&k.f) } else { [[[[0.0; 3]; 3]; 3]; 3] };
    for i in 0..3 {
        for j in 0..3 {
            for kk in 0..3 {
                for l in 0..3 {
                    a[i][j][kk][l] = weight * (a[i][j][kk][l] + pressure * d[i][j][kk][l]);
                }
            }
        }
    }
    a
}

/// `force[a] += weight * p . gradients[a]`.
#[inline(always)]
fn add_times(force: &mut [[f64; 3]], weight: f64, p: &Mat3, gradients: &[[f64; 3]]) {
    for (f, g) in force.iter_mut().zip(gradients) {
        for i in 0..3 {
            f[i] += weight * (p[i][0] * g[0] + p[i][1] * g[1] + p[i][2] * g[2]);
        }
    }
}

/// Overwrites with `K sum_mn M^-1_mn g_m g_n^T`, laid out as in [`add_point_stiffness`].
#[inline(always)]
fn volumetric_stiffness(
    stiffness: &mut [f64],
    bulk: f64,
    inverse_gram: &[f64],
    g: &[[f64; 3]],
    n: usize,
    m: usize,
) {
    for a in 0..n {
        for i in 0..3 {
            let mut left = [0.0; 4];
            for c in 0..m {
                left[c] =
                    bulk * (0..m).map(|r| g[r * n + a][i] * inverse_gram[r * m + c]).sum::<f64>();
            }
            let line = &mut stiffness[(3 * a + i) * 3 * n..][..3 * n];
            for k in 0..3 {
                for b in 0..n {
                    line[k * n + b] = (0..m).map(|c| left[c] * g[c * n + b][k]).sum();
                }
            }
        }
    }
}

/// `K[a i][k b] += dN_a,j A_ijkl dN_b,l` for `a <= b`; some others are touched.
///
/// Columns are ordered by component first, so that the innermost loops run over nodes and
/// fill vector registers; [`by_nodes`] puts them right in the end.
#[inline(always)]
fn add_point_stiffness(
    stiffness: &mut [f64],
    a4: &papilla_solid::tensor::Tensor4,
    gradients: &[[f64; 3]],
) {
    match gradients.len() {
        // The number of nodes as a constant: loops without remainders.
        8 => add_stiffness_of(8, stiffness, a4, gradients),
        27 => add_stiffness_of(27, stiffness, a4, gradients),
        n => add_stiffness_of(n, stiffness, a4, gradients),
    }
}

#[inline(always)]
fn add_stiffness_of(
    n: usize,
    stiffness: &mut [f64],
    a4: &papilla_solid::tensor::Tensor4,
    gradients: &[[f64; 3]],
) {
    let mut g = [[0.0; NODES_MAX]; 3];
    for (b, gradient) in gradients[..n].iter().enumerate() {
        for l in 0..3 {
            g[l][b] = gradient[l];
        }
    }
    for i in 0..3 {
        for k in 0..3 {
            let mut t = [[0.0; NODES_MAX]; 3];
            for j in 0..3 {
                let v = &a4[i][j][k];
                for b in 0..n {
                    t[j][b] = v[0] * g[0][b] + v[1] * g[1][b] + v[2] * g[2][b];
                }
            }
            for a in 0..n {
                let ga = [g[0][a], g[1][a], g[2][a]];
                let line = &mut stiffness[((3 * a + i) * 3 + k) * n..][..n];
                // From a multiple of a vector's length on.
                for b in a & !3..n {
                    line[b] += ga[0] * t[0][b] + ga[1] * t[1][b] + ga[2] * t[2][b];
                }
            }
        }
    }
}

/// Orders columns by node first, blocks `a <= b`.
#[inline(always)]
fn by_nodes(stiffness: &mut [f64], n: usize) {
    let mut by_component = [0.0; 3 * NODES_MAX];
    for (row, line) in stiffness.chunks_exact_mut(3 * n).enumerate() {
        by_component[..3 * n].copy_from_slice(line);
        for b in row / 3..n {
            for k in 0..3 {
                line[3 * b + k] = by_component[k * n + b];
            }
        }
    }
}
