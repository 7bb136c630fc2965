//! One quantity compared with its reference.

use serde::Serialize;

/// One row of the table: what this code finds against what it should.
#[derive(Clone, Debug, Serialize)]
pub struct Check {
    /// What is compared, with its unit.
    pub quantity: String,
    /// Value of this code.
    pub value: f64,
    /// What it should be; the bound nearest to the value if a band is accepted.
    pub reference: f64,
    /// Where the reference comes from.
    pub source: &'static str,
    /// Distance from the reference, as `tolerance` counts it.
    pub difference: f64,
    /// Largest difference accepted.
    pub tolerance: f64,
    /// Whether the row is within tolerance.
    pub pass: bool,
}

impl Check {
    fn new(
        quantity: String,
        [value, reference, difference, tolerance]: [f64; 4],
        source: &'static str,
    ) -> Self {
        // A difference that is not a number does not pass.
        let pass = difference <= tolerance;
        Self { quantity, value, reference, source, difference, tolerance, pass }
    }

    /// `|value - reference| / |reference|` within `tolerance`.
    #[must_use]
    pub fn relative(
        quantity: impl Into<String>,
        value: f64,
        reference: f64,
        tolerance: f64,
        source: &'static str,
    ) -> Self {
        let difference = (value - reference).abs() / reference.abs();
        Self::new(quantity.into(), [value, reference, difference, tolerance], source)
    }

    /// `|value - reference|` within `tolerance`.
    #[must_use]
    pub fn absolute(
        quantity: impl Into<String>,
        value: f64,
        reference: f64,
        tolerance: f64,
        source: &'static str,
    ) -> Self {
        let difference = (value - reference).abs();
        Self::new(quantity.into(), [value, reference, difference, tolerance], source)
    }

    /// An error measure that should be zero, up to `tolerance`.
    #[must_use]
    pub fn vanishes(
        quantity: impl Into<String>,
        value: f64,
        tolerance: f64,
        source: &'static str,
    ) -> Self {
        Self::new(quantity.into(), [value, 0.0, value.abs(), tolerance], source)
    }

    /// A value accepted up to `most`.
    #[must_use]
    pub fn at_most(
        quantity: impl Into<String>,
        value: f64,
        most: f64,
        source: &'static str,
    ) -> Self {
        let difference = if value <= most { 0.0 } else { value - most };
        Self::new(quantity.into(), [value, most, difference, 0.0], source)
    }

    /// A value accepted anywhere from `low` to `high`.
    #[must_use]
    pub fn within(
        quantity: impl Into<String>,
        value: f64,
        [low, high]: [f64; 2],
        source: &'static str,
    ) -> Self {
        let difference = if value.is_nan() { value } else { (low - value).max(value - high) };
        let reference = if value < low { low } else { high };
        let quantity = format!("{} ({low:.3} to {high:.3})", quantity.into());
        let row = [value, reference, difference.max(0.0), 0.0];
        let mut check = Self::new(quantity, row, source);
        check.pass &= !value.is_nan();
        check
    }

    /// Share of its tolerance that the check uses up; infinite where it does not pass.
    pub(crate) fn strain(&self) -> f64 {
        let share = if self.pass { self.difference / self.tolerance } else { f64::INFINITY };
        // A band has no tolerance: 0 / 0 counts as no strain.
        if share.is_nan() { 0.0 } else { share }
    }

    /// A case that ended with an error.
    #[must_use]
    pub fn failed(error: &(dyn std::error::Error + Send + Sync)) -> Self {
        Self::new(format!("failed: {error}"), [f64::NAN, f64::NAN, f64::NAN, 0.0], "")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_a_number_never_passes() {
        let nan = f64::NAN;
        assert!(!Check::relative("", nan, 1.0, 1.0, "").pass);
        assert!(!Check::absolute("", nan, 1.0, 1.0, "").pass);
        assert!(!Check::vanishes("", nan, 1.0, "").pass);
        assert!(!Check::at_most("", nan, 1.0, "").pass);
        assert!(!Check::at_most("", 1.0, nan, "").pass);
        assert!(!Check::within("", nan, [0.0, 1.0], "").pass);
        assert!(!Check::failed(&std::fmt::Error).pass);
    }

    #[test]
    fn a_band_accepts_its_ends_and_no_more() {
        for (value, pass) in [(1.0, true), (2.0, true), (0.999, false), (2.001, false)] {
            assert_eq!(Check::within("", value, [1.0, 2.0], "").pass, pass, "{value}");
            assert_eq!(Check::at_most("", value, 2.0, "").pass, value <= 2.0, "{value}");
        }
    }
}
