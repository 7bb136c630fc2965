//! Several parts as one indenter.

use super::rules::{BadValue, require};
use super::spec::{IndenterError, IndenterSpec};
use super::{Distance, Placed, Placement, SignedDistance};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Parts that move as one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Union {
    /// The parts.
    pub parts: Vec<Part>,
}

/// A part of a union: a shape, moved and turned.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// What it is.
    pub part: IndenterSpec,
    /// Where its own origin lies in the union's frame, mm.
    #[serde(default)]
    pub at_mm: [f64; 3],
    /// Turn about the union's y, degrees.
    #[serde(default)]
    pub pitch_deg: f64,
    /// Turn about the union's x, degrees.
    #[serde(default)]
    pub roll_deg: f64,
    /// Turn about its own z, degrees; the first of the three.
    #[serde(default)]
    pub yaw_deg: f64,
}

/// Most parts of a union.
const PARTS_MAX: usize = 64;

impl Union {
    pub(super) fn validate(&self) -> Result<(), BadValue> {
        let some = (1..=PARTS_MAX).contains(&self.parts.len());
        require(some, "parts", &self.parts.len(), "has to list 1 to 64 parts")?;
        for (i, part) in self.parts.iter().enumerate() {
            part.validate().map_err(|e| e.under(&format!("parts[{i}]")))?;
        }
        Ok(())
    }

    pub(super) fn bound_mm(&self, direction: [f64; 3]) -> f64 {
        let bound = |part: &Part| part.placement().along_mm(direction, |d| part.part.bound_mm(d));
        self.parts.iter().map(bound).fold(f64::NEG_INFINITY, f64::max)
    }

    pub(super) fn build(&self, folder: &Path) -> Result<AnyOf, IndenterError> {
        let placed = |part: &Part| {
            Ok(Placed { part: part.part.build(folder)?, placement: part.placement() })
        };
        let parts = self.parts.iter().map(placed).collect::<Result<_, IndenterError>>()?;
        Ok(AnyOf { parts })
    }
}

impl Part {
    fn validate(&self) -> Result<(), BadValue> {
        let near = self.at_mm.iter().all(|v| v.abs() <= 1000.0);
        require(near, "at_mm", &self.at_mm, "has to be within 1000 mm")?;
        let angles =
            [("pitch_deg", self.pitch_deg), ("roll_deg", self.roll_deg), ("yaw_deg", self.yaw_deg)];
        for (field, angle) in angles {
            require(angle.abs() <= 180.0, field, &angle, "has to be within -180 to 180")?;
        }
        let level = self.pitch_deg == 0.0 && self.roll_deg == 0.0;
        require(
            level || !matches!(self.part, IndenterSpec::Heightmap(_)),
            "pitch_deg",
            &[self.pitch_deg, self.roll_deg],
            "and roll_deg have to be 0 for a heightmap, which has no sides: turn the whole \
             indenter by motion.pitch_deg",
        )?;
        self.part.validate_part().map_err(|e| e.under("part"))
    }

    fn placement(&self) -> Placement {
        Placement::turned(self.pitch_deg, self.roll_deg, self.yaw_deg, self.at_mm)
    }
}

/// The union of parts: its gap is that of the nearest one.
///
/// At a seam, where two parts are as near, the gap is continuous and its gradient jumps to
/// the other part's. On the surface that is a concave corner, which skin rarely fills: a
/// node there is pushed by one part, or by the other after it has slid across; Newton's
/// line search accepts the kink because the contact potential is continuous. In the air
/// it is of no matter.
pub struct AnyOf {
    /// The parts.
    pub parts: Vec<Placed>,
}

/// The distance that is less; the first one where they tie.
pub(super) fn nearer(a: Distance, b: Distance) -> Distance {
    if b.gap_mm < a.gap_mm { b } else { a }
}

impl SignedDistance for AnyOf {
    /// Infinitely far from nothing.
    fn distance(&self, p: [f64; 3]) -> Distance {
        let nothing =
            Distance { gap_mm: f64::INFINITY, normal: [0.0, 0.0, 1.0], hessian: [[0.0; 3]; 3] };
        self.parts.iter().map(|part| part.distance(p)).fold(nothing, nearer)
    }

    fn reach_mm(&self, direction: [f64; 3]) -> f64 {
        self.parts.iter().map(|part| part.reach_mm(direction)).fold(f64::NEG_INFINITY, f64::max)
    }

    fn clearance_mm(&self, p: [f64; 3]) -> f64 {
        self.parts.iter().map(|part| part.clearance_mm(p)).fold(f64::INFINITY, f64::min)
    }

    fn narrowest_mm(&self) -> f64 {
        self.parts.iter().map(Placed::narrowest_mm).fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::indenter::testing::{Exactness, distance_tests};
    use crate::indenter::{Cylinder, Sphere};

    fn union() -> Union {
        let part =
            |part, at_mm, pitch_deg| Part { part, at_mm, pitch_deg, roll_deg: 0.0, yaw_deg: 0.0 };
        Union {
            parts: vec![
                part(IndenterSpec::Sphere(Sphere { radius_mm: 2.0 }), [1.0, 0.0, 0.5], 0.0),
                part(IndenterSpec::Cylinder(Cylinder::default()), [0.0; 3], 20.0),
            ],
        }
    }

    distance_tests! {
        sphere_and_cylinder: union().build(Path::new("")).unwrap() =>
            Exactness::ExactOutside, detail_mm 1.0, mirrors [1]
    }

    #[test]
    fn the_nearest_part_counts_and_the_highest_is_the_top() {
        let any = union().build(Path::new("")).unwrap();
        // The sphere's pole at z = 2.5; the cylinder's axis is y, so pitch leaves its top.
        assert!((any.distance([1.0, 0.0, 4.0]).gap_mm - (17f64.sqrt() - 3.0)).abs() < 1e-12);
        assert!((any.distance([1.0, 0.0, 0.5]).gap_mm + 2.0).abs() < 1.0);
        for up in [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [-1.0, 0.0, 0.0]] {
            assert!((any.reach_mm(up) - union().bound_mm(up)).abs() < 1e-12, "{up:?}");
        }
        assert!((union().bound_mm([0.0, 0.0, 1.0]) - 3.0).abs() < 1e-12);
    }
}
