//! Indenter `cylinder`: a bar along y with rounded ends, and its signed distance.

use super::beneath::tangents;
use super::revolved::{Rectangle, disc_reach_mm, revolve};
use super::rules::{BadValue, length, rounding};
use super::{Distance, SignedDistance};
use serde::{Deserialize, Serialize};

/// A cylinder along y, centred at the origin; its top is at `z = radius_mm`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Cylinder {
    /// Radius, mm.
    pub radius_mm: f64,
    /// Length with its rounded ends, mm.
    pub length_mm: f64,
    /// Radius that rounds the ends, mm; equal to `radius_mm` they are half spheres.
    pub end_radius_mm: f64,
}

impl Default for Cylinder {
    fn default() -> Self {
        Self { radius_mm: 3.0, length_mm: 30.0, end_radius_mm: 1.0 }
    }
}

impl Cylinder {
    pub(super) fn validate(&self) -> Result<(), BadValue> {
        length("radius_mm", self.radius_mm)?;
        length("length_mm", self.length_mm)?;
        rounding(
            "end_radius_mm",
            self.end_radius_mm,
            self.radius_mm.min(0.5 * self.length_mm),
            "has to be positive and at most the radius and half the length",
        )
    }
}

impl SignedDistance for Cylinder {
    fn distance(&self, p: [f64; 3]) -> Distance {
        let section = Rectangle {
            half_mm: [self.radius_mm, 0.5 * self.length_mm],
            radius_mm: self.end_radius_mm,
        };
        revolve(p, 1, |q| section.distance(q))
    }

    fn cost(&self) -> f64 {
        2.0
    }

    fn exits(&self, p: [f64; 3], each: &mut dyn FnMut(Distance) -> f64) {
        let section = Rectangle {
            half_mm: [self.radius_mm, 0.5 * self.length_mm],
            radius_mm: self.end_radius_mm,
        };
        each(self.distance(p));
        for side in 0..5 {
            each(revolve(p, 1, |q| section.sides(q)[side]));
        }
        tangents(p, self.radius_mm, &[0, 2], each);
    }

    fn reach_mm(&self, direction: [f64; 3]) -> f64 {
        let half = 0.5 * self.length_mm;
        disc_reach_mm(direction, 1, self.radius_mm, [-half, half], self.end_radius_mm)
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
        cylinder: Cylinder::default() => Exactness::Exact, detail_mm 1.0, mirrors [0, 1, 2]
    }
    distance_tests! {
        capsule: Cylinder { radius_mm: 2.0, length_mm: 10.0, end_radius_mm: 2.0 } =>
            Exactness::Exact, detail_mm 2.0, mirrors [0, 1, 2]
    }

    #[test]
    fn the_side_curves_across_and_not_along() {
        let d = Cylinder::default().distance([3.0, 2.0, 4.0]);
        assert!((d.gap_mm - 2.0).abs() < 1e-15);
        assert!((d.normal[0] - 0.6).abs() < 1e-15 && (d.normal[2] - 0.8).abs() < 1e-15);
        let trace = (0..3).map(|i| d.hessian[i][i]).sum::<f64>();
        assert!((trace - 1.0 / 5.0).abs() < 1e-15 && d.hessian[1].iter().all(|&v| v == 0.0));
    }
}
