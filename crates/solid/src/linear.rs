//! Linear elasticity: small strain, `U = mu |dev sym H|^2`.

use super::Isochoric;
use crate::tensor::{Kinematics, Mat3, Tensor4, trace};

/// Hooke's law with shear modulus `mu`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearElastic {
    /// Shear modulus, MPa.
    pub mu_mpa: f64,
}

/// Deviatoric part of the symmetric part.
pub(super) fn deviatoric_strain(h: &Mat3) -> Mat3 {
    let third = trace(h) / 3.0;
    std::array::from_fn(|i| {
        std::array::from_fn(|j| 0.5 * (h[i][j] + h[j][i]) - if i == j { third } else { 0.0 })
    })
}

impl Isochoric for LinearElastic {
    const FINITE: bool = false;

    fn energy(&self, k: &Kinematics) -> f64 {
        let e = deviatoric_strain(&k.h);
        self.mu_mpa * crate::tensor::double_dot(&e, &e)
    }

    fn first_piola(&self, k: &Kinematics) -> Mat3 {
        deviatoric_strain(&k.h).map(|row| row.map(|e| 2.0 * self.mu_mpa * e))
    }

    fn tangent(&self, _k: &Kinematics) -> Tensor4 {
        projection(self.mu_mpa)
    }

    fn shear_modulus_mpa(&self) -> f64 {
        self.mu_mpa
    }
}

/// `2 mu (I_sym - 1/3 I (x) I)`.
fn projection(mu: f64) -> Tensor4 {
    let mut t = [[[[0.0; 3]; 3]; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            t[i][j][i][j] += mu;
            t[i][j][j][i] += mu;
            t[i][i][j][j] -= 2.0 / 3.0 * mu;
        }
    }
    t
}
