//! Indenter `dots`: spherical caps on a plate, such as a Braille cell, and its signed distance.

use super::grating::{COUNT_MAX, from_nearest};
use super::plate::Plate;
use super::rules::{BadValue, length, require};
use super::sphere::Sphere;
use super::union::nearer;
use super::{Distance, RoundedPlate, SignedDistance};
use serde::{Deserialize, Serialize};

/// A grid of spherical caps on a plate; their tops are at `z = 0`, the plate's face at
/// `z = -height_mm`.
///
/// The default is a full Braille cell with the dimensions of the US National Library
/// Service's Specification 800: dots 1.44 mm wide at the base and 0.48 mm high,
/// 2.34 mm apart. Where a dot meets the plate the surface has a concave corner, and the
/// gap a kink; skin that reaches there is pushed by the nearer of the two.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Dots {
    /// Dots along x and y.
    pub count: [usize; 2],
    /// Distance between neighbours, mm.
    pub pitch_mm: f64,
    /// Width of a dot where it meets the plate, mm.
    pub base_mm: f64,
    /// Height of a dot, mm.
    pub height_mm: f64,
    /// Side lengths of the plate along x and y, mm; its edges are rounded by 1 mm.
    pub plate_mm: [f64; 2],
}

impl Default for Dots {
    fn default() -> Self {
        Self {
            count: [3, 2],
            pitch_mm: 2.34,
            base_mm: 1.44,
            height_mm: 0.48,
            plate_mm: [20.0, 20.0],
        }
    }
}

/// Radius of the plate's edges, mm.
const EDGE_RADIUS_MM: f64 = 1.0;

impl Dots {
    pub(super) fn validate(&self) -> Result<(), BadValue> {
        let some = self.count.iter().all(|n| (1..=COUNT_MAX).contains(n));
        require(some, "count", &self.count, "has to be 1 to 1000 along x and y")?;
        length("base_mm", self.base_mm)?;
        length("pitch_mm", self.pitch_mm)?;
        let apart = self.pitch_mm >= self.base_mm;
        require(apart, "pitch_mm", &self.pitch_mm, "has to be at least base_mm")?;
        require(
            self.height_mm > 0.0 && self.height_mm <= 0.5 * self.base_mm,
            "height_mm",
            &self.height_mm,
            "has to be positive and at most half of base_mm",
        )?;
        let holds = |i: usize| {
            let dots = (self.count[i] - 1) as f64 * self.pitch_mm + self.base_mm;
            self.plate_mm[i] >= dots + 2.0 * EDGE_RADIUS_MM && self.plate_mm[i] <= 1000.0
        };
        require(
            holds(0) && holds(1),
            "plate_mm",
            &self.plate_mm,
            "has to hold the dots with 1 mm of edge on every side, and be at most 1000 mm",
        )
    }

    /// Radius of the sphere of which a dot is the cap.
    fn radius_mm(&self) -> f64 {
        let half = 0.5 * self.base_mm;
        0.5 * (half * half / self.height_mm + self.height_mm)
    }

    fn plate(&self) -> (RoundedPlate, f64) {
        let plate = Plate { size_mm: self.plate_mm, edge_radius_mm: EDGE_RADIUS_MM };
        let plate = RoundedPlate::from(&plate);
        (plate, -self.height_mm - plate.half_mm[2])
    }
}

impl SignedDistance for Dots {
    fn distance(&self, [x, y, z]: [f64; 3]) -> Distance {
        let radius_mm = self.radius_mm();
        let [a, b] = [(x, self.count[0]), (y, self.count[1])]
            .map(|(v, count)| from_nearest(v, self.pitch_mm, count));
        let (plate, below) = self.plate();
        let dot = Sphere { radius_mm }.distance([a, b, z + radius_mm]);
        nearer(dot, plate.distance([x, y, z - below]))
    }

    fn cost(&self) -> f64 {
        3.0
    }

    fn exits(&self, [x, y, z]: [f64; 3], each: &mut dyn FnMut(Distance) -> f64) {
        let radius_mm = self.radius_mm();
        let [a, b] = [(x, self.count[0]), (y, self.count[1])]
            .map(|(v, count)| from_nearest(v, self.pitch_mm, count));
        let (plate, below) = self.plate();
        Sphere { radius_mm }.exits([a, b, z + radius_mm], each);
        plate.exits([x, y, z - below], each);
    }

    fn reach_mm(&self, direction: [f64; 3]) -> f64 {
        let (plate, below) = self.plate();
        let radius_mm = self.radius_mm();
        let side = |i: usize| 0.5 * (self.count[i] - 1) as f64 * self.pitch_mm;
        let dots = direction[0].abs() * side(0) + direction[1].abs() * side(1) + radius_mm
            - direction[2] * radius_mm;
        dots.max(plate.reach_mm(direction) + direction[2] * below)
    }

    fn narrowest_mm(&self) -> f64 {
        self.base_mm
    }
}

#[cfg(test)]
mod tests {
    use super::super::plate::THICKNESS_MM;
    use super::*;
    use crate::testing::{Exactness, distance_tests};

    distance_tests! {
        dots: Dots::default() => Exactness::ExactOutside, detail_mm 0.5, mirrors [0, 1]
    }

    #[test]
    fn a_dot_is_as_high_and_as_wide_as_it_says() {
        let dots = Dots::default();
        let gap = |p| dots.distance(p).gap_mm;
        for (x, y) in [(-2.34, 1.17), (0.0, -1.17), (2.34, 1.17)] {
            assert!((gap([x, y, 0.2]) - 0.2).abs() < 1e-14, "{x} {y}");
            assert!(gap([x + 0.72, y, -0.48]).abs() < 1e-14, "{x} {y}");
        }
        assert!((gap([1.17, 0.0, -0.38]) - 0.1).abs() < 1e-14, "the plate between dots");
        // A dot's sphere stays inside the plate.
        assert!(2.0 * dots.radius_mm() < dots.height_mm + THICKNESS_MM + 2.0 * EDGE_RADIUS_MM);
    }
}
