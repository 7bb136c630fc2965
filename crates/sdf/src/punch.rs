//! Indenter `punch`: an upright cylinder with a flat end, and its signed distance.

use super::beneath::tangents;
use super::revolved::{Rectangle, disc_reach_mm, revolve};
use super::rules::{BadValue, length, rounding};
use super::{Distance, SignedDistance};
use serde::{Deserialize, Serialize};

/// An upright cylinder with rounded rims; the middle of its flat end is the
/// origin, its body below.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Punch {
    /// Outer radius, mm.
    pub radius_mm: f64,
    /// Radius of the rim, mm; the flat part of the end is what it leaves.
    pub rim_radius_mm: f64,
    /// Height, mm; more than the skin can reach round.
    pub height_mm: f64,
}

impl Default for Punch {
    fn default() -> Self {
        Self { radius_mm: 3.0, rim_radius_mm: 0.25, height_mm: 6.0 }
    }
}

impl Punch {
    pub(super) fn validate(&self) -> Result<(), BadValue> {
        length("radius_mm", self.radius_mm)?;
        length("height_mm", self.height_mm)?;
        rounding(
            "rim_radius_mm",
            self.rim_radius_mm,
            self.radius_mm.min(0.5 * self.height_mm),
            "has to be positive and at most the radius and half the height",
        )
    }
}

impl SignedDistance for Punch {
    fn distance(&self, p: [f64; 3]) -> Distance {
        let half = 0.5 * self.height_mm;
        let section = Rectangle { half_mm: [self.radius_mm, half], radius_mm: self.rim_radius_mm };
        revolve(p, 2, |[r, z]| section.distance([r, z + half]))
    }

    fn cost(&self) -> f64 {
        2.0
    }

    fn exits(&self, p: [f64; 3], each: &mut dyn FnMut(Distance) -> f64) {
        let half = 0.5 * self.height_mm;
        let section = Rectangle { half_mm: [self.radius_mm, half], radius_mm: self.rim_radius_mm };
        each(self.distance(p));
        for side in 0..5 {
            each(revolve(p, 2, |[r, z]| section.sides([r, z + half])[side]));
        }
        tangents(p, self.radius_mm, &[0, 1], each);
    }

    fn reach_mm(&self, direction: [f64; 3]) -> f64 {
        let heights = [-self.height_mm, 0.0];
        disc_reach_mm(direction, 2, self.radius_mm, heights, self.rim_radius_mm)
    }

    fn narrowest_mm(&self) -> f64 {
        2.0 * self.radius_mm
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Exactness, distance_tests};

    distance_tests! {
        punch: Punch::default() => Exactness::Exact, detail_mm 0.25, mirrors [0, 1]
    }

    #[test]
    fn the_end_is_flat_and_the_rim_round() {
        let punch = Punch::default();
        for p in [[0.0, 0.0, 0.1], [2.7, 0.0, 0.1]] {
            let d = punch.distance(p);
            assert!((d.gap_mm - 0.1).abs() < 1e-15 && d.normal[2] >= 1.0);
            assert!(d.hessian.iter().flatten().all(|&v| v == 0.0));
        }
        // 45 degrees out from the rim's centre circle.
        let d = punch.distance([0.0, 2.75 + 1.0, -0.25 + 1.0]);
        assert!((d.gap_mm - (2f64.sqrt() - 0.25)).abs() < 1e-15);
    }
}
