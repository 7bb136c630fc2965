//! The table of a scene or campaign that describes an indenter, and the shape that it stands for.

use super::rules::{BadValue, ShapeError, parts, placed, require};
use super::{
    AnyOf, Capsule, Cuboid, Cylinder, Dots, Grating, Heightmap, MeshFile, Placed, Placement, Plate,
    Punch, Ring, RoundedPlate, SignedDistance, Sphere, Torus, Wedge,
};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

/// An indenter as a scene describes it: `shape = "plate"` and its dimensions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "shape", rename_all = "snake_case")]
pub enum IndenterSpec {
    /// Flat plate with rounded edges.
    Plate(Plate),
    /// Sphere.
    Sphere(Sphere),
    /// Lying cylinder.
    Cylinder(Cylinder),
    /// Wedge, or an edge.
    Wedge(Wedge),
    /// Upright cylinder with a flat end.
    Punch(Punch),
    /// Upright tube.
    Ring(Ring),
    /// Box with rounded edges.
    #[serde(rename = "box")]
    Cuboid(Cuboid),
    /// Lying bar that ends in half balls.
    Capsule(Capsule),
    /// Ring of round section, lying flat.
    Torus(Torus),
    /// Parallel ridges.
    Grating(Grating),
    /// Braille-like dots.
    Dots(Dots),
    /// Surface from a picture.
    Heightmap(Heightmap),
    /// Body from a file of triangles.
    Mesh(MeshFile),
    /// Several of them, each moved and turned.
    Union(Union),
}

impl Default for IndenterSpec {
    /// The 20 mm plate of the surface-pressure study.
    fn default() -> Self {
        Self::Plate(Plate::default())
    }
}

