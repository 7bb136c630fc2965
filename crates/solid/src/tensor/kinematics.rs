//! Deformation measures, all computed from the displacement gradient.
//!
//! Forming `F = I + H` and subtracting `1` or `I` again loses digits at small
//! strain, so `J - 1`, the Green strain and the invariants are written as
//! polynomials in `H` that vanish with it.

/// A 3 x 3 matrix, row major: `m[i][j]`.
pub type Mat3 = [[f64; 3]; 3];
/// A fourth-order tensor `a[i][j][k][l]`.
pub type Tensor4 = [[[[f64; 3]; 3]; 3]; 3];

/// Deformation at one point.
#[derive(Clone, Copy, Debug)]
pub struct Kinematics {
    /// Displacement gradient `H = du/dX`, dimensionless.
    pub h: Mat3,
    /// Deformation gradient `F = I + H`.
    pub f: Mat3,
    /// Cofactor of `F`, `J F^-T`.
    pub cof: Mat3,
    /// `J - 1`, exact to rounding at small strain.
    pub j_minus_1: f64,
    /// Second principal invariant of `H`.
    h_invariant_2: f64,
    /// `det H`.
    h_det: f64,
}

impl Kinematics {
    /// Deformation measures of the displacement gradient `h`.
    #[inline(always)]
    #[must_use]
    pub fn new(h: Mat3) -> Self {
        let mut f = h;
        for i in 0..3 {
            f[i][i] += 1.0;
        }
        let cof = cofactor(&f);
        let trace = h[0][0] + h[1][1] + h[2][2];
        let h_cof = cofactor(&h);
        let h_invariant_2 = h_cof[0][0] + h_cof[1][1] + h_cof[2][2];
        let h_det = h[0][0] * h_cof[0][0] + h[0][1] * h_cof[0][1] + h[0][2] * h_cof[0][2];
        Self { h, f, cof, j_minus_1: trace + (h_invariant_2 + h_det), h_invariant_2, h_det }
    }

    /// Volume ratio `J = det F`.
    #[inline(always)]
    #[must_use]
    pub fn j(&self) -> f64 {
        1.0 + self.j_minus_1
    }

    /// `F^-1`; meaningful for `J > 0` only.
    #[inline(always)]
    #[must_use]
    pub fn f_inverse(&self) -> Mat3 {
        let r = 1.0 / self.j();
        let c = &self.cof;
        std::array::from_fn(|i| std::array::from_fn(|j| c[j][i] * r))
    }

    /// `J^(-2/3)`.
    #[inline(always)]
    #[must_use]
    pub fn j_pow_minus_two_thirds(&self) -> f64 {
        (-2.0 / 3.0 * self.j_minus_1.ln_1p()).exp()
    }

    /// Green strain `E = (H + H^T + H^T H) / 2`.
    #[must_use]
    pub fn green_strain(&self) -> Mat3 {
        let h = &self.h;
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let hth: f64 = (0..3).map(|k| h[k][i] * h[k][j]).sum();
                0.5 * (h[i][j] + h[j][i] + hth)
            })
        })
    }

    /// `tr C - 3 = 2 tr E`.
    #[inline(always)]
    #[must_use]
    pub fn i1_minus_3(&self) -> f64 {
        2.0 * trace(&self.h) + double_dot(&self.h, &self.h)
    }

    /// `J^(-2/3) I1 - 3`, the isochoric first invariant less its value at rest.
    ///
    /// `I1bar - 3 = J^(-2/3) (2 tr E - 3 (J^(2/3) - 1))`; the terms linear in
    /// `H` cancel exactly when both are written with `J - 1`, which leaves
    /// `H:H - 2 II(H) - 2 det H - r(J - 1)` with `r` of second order.
    #[inline(always)]
    #[must_use]
    pub fn i1_bar_minus_3(&self) -> f64 {
        let quadratic = double_dot(&self.h, &self.h) - 2.0 * self.h_invariant_2 - 2.0 * self.h_det;
        self.j_pow_minus_two_thirds() * (quadratic - volumetric_remainder(self.j_minus_1))
    }
}

