//! Materials as scenes write them, and what they become.

mod biphasic;

pub use biphasic::{BiphasicError, BiphasicSpec, HolmesMowSpec};

use papilla_solid::{Ogden, OgdenTerm, Prony, PronyTerm, moduli};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Elastic constants as the literature prints them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ElasticConstants {
    /// Young's modulus at rest, MPa.
    pub youngs_modulus_mpa: f64,
    /// Poisson's ratio at rest, in (-1, 0.5).
    pub poissons_ratio: f64,
}

impl ElasticConstants {
    /// Shear modulus `E / 2(1 + nu)` and bulk modulus `E / 3(1 - 2 nu)`, MPa.
    ///
    /// # Errors
    /// Refuses constants outside their range, naming the value.
    pub fn moduli_mpa(&self) -> Result<[f64; 2], MaterialError> {
        let (e, nu) = (self.youngs_modulus_mpa, self.poissons_ratio);
        if !(e.is_finite() && e > 0.0) {
            return Err(MaterialError::YoungsModulus(e));
        }
        if e > MODULUS_MAX_MPA {
            return Err(MaterialError::Units { value: e, low: 0.0, high: MODULUS_MAX_MPA });
        }
        poissons_ratio(nu)?;
        Ok(moduli(e, nu))
    }
}

/// The unit that would bring a modulus nearest to what is believed.
fn meant(value: f64, low: f64, high: f64) -> &'static str {
    if value < low {
        "GPa"
    } else if value > 1e3 * high {
        "Pa"
    } else {
        "kPa"
    }
}

/// Above it a modulus in MPa must have been meant in Pa: diamond has 1.1e6.
const MODULUS_MAX_MPA: f64 = 2e6;

fn poissons_ratio(nu: f64) -> Result<(), MaterialError> {
    if nu > -1.0 && nu < 0.5 { Ok(()) } else { Err(MaterialError::PoissonsRatio(nu)) }
}

/// An Ogden law, in Abaqus' convention.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OgdenSpec {
    /// Moduli `mu_p`, MPa.
    pub mu_mpa: Vec<f64>,
    /// Exponents `alpha_p`, one a modulus.
    pub alpha: Vec<f64>,
    /// Poisson's ratio at rest; gives the bulk modulus with `mu0 = sum mu_p`.
    #[serde(default = "nearly_incompressible")]
    pub poissons_ratio: f64,
    /// Least and largest isochoric principal stretch that the law was fitted to.
    #[serde(default = "calibrated_stretch")]
    pub calibrated_stretch: [f64; 2],
}

fn nearly_incompressible() -> f64 {
    0.48
}

fn calibrated_stretch() -> [f64; 2] {
    [0.67, 1.5]
}

impl OgdenSpec {
    /// Chen, Shuai & Zhu, Table 2, second set: stiffer, hence skin.
    #[must_use]
    pub fn skin() -> Self {
        Self::published(&[2.3583e-2, 4.5408e-5, 4.0878e-2], &[-2.0623, 25.0, -3.4784])
    }

    /// Chen, Shuai & Zhu, Table 2, first set: softer, hence subcutaneous tissue.
    /// Not stable everywhere (`mu_3 < 0`).
    #[must_use]
    pub fn subcutaneous() -> Self {
        Self::published(&[6.3754e-3, 1.8874e-4, -3.7709e-4], &[1.3416, 25.0, -7.8571])
    }

    fn published(mu_mpa: &[f64], alpha: &[f64]) -> Self {
        Self {
            mu_mpa: mu_mpa.to_vec(),
            alpha: alpha.to_vec(),
            poissons_ratio: nearly_incompressible(),
            calibrated_stretch: calibrated_stretch(),
        }
    }

    /// The law and its bulk modulus, MPa: `K = 2 mu0 (1 + nu) / 3 (1 - 2 nu)`.
    ///
    /// # Errors
    /// [`MaterialError`] naming what is out of range.
    pub fn law(&self) -> Result<(Ogden, f64), MaterialError> {
        let count = self.mu_mpa.len();
        if count != self.alpha.len() || !(1..=Ogden::TERMS_MAX).contains(&count) {
            return Err(MaterialError::OgdenTerms { mu: count, alpha: self.alpha.len() });
        }
        if let Some(&alpha) = self.alpha.iter().find(|a| !a.is_finite() || **a == 0.0) {
            return Err(MaterialError::OgdenExponent(alpha));
        }
        let mu0: f64 = self.mu_mpa.iter().sum();
        if !(mu0.is_finite() && mu0 > 0.0) {
            return Err(MaterialError::OgdenUnstable(mu0));
        }
        if mu0 > MODULUS_MAX_MPA {
            return Err(MaterialError::OgdenUnits(mu0));
        }
        poissons_ratio(self.poissons_ratio)?;
        let [low, high] = self.calibrated_stretch;
        if !(low > 0.0 && low < 1.0 && high > 1.0 && high.is_finite()) {
            return Err(MaterialError::Calibrated(low, high));
        }
        let terms: Vec<_> = self
            .mu_mpa
            .iter()
            .zip(&self.alpha)
            .map(|(&mu_mpa, &alpha)| OgdenTerm { mu_mpa, alpha })
            .collect();
        let nu = self.poissons_ratio;
        let bulk = 2.0 * mu0 * (1.0 + nu) / (3.0 * (1.0 - 2.0 * nu));
        Ok((Ogden::new(&terms, self.calibrated_stretch), bulk))
    }
}