impl IndenterSpec {
    /// Name of the shape in scenes.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Plate(_) => "plate",
            Self::Sphere(_) => "sphere",
            Self::Cylinder(_) => "cylinder",
            Self::Wedge(_) => "wedge",
            Self::Punch(_) => "punch",
            Self::Ring(_) => "ring",
            Self::Cuboid(_) => "box",
            Self::Capsule(_) => "capsule",
            Self::Torus(_) => "torus",
            Self::Grating(_) => "grating",
            Self::Dots(_) => "dots",
            Self::Heightmap(_) => "heightmap",
            Self::Mesh(_) => "mesh",
            Self::Union(_) => "union",
        }
    }

    /// Checks every dimension.
    ///
    /// # Errors
    /// [`ShapeError::Value`] names the field and its rule.
    pub fn validate(&self) -> Result<(), ShapeError> {
        Ok(self.validate_part().map_err(|e| e.under("indenter"))?)
    }

    pub(super) fn validate_part(&self) -> Result<(), BadValue> {
        match self {
            Self::Plate(s) => s.validate(),
            Self::Sphere(s) => s.validate(),
            Self::Cylinder(s) => s.validate(),
            Self::Wedge(s) => s.validate(),
            Self::Punch(s) => s.validate(),
            Self::Ring(s) => s.validate(),
            Self::Cuboid(s) => s.validate(),
            Self::Capsule(s) => s.validate(),
            Self::Torus(s) => s.validate(),
            Self::Grating(s) => s.validate(),
            Self::Dots(s) => s.validate(),
            Self::Heightmap(s) => s.validate(),
            Self::Mesh(s) => s.validate(),
            Self::Union(s) => s.validate(),
        }
    }

    /// Height of its highest point over its origin, mm; a heightmap's is white, which its
    /// picture may stay below.
    #[must_use]
    pub fn top_mm(&self) -> f64 {
        self.bound_mm([0.0, 0.0, 1.0])
    }

    /// How far it goes at most along a unit vector, mm from its origin.
    pub(super) fn bound_mm(&self, direction: [f64; 3]) -> f64 {
        let upright = direction[2] >= 1.0;
        match self {
            Self::Plate(s) if upright => RoundedPlate::from(s).half_mm[2],
            Self::Plate(s) => RoundedPlate::from(s).reach_mm(direction),
            Self::Sphere(s) => s.reach_mm(direction),
            Self::Cylinder(s) => s.reach_mm(direction),
            Self::Wedge(s) => s.reach_mm(direction),
            Self::Punch(s) => s.reach_mm(direction),
            Self::Ring(s) => s.reach_mm(direction),
            Self::Cuboid(s) if upright => 0.5 * s.size_mm[2],
            Self::Cuboid(s) => RoundedPlate::from(s).reach_mm(direction),
            Self::Capsule(s) => Cylinder::from(s).reach_mm(direction),
            Self::Torus(s) => s.reach_mm(direction),
            Self::Grating(s) => s.reach_mm(direction),
            Self::Dots(s) => s.reach_mm(direction),
            Self::Heightmap(_) if upright => 0.0,
            Self::Heightmap(_) => f64::INFINITY,
            Self::Mesh(s) => s.bound_mm(direction),
            Self::Union(s) => s.bound_mm(direction),
        }
    }

    /// Reads the meshes that it is made from, relative to `folder`: where they end is not known before.
    ///
    /// # Errors
    /// [`ShapeError::MeshFile`] if a file cannot be read.
    pub fn load(&mut self, folder: &Path) -> Result<(), ShapeError> {
        match self {
            Self::Mesh(s) => s.load(folder),
            Self::Union(s) => s.parts.iter_mut().try_for_each(|p| p.part.load(folder)),
            _ => Ok(()),
        }
    }

    /// The files that it is made from.
    #[must_use]
    pub fn files(&self) -> Vec<&Path> {
        match self {
            Self::Heightmap(s) => vec![&s.file],
            Self::Mesh(s) => vec![&s.file],
            Self::Union(s) => s.parts.iter().flat_map(|p| p.part.files()).collect(),
            _ => Vec::new(),
        }
    }

    /// The shape; files are read from `folder`.
    ///
    /// # Errors
    /// [`ShapeError::Picture`] and [`ShapeError::MeshFile`] if a file cannot be taken.
    pub fn build(&self, folder: &Path) -> Result<Arc<dyn SignedDistance>, ShapeError> {
        Ok(match self {
            Self::Plate(s) => shared(RoundedPlate::from(s)),
            Self::Sphere(s) => shared(*s),
            Self::Cylinder(s) => shared(*s),
            Self::Wedge(s) => shared(*s),
            Self::Punch(s) => shared(*s),
            Self::Ring(s) => shared(*s),
            Self::Cuboid(s) => shared(RoundedPlate::from(s)),
            Self::Capsule(s) => shared(Cylinder::from(s)),
            Self::Torus(s) => shared(*s),
            Self::Grating(s) => shared(*s),
            Self::Dots(s) => shared(*s),
            Self::Heightmap(s) => shared(s.read(folder)?),
            Self::Mesh(s) => shared(s.build(folder)?),
            Self::Union(s) => shared(s.build(folder)?),
        })
    }
}

fn shared(shape: impl SignedDistance + 'static) -> Arc<dyn SignedDistance> {
    Arc::new(shape)
}

/// Parts that move as one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Union {
    /// The parts.
    pub parts: Vec<Part>,
}

/// A part of a union: a shape, moved and turned.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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

impl Union {
    fn validate(&self) -> Result<(), BadValue> {
        parts(self.parts.len())?;
        for (i, part) in self.parts.iter().enumerate() {
            part.validate().map_err(|e| e.under(&format!("parts[{i}]")))?;
        }
        Ok(())
    }

    fn bound_mm(&self, direction: [f64; 3]) -> f64 {
        let bound = |part: &Part| part.placement().along_mm(direction, |d| part.part.bound_mm(d));
        self.parts.iter().map(bound).fold(f64::NEG_INFINITY, f64::max)
    }