/// `3 ((1 + x)^(2/3) - 1) - 2 x`, without cancellation near `x = 0`.
#[inline]
fn volumetric_remainder(x: f64) -> f64 {
    if x.abs() < 1e-2 {
        // Binomial series of 3 (1 + x)^(2/3); the first term left out is below 1e-18.
        let mut coefficient = 2.0; // 3 * binomial(2/3, 1)
        let mut power = x;
        let mut sum = 0.0;
        for n in 1..9 {
            coefficient *= (2.0 / 3.0 - f64::from(n)) / f64::from(n + 1);
            power *= x;
            sum += coefficient * power;
        }
        sum
    } else {
        3.0 * (2.0 / 3.0 * x.ln_1p()).exp_m1() - 2.0 * x
    }
}

/// Cofactor matrix: `cof[i][j]` is the signed minor of `m[i][j]`.
#[inline(always)]
#[must_use]
pub fn cofactor(m: &Mat3) -> Mat3 {
    std::array::from_fn(|i| {
        let (i1, i2) = ((i + 1) % 3, (i + 2) % 3);
        std::array::from_fn(|j| {
            let (j1, j2) = ((j + 1) % 3, (j + 2) % 3);
            m[i1][j1] * m[i2][j2] - m[i1][j2] * m[i2][j1]
        })
    })
}

/// `a b`.
#[must_use]
#[inline]
pub fn product(a: &Mat3, b: &Mat3) -> Mat3 {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// Sum of the diagonal.
#[inline(always)]
#[must_use]
pub fn trace(m: &Mat3) -> f64 {
    m[0][0] + m[1][1] + m[2][2]
}

/// `a : b`, the sum of products of entries.
#[inline(always)]
#[must_use]
pub fn double_dot(a: &Mat3, b: &Mat3) -> f64 {
    let mut s = 0.0;
    for i in 0..3 {
        for j in 0..3 {
            s += a[i][j] * b[i][j];
        }
    }
    s
}

/// `d cof(F)[i][j] / dF[k][l] = eps(i,k,m) eps(j,l,n) F[m][n]`, linear in `F`.
#[inline(always)]
#[must_use]
pub fn cofactor_derivative(f: &Mat3) -> Tensor4 {
    let mut d = [[[[0.0; 3]; 3]; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            let (i1, i2) = ((i + 1) % 3, (i + 2) % 3);
            let (j1, j2) = ((j + 1) % 3, (j + 2) % 3);
            d[i][j][i1][j1] += f[i2][j2];
            d[i][j][i2][j2] += f[i1][j1];
            d[i][j][i1][j2] -= f[i2][j1];
            d[i][j][i2][j1] -= f[i1][j2];
        }
    }
    d
}

/// The unit tensor.
pub const UNIT: Mat3 = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invariants_keep_their_digits_at_tiny_strain() {
        // Simple shear g: J = 1 exactly, I1bar - 3 = g^2 exactly.
        for g in [1e-3, 1e-8, 1e-150] {
            let k = Kinematics::new([[0.0, g, 0.0], [0.0; 3], [0.0; 3]]);
            assert!(k.j_minus_1.abs() == 0.0);
            let relative = (k.i1_bar_minus_3() - g * g).abs() / (g * g);
            assert!(relative < 1e-14, "g = {g}: {relative}");
        }
        // Uniaxial strain e: I1bar - 3 = (4/3) e^2 to first order.
        let e = 1e-9;
        let k = Kinematics::new([[e, 0.0, 0.0], [0.0; 3], [0.0; 3]]);
        let expected = 4.0 / 3.0 * e * e;
        assert!((k.i1_bar_minus_3() - expected).abs() / expected < 1e-8);
    }

    #[test]
    fn remainder_is_continuous_where_its_formula_changes() {
        for x in [1e-2f64, -1e-2] {
            let inside = volumetric_remainder(x * (1.0 - 1e-13));
            let outside = volumetric_remainder(x);
            assert!((inside - outside).abs() < 1e-9 * outside.abs());
        }
    }
}