/// Which moduli a law's constants are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Moduli {
    /// Those of a sudden strain.
    #[default]
    Instantaneous,
    /// Those of a strain held for ever.
    LongTerm,
}

/// A Prony series of shear relaxation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PronySpec {
    /// Shares `g_i`, 0 to 1, together below 1.
    pub share: Vec<f64>,
    /// Relaxation times `tau_i`, s, one a share.
    pub time_s: Vec<f64>,
    /// Which moduli the law's constants are.
    #[serde(default)]
    pub moduli: Moduli,
}

impl PronySpec {
    /// Chen, Shuai & Zhu, Table 2, second set.
    #[must_use]
    pub fn skin() -> Self {
        Self {
            share: vec![0.2566, 0.2225],
            time_s: vec![0.3834, 4.6731],
            moduli: Moduli::default(),
        }
    }

    /// Chen, Shuai & Zhu, Table 2, first set. `tau_1 = .2136` repeats `g_2` digit for
    /// digit, surely a misprint; kept (docs/concepts/physics.md).
    #[must_use]
    pub fn subcutaneous() -> Self {
        Self { share: vec![0.0864, 0.2136], time_s: vec![0.2136, 8.854], moduli: Moduli::default() }
    }

    /// The series, and what the law's constants are multiplied with to become
    /// instantaneous ones.
    ///
    /// # Errors
    /// [`MaterialError`] naming what is out of range.
    pub fn series(&self) -> Result<(Prony, f64), MaterialError> {
        let count = self.share.len();
        if count != self.time_s.len() || !(1..=Prony::TERMS_MAX).contains(&count) {
            return Err(MaterialError::PronyTerms { share: count, time: self.time_s.len() });
        }
        if let Some(&time) = self.time_s.iter().find(|t| !(t.is_finite() && **t > 0.0)) {
            return Err(MaterialError::PronyTime(time));
        }
        let sum: f64 = self.share.iter().sum();
        if !(self.share.iter().all(|g| *g >= 0.0) && sum < 1.0) {
            return Err(MaterialError::PronyShare(sum));
        }
        let terms: Vec<_> = self
            .share
            .iter()
            .zip(&self.time_s)
            .map(|(&share, &time_s)| PronyTerm { share, time_s })
            .collect();
        let series = Prony::new(&terms);
        let scale = match self.moduli {
            Moduli::Instantaneous => 1.0,
            Moduli::LongTerm => 1.0 / series.long_term_share(),
        };
        Ok((series, scale))
    }
}

/// Stretches beyond which a law of one term is continued: heel pads and skin, to which such laws
/// are fitted, are squeezed and pulled less.
const ONE_TERM_STRETCH: [f64; 2] = [0.35, 2.8];

/// All that a scene may say of one tissue. Effects choose what of it is used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MaterialSpec {
    /// Young's modulus at rest, MPa: neo-Hookean and linear law.
    pub youngs_modulus_mpa: f64,
    /// Poisson's ratio at rest.
    pub poissons_ratio: f64,
    /// Law of the effect `hyperelastic`; neo-Hookean without.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ogden: Option<OgdenSpec>,
    /// Relaxation of the effect `viscoelastic`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prony: Option<PronySpec>,
    /// Fluid of the effect `biphasic`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub biphasic: Option<BiphasicSpec>,
}

impl MaterialSpec {
    /// Elastic constants alone.
    #[must_use]
    pub fn elastic(youngs_modulus_mpa: f64, poissons_ratio: f64) -> Self {
        Self { youngs_modulus_mpa, poissons_ratio, ogden: None, prony: None, biphasic: None }
    }

