//! Indenter `box`: a box with rounded edges, and its signed distance.

use super::RoundedPlate;
use super::rules::{BadValue, lengths, rounding};
use serde::{Deserialize, Serialize};

/// A box centred at the origin, its sides along the axes; its top is at half its height.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Cuboid {
    /// Side lengths along x, y and z, mm.
    pub size_mm: [f64; 3],
    /// Radius of its edges and corners, mm.
    pub edge_radius_mm: f64,
}

impl Default for Cuboid {
    fn default() -> Self {
        Self { size_mm: [10.0, 10.0, 10.0], edge_radius_mm: 1.0 }
    }
}

impl Cuboid {
    pub(super) fn validate(&self) -> Result<(), BadValue> {
        lengths("size_mm", &self.size_mm)?;
        rounding(
            "edge_radius_mm",
            self.edge_radius_mm,
            0.5 * self.size_mm.into_iter().fold(f64::INFINITY, f64::min),
            "has to be positive and at most half the shortest side",
        )
    }
}

impl From<&Cuboid> for RoundedPlate {
    fn from(cuboid: &Cuboid) -> Self {
        Self {
            half_mm: cuboid.size_mm.map(|side| 0.5 * side),
            edge_radius_mm: cuboid.edge_radius_mm,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SignedDistance;
    use crate::testing::{Exactness, distance_tests};

    distance_tests! {
        cuboid: RoundedPlate::from(&Cuboid { size_mm: [8.0, 6.0, 5.0], edge_radius_mm: 0.5 }) =>
            Exactness::Exact, detail_mm 0.5, mirrors [0, 1, 2]
    }

    #[test]
    fn its_sides_lie_at_half_its_size() {
        let cuboid = Cuboid { size_mm: [8.0, 6.0, 5.0], edge_radius_mm: 0.5 };
        let shape = RoundedPlate::from(&cuboid);
        for (i, half) in [4.0, 3.0, 2.5].into_iter().enumerate() {
            for sign in [-1.0, 1.0] {
                let on = |far: f64| std::array::from_fn(|k| if k == i { sign * far } else { 0.0 });
                let d = shape.distance(on(half + 0.75));
                assert!((d.gap_mm - 0.75).abs() < 1e-15, "{d:?}");
                assert_eq!(d.normal.map(f64::to_bits), on(1.0).map(|v| (v + 0.0).to_bits()));
            }
        }
        // From the centre of a corner's ball, along its diagonal.
        let corner = [3.5, 2.5, 2.0].map(|c| c + 1.0);
        let due = 3f64.sqrt() - 0.5;
        assert!((shape.distance(corner).gap_mm - due).abs() < 1e-15);
    }

    #[test]
    fn an_edge_that_leaves_no_side_is_refused() {
        for edge_radius_mm in [0.0, 2.6, f64::NAN] {
            let cuboid = Cuboid { size_mm: [8.0, 6.0, 5.0], edge_radius_mm };
            assert_eq!(cuboid.validate().unwrap_err().field, "edge_radius_mm");
        }
        let flat = Cuboid { size_mm: [8.0, -6.0, 5.0], ..Cuboid::default() };
        assert_eq!(flat.validate().unwrap_err().field, "size_mm");
    }
}
