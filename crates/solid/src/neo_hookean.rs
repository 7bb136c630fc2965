//! Neo-Hookean isochoric law `U = mu/2 (I1bar - 3)`.

use super::Isochoric;
use crate::tensor::{Kinematics, Mat3, Tensor4, trace};

/// Neo-Hookean law with shear modulus `mu`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NeoHookean {
    /// Shear modulus at rest, MPa.
    pub mu_mpa: f64,
}

impl Isochoric for NeoHookean {
    const FINITE: bool = true;

    #[inline(always)]
    fn energy(&self, k: &Kinematics) -> f64 {
        0.5 * self.mu_mpa * k.i1_bar_minus_3()
    }

    /// `P = mu J^(-2/3) (F - I1/3 F^-T)`.
    ///
    /// The bracket is `(J F - I1/3 cof F) / J`. In
    /// `cof F = I + tr(H) I - H^T + cof H` the unit matrices cancel symbolically
    /// and small strain keeps all digits.
    #[inline(always)]
    fn first_piola(&self, k: &Kinematics) -> Mat3 {
        let j = k.j_minus_1;
        let third = k.i1_minus_3() / 3.0;
        let tr = trace(&k.h);
        let h_cof = crate::tensor::cofactor(&k.h);
        let factor = self.mu_mpa * k.j_pow_minus_two_thirds() / k.j();
        std::array::from_fn(|a| {
            std::array::from_fn(|b| {
                let unit = if a == b { j - tr } else { 0.0 };
                let bracket =
                    unit + k.h[a][b] * (1.0 + j) + k.h[b][a] - h_cof[a][b] - third * k.cof[a][b];
                factor * bracket
            })
        })
    }

    /// `A = mu J^(-2/3) [ I(x)I - 2/3 (F (x) F^-T + F^-T (x) F)
    ///      + 2/9 I1 F^-T (x) F^-T + I1/3 F^-T (boxed) F^-1 ]`.
    #[inline(always)]
    fn tangent(&self, k: &Kinematics) -> Tensor4 {
        let g = k.f_inverse();
        let i1 = 3.0 + k.i1_minus_3();
        let m = self.mu_mpa * k.j_pow_minus_two_thirds();
        let (c23, c29, c3) = (2.0 / 3.0 * m, 2.0 / 9.0 * i1 * m, i1 / 3.0 * m);
        let mut t = [[[[0.0; 3]; 3]; 3]; 3];
        for a in 0..3 {
            for b in 0..3 {
                for c in 0..3 {
                    for d in 0..3 {
                        t[a][b][c][d] = -c23 * (k.f[a][b] * g[d][c] + g[b][a] * k.f[c][d])
                            + c29 * g[b][a] * g[d][c]
                            + c3 * g[b][c] * g[d][a];
                    }
                }
                t[a][b][a][b] += m;
            }
        }
        t
    }

    #[inline(always)]
    fn shear_modulus_mpa(&self) -> f64 {
        self.mu_mpa
    }
}
