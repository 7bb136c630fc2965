//! Indenter `grating`: parallel ridges on a plate, and its signed distance.

use super::plate::THICKNESS_MM;
use super::rules::{BadValue, length, require, rounding};
use super::union::nearer;
use super::{Distance, RoundedPlate, SignedDistance};
use serde::{Deserialize, Serialize};

/// Parallel ridges along y on a base plate; their tops are at `z = 0`, the
/// grooves' floors at `z = -height_mm`.
///
/// The union of rounded bars with their base. Where a wall meets the floor of a groove
/// the surface has a concave corner, and the gap a kink; skin that has closed a groove
/// down to there is pushed by the nearer of the two.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Grating {
    /// Number of ridges.
    pub ridges: usize,
    /// Width of a ridge, mm.
    pub ridge_mm: f64,
    /// Width of a groove, mm.
    pub groove_mm: f64,
    /// Depth of the grooves, mm.
    pub height_mm: f64,
    /// Radius of all edges, mm.
    pub edge_radius_mm: f64,
    /// Length along y, mm.
    pub length_mm: f64,
}

impl Default for Grating {
    fn default() -> Self {
        Self {
            ridges: 5,
            ridge_mm: 1.5,
            groove_mm: 1.5,
            height_mm: 1.5,
            edge_radius_mm: 0.25,
            length_mm: 20.0,
        }
    }
}

/// Most ridges, or dots along a side.
pub(super) const COUNT_MAX: usize = 1000;

impl Grating {
    pub(super) fn validate(&self) -> Result<(), BadValue> {
        let some = (1..=COUNT_MAX).contains(&self.ridges);
        require(some, "ridges", &self.ridges, "has to be 1 to 1000")?;
        length("ridge_mm", self.ridge_mm)?;
        length("groove_mm", self.groove_mm)?;
        length("height_mm", self.height_mm)?;
        length("length_mm", self.length_mm)?;
        rounding(
            "edge_radius_mm",
            self.edge_radius_mm,
            0.5 * self.ridge_mm.min(self.length_mm).min(THICKNESS_MM),
            "has to be positive and at most half a ridge, half the length and 2 mm",
        )
    }

    /// Distance between neighbouring ridges' middles, mm.
    fn pitch_mm(&self) -> f64 {
        self.ridge_mm + self.groove_mm
    }

    fn bar(&self, half_width: f64, height: f64) -> RoundedPlate {
        RoundedPlate {
            half_mm: [half_width, 0.5 * self.length_mm, 0.5 * height],
            edge_radius_mm: self.edge_radius_mm,
        }
    }

    /// A ridge down to the underside of the base.
    fn ridge(&self) -> (RoundedPlate, f64) {
        let height = self.height_mm + THICKNESS_MM;
        (self.bar(0.5 * self.ridge_mm, height), -0.5 * height)
    }

    fn base(&self) -> (RoundedPlate, f64) {
        let half = 0.5 * ((self.ridges - 1) as f64 * self.pitch_mm() + self.ridge_mm);
        (self.bar(half, THICKNESS_MM), -self.height_mm - 0.5 * THICKNESS_MM)
    }
}

/// Coordinate from the nearest of `count` places `pitch` apart, centred at 0; of
/// two that are as near from the outer one, so that both sides are mirror images.
pub(super) fn from_nearest(x: f64, pitch: f64, count: usize) -> f64 {
    let last = (count - 1) as f64;
    let index = (x.abs() / pitch + 0.5 * last).round().min(last);
    let from = x.abs() - (index - 0.5 * last) * pitch;
    if x < 0.0 { -from } else { from }
}

impl SignedDistance for Grating {
    fn distance(&self, [x, y, z]: [f64; 3]) -> Distance {
        let (ridge, middle) = self.ridge();
        let (base, below) = self.base();
        let along = from_nearest(x, self.pitch_mm(), self.ridges);
        nearer(ridge.distance([along, y, z - middle]), base.distance([x, y, z - below]))
    }

    fn cost(&self) -> f64 {
        3.0
    }

    fn exits(&self, [x, y, z]: [f64; 3], each: &mut dyn FnMut(Distance) -> f64) {
        let (ridge, middle) = self.ridge();
        let (base, below) = self.base();
        let along = from_nearest(x, self.pitch_mm(), self.ridges);
        ridge.exits([along, y, z - middle], each);
        base.exits([x, y, z - below], each);
    }

    fn reach_mm(&self, direction: [f64; 3]) -> f64 {
        let (_, middle) = self.ridge();
        let (base, _) = self.base();
        let hull = self.bar(base.half_mm[0], -2.0 * middle);
        hull.reach_mm(direction) + direction[2] * middle
    }

    fn narrowest_mm(&self) -> f64 {
        self.ridge_mm
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Exactness, distance_tests};

    distance_tests! {
        grating: Grating::default() => Exactness::ExactOutside, detail_mm 0.25, mirrors [0, 1]
    }
    distance_tests! {
        even: Grating { ridges: 4, ridge_mm: 1.0, groove_mm: 0.4, ..Grating::default() } =>
            Exactness::ExactOutside, detail_mm 0.25, mirrors [0, 1]
    }

    #[test]
    fn ridges_and_grooves_are_where_they_should_be() {
        let gap = |x: f64, z: f64| Grating::default().distance([x, 0.0, z]).gap_mm;
        for ridge in [-6.0, -3.0, 0.0, 3.0, 6.0] {
            assert!((gap(ridge, 0.1) - 0.1).abs() < 1e-14, "{ridge}");
            // The middle of a wall, seen from the groove.
            assert!((gap(ridge + 0.75 + 0.2, -0.7) - 0.2).abs() < 1e-14, "{ridge}");
        }
        assert!((gap(1.5, -1.4) - 0.1).abs() < 1e-14, "the floor of a groove");
        assert!((gap(6.75 + 1.0, -3.0) - 1.0).abs() < 1e-14, "the outer side");
        assert!((gap(0.0, -5.5 - 1.0) - 1.0).abs() < 1e-14, "the underside");
    }
}