    /// Ogden's law of one term, which stiffens the more the larger `alpha`; the elastic constants
    /// are those of its rest.
    #[must_use]
    pub fn one_term(mu_mpa: f64, alpha: f64, poissons_ratio: f64) -> Self {
        let ogden = OgdenSpec {
            mu_mpa: vec![mu_mpa],
            alpha: vec![alpha],
            poissons_ratio,
            calibrated_stretch: ONE_TERM_STRETCH,
        };
        let youngs_modulus_mpa = 2.0 * mu_mpa * (1.0 + poissons_ratio);
        Self { ogden: Some(ogden), ..Self::elastic(youngs_modulus_mpa, poissons_ratio) }
    }

    /// The constants at rest.
    #[must_use]
    pub fn constants(&self) -> ElasticConstants {
        ElasticConstants {
            youngs_modulus_mpa: self.youngs_modulus_mpa,
            poissons_ratio: self.poissons_ratio,
        }
    }
}

/// Why a material was refused.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum MaterialError {
    /// Young's modulus is not a positive finite number.
    #[error("Young's modulus {0} MPa must be positive and finite")]
    YoungsModulus(f64),
    /// A modulus that no such tissue has.
    #[error(
        "a modulus of {value} MPa is not believed of such a tissue ({low} to {high} MPa is): moduli are in \
         MPa, was {} meant?", meant(*value, *low, *high)
    )]
    Units {
        /// Modulus, MPa.
        value: f64,
        /// Least that is believed, MPa.
        low: f64,
        /// Most that is believed, MPa.
        high: f64,
    },
    /// Poisson's ratio is outside (-1, 0.5).
    #[error(
        "Poisson's ratio {0} must lie in (-1, 0.5); nearly incompressible tissue is 0.49 to 0.4999"
    )]
    PoissonsRatio(f64),
    /// Lists of different or no length.
    #[error("ogden has {mu} moduli mu_mpa and {alpha} exponents alpha; give 1 to 6 of each")]
    OgdenTerms {
        /// Moduli.
        mu: usize,
        /// Exponents.
        alpha: usize,
    },
    /// An exponent of zero.
    #[error("ogden.alpha = {0} must be finite and not 0")]
    OgdenExponent(f64),
    /// Negative shear modulus at rest.
    #[error(
        "the sum of ogden.mu_mpa is {0} MPa; it is the shear modulus at rest and must be positive \
         (Abaqus' convention: mu0 = sum mu_i)"
    )]
    OgdenUnstable(f64),
    /// A shear modulus that no tissue has.
    #[error("the sum of ogden.mu_mpa is {0} MPa, beyond any tissue's: was Pa meant?")]
    OgdenUnits(f64),
    /// Bounds of the calibrated stretch.
    #[error("ogden.calibrated_stretch = [{0}, {1}] must enclose 1")]
    Calibrated(f64, f64),
    /// Lists of different or no length.
    #[error("prony has {share} shares and {time} times time_s; give 1 to 6 of each")]
    PronyTerms {
        /// Shares.
        share: usize,
        /// Times.
        time: usize,
    },
    /// A relaxation time that is not positive.
    #[error("prony.time_s = {0} s must be positive and finite")]
    PronyTime(f64),
    /// The fluid is out of range.
    #[error("biphasic: {0}")]
    Biphasic(#[from] BiphasicError),
    /// Shares add up to 1 or more.
    #[error("prony.share adds up to {0}; shares must not be negative and add up to less than 1")]
    PronyShare(f64),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_outside_their_range_are_refused() {
        let c = |e, nu| ElasticConstants { youngs_modulus_mpa: e, poissons_ratio: nu }.moduli_mpa();
        assert_eq!(c(1.0, 0.5), Err(MaterialError::PoissonsRatio(0.5)));
        assert_eq!(c(-1.0, 0.3), Err(MaterialError::YoungsModulus(-1.0)));
        assert_eq!(
            c(8e4 * 1e3, 0.3),
            Err(MaterialError::Units { value: 8e7, low: 0.0, high: 2e6 })
        );
        assert!(c(f64::NAN, 0.3).is_err());
    }

    #[test]
    fn the_published_sets_are_skin_and_fat() {
        let (skin, _) = OgdenSpec::skin().law().unwrap();
        let (fat, _) = OgdenSpec::subcutaneous().law().unwrap();
        use papilla_solid::Isochoric as _;
        assert!((skin.shear_modulus_mpa() - 64.5e-3).abs() < 1e-4);
        assert!((fat.shear_modulus_mpa() - 6.19e-3).abs() < 1e-5);
        assert!((PronySpec::skin().series().unwrap().0.long_term_share() - 0.5209).abs() < 1e-12);
    }
}
