//! Material laws: energy, stress and tangent as formulas on the type.
//!
//! Energies are per unit undeformed volume, in MPa = mJ/mm3. Every law is an
//! isochoric part, a function of `F / J^(1/3)`, plus the volumetric part
//! `K/2 (J - 1)^2`, which the mean-dilatation element integrates itself.

pub mod kinematics;
mod neo_hookean;

pub use kinematics::{Kinematics, Mat3, Tensor4};
pub use neo_hookean::NeoHookean;
use serde::{Deserialize, Serialize};

/// The isochoric part of a hyperelastic law.
pub trait Isochoric {
    /// Energy density, MPa.
    fn energy(&self, k: &Kinematics) -> f64;
    /// First Piola-Kirchhoff stress `dU/dF`, MPa.
    fn first_piola(&self, k: &Kinematics) -> Mat3;
    /// Tangent `d2U/dF2`, MPa, with major symmetry.
    fn tangent(&self, k: &Kinematics) -> Tensor4;
}

/// Elastic constants as the literature prints them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ElasticConstants {
    /// Young's modulus at rest, MPa.
    pub youngs_modulus_mpa: f64,
    /// Poisson's ratio at rest, in (-1, 0.5).
    pub poissons_ratio: f64,
}

/// Why a material was refused.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum MaterialError {
    /// Young's modulus is not a positive finite number.
    #[error("Young's modulus {0} MPa must be positive and finite")]
    YoungsModulus(f64),
    /// Poisson's ratio is outside (-1, 0.5).
    #[error(
        "Poisson's ratio {0} must lie in (-1, 0.5); nearly incompressible tissue is 0.49 to 0.4999"
    )]
    PoissonsRatio(f64),
}

/// A compressible material: an isochoric law and a bulk modulus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Isochoric law.
    pub isochoric: NeoHookean,
    /// Bulk modulus `K`, MPa.
    pub bulk_mpa: f64,
}

impl Material {
    /// Neo-Hookean material with these constants at rest:
    /// `mu = E / 2(1 + nu)`, `K = E / 3(1 - 2 nu)`.
    ///
    /// # Errors
    /// Refuses constants outside their range, naming the value.
    pub fn neo_hookean(c: ElasticConstants) -> Result<Self, MaterialError> {
        let (e, nu) = (c.youngs_modulus_mpa, c.poissons_ratio);
        if !(e.is_finite() && e > 0.0) {
            return Err(MaterialError::YoungsModulus(e));
        }
        if !(nu > -1.0 && nu < 0.5) {
            return Err(MaterialError::PoissonsRatio(nu));
        }
        Ok(Self {
            isochoric: NeoHookean { mu_mpa: e / (2.0 * (1.0 + nu)) },
            bulk_mpa: e / (3.0 * (1.0 - 2.0 * nu)),
        })
    }

    /// Strain energy density with a dilatation `theta - 1` that may come from
    /// the element's mean-dilatation field, MPa.
    #[must_use]
    pub fn energy(&self, k: &Kinematics, theta_minus_1: f64) -> f64 {
        self.isochoric.energy(k) + 0.5 * self.bulk_mpa * theta_minus_1 * theta_minus_1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn perturbed(h: &Mat3, k: usize, l: usize, d: f64) -> Kinematics {
        let mut q = *h;
        q[k][l] += d;
        Kinematics::new(q)
    }

    /// Stress against the energy's and tangent against the stress's central
    /// difference, for one displacement gradient.
    fn check_derivatives<M: Isochoric>(m: &M, h: Mat3) {
        let k0 = Kinematics::new(h);
        let d = 1e-5;
        let p = m.first_piola(&k0);
        let a = m.tangent(&k0);
        let scale = a
            .as_flattened()
            .as_flattened()
            .as_flattened()
            .iter()
            .fold(0.0f64, |s, x| s.max(x.abs()));
        for k in 0..3 {
            for l in 0..3 {
                let (plus, minus) = (perturbed(&h, k, l, d), perturbed(&h, k, l, -d));
                let dp = (m.energy(&plus) - m.energy(&minus)) / (2.0 * d);
                assert!((dp - p[k][l]).abs() < 1e-7 * scale, "stress {k}{l}: {dp} {}", p[k][l]);
                let (pp, pm) = (m.first_piola(&plus), m.first_piola(&minus));
                for i in 0..3 {
                    for j in 0..3 {
                        let da = (pp[i][j] - pm[i][j]) / (2.0 * d);
                        assert!((da - a[i][j][k][l]).abs() < 1e-6 * scale, "tangent {i}{j}{k}{l}");
                        assert!((a[i][j][k][l] - a[k][l][i][j]).abs() <= 1e-12 * scale, "symmetry");
                    }
                }
            }
        }
    }

    macro_rules! derivative_tests {
        ($($name:ident => $material:expr),* $(,)?) => {$(
            proptest! {
                #[test]
                fn $name(v in prop::array::uniform9(-0.25f64..0.25)) {
                    let h = [[v[0], v[1], v[2]], [v[3], v[4], v[5]], [v[6], v[7], v[8]]];
                    check_derivatives(&$material, h);
                }
            }
        )*};
    }

    derivative_tests! {
        neo_hookean_derivatives => NeoHookean { mu_mpa: 0.7 },
    }

    #[test]
    fn constants_outside_their_range_are_refused() {
        let c = |e, nu| ElasticConstants { youngs_modulus_mpa: e, poissons_ratio: nu };
        assert_eq!(Material::neo_hookean(c(1.0, 0.5)), Err(MaterialError::PoissonsRatio(0.5)));
        assert_eq!(Material::neo_hookean(c(-1.0, 0.3)), Err(MaterialError::YoungsModulus(-1.0)));
        assert!(Material::neo_hookean(c(f64::NAN, 0.3)).is_err());
    }
}
