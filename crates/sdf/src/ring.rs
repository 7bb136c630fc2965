//! Indenter `ring`: the end of an upright tube, and its signed distance.

use super::beneath::tangents;
use super::revolved::{Rectangle, disc_reach_mm, revolve};
use super::rules::{BadValue, length, require, rounding};
use super::{Distance, SignedDistance};
use serde::{Deserialize, Serialize};

/// An upright tube with rounded rims about the z axis, its end at `z = 0`, its
/// body below.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Ring {
    /// Outer radius, mm.
    pub outer_radius_mm: f64,
    /// Radius of the hole, mm.
    pub inner_radius_mm: f64,
    /// Radius of the four rims, mm.
    pub rim_radius_mm: f64,
    /// Height, mm; more than the skin can reach.
    pub height_mm: f64,
}

impl Default for Ring {
    fn default() -> Self {
        Self { outer_radius_mm: 4.0, inner_radius_mm: 3.0, rim_radius_mm: 0.25, height_mm: 6.0 }
    }
}

impl Ring {
    pub(super) fn validate(&self) -> Result<(), BadValue> {
        length("outer_radius_mm", self.outer_radius_mm)?;
        length("height_mm", self.height_mm)?;
        require(
            self.inner_radius_mm > 0.0 && self.inner_radius_mm < self.outer_radius_mm,
            "inner_radius_mm",
            &self.inner_radius_mm,
            "has to be positive and less than the outer radius",
        )?;
        rounding(
            "rim_radius_mm",
            self.rim_radius_mm,
            0.5 * (self.outer_radius_mm - self.inner_radius_mm).min(self.height_mm),
            "has to be positive and at most half the wall and half the height",
        )
    }
}

impl SignedDistance for Ring {
    /// The axis is a kink, as far from the wall on every side.
    fn distance(&self, p: [f64; 3]) -> Distance {
        let half = 0.5 * self.height_mm;
        let middle = 0.5 * (self.outer_radius_mm + self.inner_radius_mm);
        let wall = 0.5 * (self.outer_radius_mm - self.inner_radius_mm);
        let section = Rectangle { half_mm: [wall, half], radius_mm: self.rim_radius_mm };
        revolve(p, 2, |[r, z]| section.distance([r - middle, z + half]))
    }

    fn cost(&self) -> f64 {
        2.0
    }

    fn exits(&self, p: [f64; 3], each: &mut dyn FnMut(Distance) -> f64) {
        let half = 0.5 * self.height_mm;
        let middle = 0.5 * (self.outer_radius_mm + self.inner_radius_mm);
        let wall = 0.5 * (self.outer_radius_mm - self.inner_radius_mm);
        let section = Rectangle { half_mm: [wall, half], radius_mm: self.rim_radius_mm };
        each(self.distance(p));
        for side in 0..8 {
            each(revolve(p, 2, |[r, z]| section.sides([r - middle, z + half])[side]));
        }
        tangents(p, self.outer_radius_mm, &[0, 1], each);
    }

    fn reach_mm(&self, direction: [f64; 3]) -> f64 {
        let heights = [-self.height_mm, 0.0];
        disc_reach_mm(direction, 2, self.outer_radius_mm, heights, self.rim_radius_mm)
    }

    fn narrowest_mm(&self) -> f64 {
        self.outer_radius_mm - self.inner_radius_mm
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Exactness, distance_tests};

    distance_tests! {
        ring: Ring::default() => Exactness::Exact, detail_mm 0.25, mirrors [0, 1]
    }

    #[test]
    fn the_hole_is_a_hole() {
        let ring = Ring::default();
        let inside = ring.distance([2.0, 0.0, -1.0]);
        assert!((inside.gap_mm - 1.0).abs() < 1e-15 && inside.normal[0] <= -1.0);
        // The hollow side bends the other way.
        assert!((inside.hessian[1][1] + 0.5).abs() < 1e-15);
        assert!((ring.distance([0.0, 3.5, 0.2]).gap_mm - 0.2).abs() < 1e-15);
        let axis = ring.distance([0.0, 0.0, -1.0]);
        assert!((axis.gap_mm - 3.0).abs() < 1e-15);
        assert!(axis.hessian.iter().flatten().all(|v| v.is_finite()));
    }
}
