//! Indenters in scenes and campaigns.

use super::rules::BadValue;
use super::{
    Cylinder, Dots, Grating, Heightmap, Plate, Punch, Ring, RoundedPlate, SignedDistance, Sphere,
    Union, Wedge,
};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// An indenter as a scene describes it: `shape = "plate"` and its dimensions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
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
    /// Parallel ridges.
    Grating(Grating),
    /// Braille-like dots.
    Dots(Dots),
    /// Surface from a picture.
    Heightmap(Heightmap),
    /// Several of them, each moved and turned.
    Union(Union),
}

impl Default for IndenterSpec {
    /// S1's plate.
    fn default() -> Self {
        Self::Plate(Plate::default())
    }
}

/// Why an indenter was refused, or does not meet the body.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IndenterError {
    /// A dimension makes no sense.
    #[error(transparent)]
    Value(#[from] BadValue),
    /// A picture cannot be taken as a height map.
    #[error("indenter.file: {} cannot be a height map: {message}", path.display())]
    Picture {
        /// The picture.
        path: PathBuf,
        /// Why, and the cure.
        message: String,
    },
    /// It goes by.
    #[error(
        "the indenter never meets the body on its way: bring it nearer by motion.offset_mm and \
         the angles, or take a larger one"
    )]
    NeverTouches,
    /// A part of it fits between the nodes that contact is found at.
    #[error(
        "the indenter is finer than the mesh: {by_mm:.3} mm of it goes in between the nodes of a face \
         {face_mm:.3} mm wide before one is touched. Take a finer mesh, or an indenter as wide as a few faces"
    )]
    FinerThanMesh {
        /// How deep a face's middle is in the indenter at first touch of a node, mm.
        by_mm: f64,
        /// Width of the face, mm.
        face_mm: f64,
    },
    /// It is in the body before it moves.
    #[error(
        "the indenter starts {by_mm:.3e} mm inside the body: move it back along its way \
         (motion.offset_mm, angles)"
    )]
    StartsInside {
        /// How deep, mm.
        by_mm: f64,
    },
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
            Self::Grating(_) => "grating",
            Self::Dots(_) => "dots",
            Self::Heightmap(_) => "heightmap",
            Self::Union(_) => "union",
        }
    }

    /// Checks every dimension.
    ///
    /// # Errors
    /// [`IndenterError::Value`] names the field and its rule.
    pub fn validate(&self) -> Result<(), IndenterError> {
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
            Self::Grating(s) => s.validate(),
            Self::Dots(s) => s.validate(),
            Self::Heightmap(s) => s.validate(),
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
            Self::Grating(s) => s.reach_mm(direction),
            Self::Dots(s) => s.reach_mm(direction),
            Self::Heightmap(_) if upright => 0.0,
            Self::Heightmap(_) => f64::INFINITY,
            Self::Union(s) => s.bound_mm(direction),
        }
    }

    /// The pictures that it is made from.
    #[must_use]
    pub fn pictures(&self) -> Vec<&Path> {
        match self {
            Self::Heightmap(s) => vec![&s.file],
            Self::Union(s) => s.parts.iter().flat_map(|p| p.part.pictures()).collect(),
            _ => Vec::new(),
        }
    }

    /// The shape; pictures are read from `folder`.
    ///
    /// # Errors
    /// [`IndenterError::Picture`] if a picture cannot be read.
    pub fn build(&self, folder: &Path) -> Result<Arc<dyn SignedDistance>, IndenterError> {
        Ok(match self {
            Self::Plate(s) => shared(RoundedPlate::from(s)),
            Self::Sphere(s) => shared(*s),
            Self::Cylinder(s) => shared(*s),
            Self::Wedge(s) => shared(*s),
            Self::Punch(s) => shared(*s),
            Self::Ring(s) => shared(*s),
            Self::Grating(s) => shared(*s),
            Self::Dots(s) => shared(*s),
            Self::Heightmap(s) => shared(s.read(folder)?),
            Self::Union(s) => shared(s.build(folder)?),
        })
    }
}

fn shared(shape: impl SignedDistance + 'static) -> Arc<dyn SignedDistance> {
    Arc::new(shape)
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
        let names = ["plate", "sphere", "cylinder", "wedge", "punch", "ring", "grating", "dots"];
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