    fn build(&self, folder: &Path) -> Result<AnyOf, ShapeError> {
        let placed = |part: &Part| {
            Ok(Placed { part: part.part.build(folder)?, placement: part.placement() })
        };
        let parts = self.parts.iter().map(placed).collect::<Result<_, ShapeError>>()?;
        Ok(AnyOf::new(parts))
    }
}

impl Part {
    fn validate(&self) -> Result<(), BadValue> {
        placed(self.at_mm, [self.pitch_deg, self.roll_deg, self.yaw_deg])?;
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

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<IndenterSpec, String> {
        let spec: IndenterSpec = toml::from_str(text).map_err(|e| e.to_string())?;
        spec.validate().map_err(|e| e.to_string())?;
        Ok(spec)
    }

    #[test]
    fn a_shape_takes_its_defaults_and_comes_back() {
        let names = [
            "plate", "sphere", "cylinder", "wedge", "punch", "ring", "box", "capsule", "torus",
            "grating", "dots",
        ];
        for name in names {
            let spec = parse(&format!("shape = \"{name}\"")).unwrap();
            assert_eq!(spec.name(), name);
            assert_eq!(parse(&toml::to_string(&spec).unwrap()).unwrap(), spec);
            let shape = spec.build(Path::new("")).unwrap();
            let top = shape.distance([0.0, 0.0, spec.top_mm() + 1.0]).gap_mm;
            assert!(top >= 1.0 - 1e-12, "{name}: nothing is above the top, but {top}");
            assert!((shape.reach_mm([0.0, 0.0, 1.0]) - spec.top_mm()).abs() < 1e-12, "{name}");
        }
        let union = "shape = \"union\"\nparts = [{ part = { shape = \"sphere\" }, at_mm = [0, 0, 1] }, \
                     { part = { shape = \"union\", parts = [{ part = { shape = \"wedge\" } }] } }]";
        let spec = parse(union).unwrap();
        assert_eq!(spec.top_mm().to_bits(), 6f64.to_bits());
        assert_eq!(parse(&toml::to_string(&spec).unwrap()).unwrap(), spec);
    }

    #[test]
    fn what_makes_no_sense_is_named() {
        let cases = [
            ("shape = \"cube\"", "cube"),
            ("shape = \"sphere\"\nradius = 3.0", "radius"),
            ("shape = \"sphere\"\nradius_mm = -3.0", "indenter.radius_mm = -3.0"),
            ("shape = \"plate\"\nedge_radius_mm = 11.0", "indenter.edge_radius_mm"),
            ("shape = \"grating\"\nedge_radius_mm = 0.0", "indenter.edge_radius_mm"),
            ("shape = \"dots\"\nheight_mm = 1.0", "indenter.height_mm"),
            ("shape = \"dots\"\nplate_mm = [5.0, 5.0]", "indenter.plate_mm"),
            ("shape = \"ring\"\ninner_radius_mm = 5.0", "indenter.inner_radius_mm"),
            ("shape = \"heightmap\"\nsize_mm = [1.0, 1.0]\nheight_mm = 1.0", "file"),
            ("shape = \"union\"\nparts = []", "indenter.parts"),
            (
                "shape = \"union\"\nparts = [{ part = { shape = \"sphere\", radius_mm = nan } }]",
                "indenter.parts[0].part.radius_mm",
            ),
            (
                "shape = \"union\"\nparts = [{ pitch_deg = 3.0, part = { shape = \"heightmap\", \
                 file = \"a.png\", size_mm = [1.0, 1.0], height_mm = 1.0 } }]",
                "indenter.parts[0].pitch_deg",
            ),
        ];
        for (text, word) in cases {
            let error = parse(text).unwrap_err();
            assert!(error.contains(word), "{error} should name {word}");
        }
    }
}

#[cfg(test)]
mod union_tests {
    use super::*;
    use crate::testing::{Exactness, distance_tests};

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
            Exactness::OuterOfCurved, detail_mm 1.0, mirrors [1]
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
