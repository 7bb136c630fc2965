//! How easily fluid flows through a tissue.

/// Permeability of a tissue: flux over pressure gradient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Permeability {
    /// At rest, mm4/(N s); 1e-15 m4/(N s) of the literature is 1e-3 here.
    pub at_rest_mm4_per_n_s: f64,
    /// How it changes with volume; constant if `None`.
    pub strain: Option<HolmesMow>,
}

/// Permeability that falls as pores close: `k0 ((J - s) / (1 - s))^a exp(M (J^2 - 1) / 2)`
/// (Holmes & Mow 1990; FEBio's `perm-Holmes-Mow`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HolmesMow {
    /// Volume share `s` of the solid at rest.
    pub solid_share: f64,
    /// Power `a`.
    pub power: f64,
    /// Exponent `M`.
    pub exponent: f64,
}

/// Why a permeability was refused.
#[derive(Clone, Copy, Debug, thiserror::Error, PartialEq)]
pub enum PermeabilityError {
    /// Negative, or not a number.
    #[error(
        "permeability {0} mm4/(N s) must not be negative or infinite: fluid flows down the pressure"
    )]
    Value(f64),
    /// A share outside [0, 1).
    #[error("a solid's share of {0} must be at least 0 and below 1")]
    SolidShare(f64),
    /// A negative power or exponent.
    #[error(
        "a power or exponent of {0} must be finite and not negative: pores close as tissue shrinks"
    )]
    Exponent(f64),
}

impl Permeability {
    /// The same at any volume.
    #[must_use]
    pub const fn constant(at_rest_mm4_per_n_s: f64) -> Self {
        Self { at_rest_mm4_per_n_s, strain: None }
    }

    /// Checks the constants.
    ///
    /// # Errors
    /// [`PermeabilityError`] names the value.
    pub fn validate(&self) -> Result<(), PermeabilityError> {
        let sane = |v: f64| v.is_finite() && v >= 0.0;
        if !sane(self.at_rest_mm4_per_n_s) {
            return Err(PermeabilityError::Value(self.at_rest_mm4_per_n_s));
        }
        let Some(law) = &self.strain else { return Ok(()) };
        if !(sane(law.solid_share) && law.solid_share < 1.0) {
            return Err(PermeabilityError::SolidShare(law.solid_share));
        }
        match [law.power, law.exponent].into_iter().find(|v| !sane(*v)) {
            Some(v) => Err(PermeabilityError::Exponent(v)),
            None => Ok(()),
        }
    }

    /// At the volume ratio `1 + j_minus_1`, mm4/(N s); 0 where no pore is left.
    #[must_use]
    pub fn at_mm4_per_n_s(&self, j_minus_1: f64) -> f64 {
        let Some(HolmesMow { solid_share, power, exponent }) = self.strain else {
            return self.at_rest_mm4_per_n_s;
        };
        let pores = (1.0 + j_minus_1 / (1.0 - solid_share)).max(0.0);
        let swelling = 0.5 * exponent * j_minus_1 * (2.0 + j_minus_1);
        self.at_rest_mm4_per_n_s * pores.powf(power) * swelling.exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pores_close_as_tissue_shrinks() {
        let strain = Some(HolmesMow { solid_share: 0.2, power: 2.0, exponent: 4.0 });
        let k = Permeability { at_rest_mm4_per_n_s: 1e-3, strain };
        assert_eq!(k.at_mm4_per_n_s(0.0), 1e-3);
        // By hand: (.7 / .8)^2 exp(2 (.81 - 1)).
        let by_hand = 1e-3 * (0.7f64 / 0.8).powi(2) * (2.0f64 * (0.81 - 1.0)).exp();
        assert!((k.at_mm4_per_n_s(-0.1) / by_hand - 1.0).abs() < 1e-12);
        assert_eq!(k.at_mm4_per_n_s(-0.8), 0.0);
        assert_eq!(k.at_mm4_per_n_s(-0.9), 0.0);
    }

    #[test]
    fn what_makes_no_sense_is_refused() {
        let of = |k| Permeability::constant(k).validate();
        assert_eq!(of(0.0), Ok(()));
        assert_eq!(of(-1e-3), Err(PermeabilityError::Value(-1e-3)));
        assert!(of(f64::NAN).is_err() && of(f64::INFINITY).is_err());
        let with = |solid_share, power, exponent| {
            let strain = Some(HolmesMow { solid_share, power, exponent });
            Permeability { at_rest_mm4_per_n_s: 1e-3, strain }.validate()
        };
        assert_eq!(with(1.0, 2.0, 1.0), Err(PermeabilityError::SolidShare(1.0)));
        assert_eq!(with(0.2, -1.0, 1.0), Err(PermeabilityError::Exponent(-1.0)));
        assert_eq!(with(0.2, 1.0, -1.0), Err(PermeabilityError::Exponent(-1.0)));
    }
}
