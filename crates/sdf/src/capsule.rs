//! Indenter `capsule`: a bar along y that ends in half balls, and its signed distance.

use super::Cylinder;
use super::rules::{BadValue, length, require};
use serde::{Deserialize, Serialize};

/// A bar along y that ends in half balls, centred at the origin; its top is at `z = radius_mm`. All
/// points whose distance from a segment is the radius.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Capsule {
    /// Radius, mm.
    pub radius_mm: f64,
    /// Length with both half balls, mm.
    pub length_mm: f64,
}

impl Default for Capsule {
    fn default() -> Self {
        Self { radius_mm: 3.0, length_mm: 20.0 }
    }
}

impl Capsule {
    pub(super) fn validate(&self) -> Result<(), BadValue> {
        length("radius_mm", self.radius_mm)?;
        length("length_mm", self.length_mm)?;
        let fits = self.length_mm >= 2.0 * self.radius_mm;
        require(fits, "length_mm", &self.length_mm, "has to be at least twice the radius")
    }
}

impl From<&Capsule> for Cylinder {
    fn from(&Capsule { radius_mm, length_mm }: &Capsule) -> Self {
        Self { radius_mm, length_mm, end_radius_mm: radius_mm }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SignedDistance;
    use papilla_vector::norm;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// The distance from the segment between the centres of its ends, less the radius.
        #[test]
        fn it_is_as_far_as_its_segment(
            p in prop::array::uniform3(-15.0..15.0f64), radius_mm in 0.1..5.0f64, more in 0.0..20.0f64,
        ) {
            let capsule = Capsule { radius_mm, length_mm: 2.0 * radius_mm + more };
            prop_assert!(capsule.validate().is_ok());
            let foot = p[1].clamp(-0.5 * more, 0.5 * more);
            let away = [p[0], p[1] - foot, p[2]];
            let found = Cylinder::from(&capsule).distance(p);
            prop_assert!((found.gap_mm - (norm(away) - radius_mm)).abs() < 1e-12);
            let due = away.map(|v| v / norm(away));
            prop_assert!((0..3).all(|i| (found.normal[i] - due[i]).abs() < 1e-9));
        }
    }

    #[test]
    fn one_that_is_shorter_than_its_ends_is_refused() {
        let short = Capsule { radius_mm: 3.0, length_mm: 5.9 };
        assert_eq!(short.validate().unwrap_err().field, "length_mm");
        let none = Capsule { radius_mm: 0.0, ..Capsule::default() };
        assert_eq!(none.validate().unwrap_err().field, "radius_mm");
    }
}
