//! The fluid in a tissue's pores, as scenes write it.

use papilla_fem::biphasic::{HolmesMow, Permeability, PermeabilityError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Least and largest permeability that is believed of a tissue, mm4/(N s), but 0.
const BELIEVED: [f64; 2] = [1e-9, 1e4];

/// A tissue full of fluid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BiphasicSpec {
    /// Permeability at rest, mm4/(N s); 1e-15 m4/(N s) is 1e-3.
    pub permeability_mm4_per_n_s: f64,
    /// Poisson's ratio of the solid alone; gives its bulk modulus with the law's shear modulus.
    pub drained_poissons_ratio: f64,
    /// How permeability changes with volume; constant if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub holmes_mow: Option<HolmesMowSpec>,
}

/// `k0 ((J - s) / (1 - s))^a exp(M (J^2 - 1) / 2)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HolmesMowSpec {
    /// Volume share `s` of the solid at rest, 0 to 1.
    pub solid_share: f64,
    /// Power `a`.
    pub power: f64,
    /// Exponent `M`.
    pub exponent: f64,
}

/// Why a tissue's fluid was refused.
#[derive(Clone, Copy, Debug, thiserror::Error, PartialEq)]
pub enum BiphasicError {
    /// A permeability in another unit.
    #[error(
        "a permeability of {0} mm4/(N s) is not believed of a tissue (0, or {low:e} to {high:e}): was it \
         meant in m4/(N s)? 1e-15 m4/(N s) is 1e-3 here", low = BELIEVED[0], high = BELIEVED[1]
    )]
    Units(f64),
    /// A permeability or its law.
    #[error(transparent)]
    Permeability(#[from] PermeabilityError),
    /// Poisson's ratio of the solid alone.
    #[error(
        "a drained Poisson's ratio of {0} must lie in [0, 0.49]: what cannot shrink holds no fluid"
    )]
    Drained(f64),
}

impl BiphasicError {
    /// The field that is to blame.
    #[must_use]
    pub const fn field(&self) -> &'static str {
        match self {
            Self::Units(_) | Self::Permeability(PermeabilityError::Value(_)) => {
                "permeability_mm4_per_n_s"
            }
            Self::Permeability(PermeabilityError::SolidShare(_)) => "holmes_mow.solid_share",
            Self::Permeability(PermeabilityError::Exponent(_)) => "holmes_mow.exponent",
            Self::Drained(_) => "drained_poissons_ratio",
        }
    }
}

impl BiphasicSpec {
    /// The permeability.
    ///
    /// # Errors
    /// [`BiphasicError`] names what is out of range.
    pub fn permeability(&self) -> Result<Permeability, BiphasicError> {
        let k = self.permeability_mm4_per_n_s;
        let law = |h: HolmesMowSpec| HolmesMow {
            solid_share: h.solid_share,
            power: h.power,
            exponent: h.exponent,
        };
        let permeability =
            Permeability { at_rest_mm4_per_n_s: k, strain: self.holmes_mow.map(law) };
        permeability.validate()?;
        if k != 0.0 && !(BELIEVED[0]..=BELIEVED[1]).contains(&k) {
            return Err(BiphasicError::Units(k));
        }
        Ok(permeability)
    }

    /// Bulk modulus of the solid alone, MPa, by its shear modulus.
    ///
    /// # Errors
    /// [`BiphasicError::Drained`].
    pub fn bulk_mpa(&self, shear_mpa: f64) -> Result<f64, BiphasicError> {
        let nu = self.drained_poissons_ratio;
        if !(0.0..=0.49).contains(&nu) {
            return Err(BiphasicError::Drained(nu));
        }
        Ok(2.0 * shear_mpa * (1.0 + nu) / (3.0 * (1.0 - 2.0 * nu)))
    }

    /// Checks the constants.
    ///
    /// # Errors
    /// [`BiphasicError`] names what is out of range.
    pub fn validate(&self) -> Result<(), BiphasicError> {
        self.permeability()?;
        self.bulk_mpa(1.0).map(drop)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_out_of_range_name_their_field() {
        let spec = |k, nu| BiphasicSpec {
            permeability_mm4_per_n_s: k,
            drained_poissons_ratio: nu,
            holmes_mow: None,
        };
        let field = |k, nu| spec(k, nu).validate().unwrap_err().field();
        assert!(spec(1e-3, 0.2).validate().is_ok() && spec(0.0, 0.0).validate().is_ok());
        assert_eq!(field(-1.0, 0.2), "permeability_mm4_per_n_s");
        assert_eq!(field(1e-15, 0.2), "permeability_mm4_per_n_s");
        assert_eq!(field(1e-3, 0.5), "drained_poissons_ratio");
        // E = 3 K (1 - 2 nu) = 2 mu (1 + nu).
        let bulk = spec(1e-3, 0.25).bulk_mpa(0.4).unwrap();
        assert!((3.0 * bulk * 0.5 - 2.0 * 0.4 * 1.25).abs() < 1e-12);
    }
}
