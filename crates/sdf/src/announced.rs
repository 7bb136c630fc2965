//! Shapes as a program tells them over a wire: nothing is read from files.

use super::rules::{BadValue, ShapeError, length, parts, placed, require};
use super::{
    AnyOf, Capsule, Cuboid, Cylinder, Dots, Grating, HeightField, IndenterSpec, Mesh, MeshError,
    Placed, Placement, Plate, Punch, Ring, SignedDistance, Sphere, Torus, Wedge,
};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

/// A shape of a scene, or a mesh; a height map lists its heights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "shape", rename_all = "snake_case")]
pub enum AnnouncedShape {
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
    /// Surface of listed heights.
    Heightmap(HeightGrid),
    /// Triangle mesh.
    Mesh(Mesh),
    /// Several of them, each moved and turned.
    Union(AnnouncedUnion),
}

/// Why what was announced is no shape.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum AnnouncedError {
    /// A dimension makes no sense.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// A mesh bounds no body.
    #[error("{field}: {source}")]
    Mesh {
        /// The mesh, dotted.
        field: String,
        /// What is wrong with it.
        source: MeshError,
    },
}

impl From<BadValue> for AnnouncedError {
    fn from(error: BadValue) -> Self {
        Self::Shape(error.into())
    }
}

/// A plate with a face of listed heights, see [`crate::Heightmap`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeightGrid {
    /// Heights along x.
    pub columns: usize,
    /// From one height to the next along x and y, mm.
    pub pixel_mm: [f64; 2],
    /// Heights over the origin, mm, by rows from the lowest y.
    pub heights_mm: Vec<f64>,
}

/// Parts that move as one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AnnouncedUnion {
    /// The parts.
    pub parts: Vec<AnnouncedPart>,
}

/// A part of a union, moved and turned as [`crate::Part`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AnnouncedPart {
    /// What it is: no union.
    pub part: Box<AnnouncedShape>,
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

/// A whole shape below this is a thousandth of what hands touch, mm.
const TINY_MM: f64 = 0.5;
/// Heights that differ by less are a thousandth of what a finger feels, mm.
const SMOOTH_MM: f64 = 1e-3;

/// Most heights of a height map.
const HEIGHTS_MAX: usize = 65_536;

impl AnnouncedShape {
    /// The shape.
    ///
    /// # Errors
    /// [`AnnouncedError`] names the member, `field` before it, and its rule.
    pub fn build(&self, field: &str) -> Result<Arc<dyn SignedDistance>, AnnouncedError> {
        self.build_until(field, &|| true)
    }

    /// The same for as long as `go_on` says so, which is asked now and then.
    ///
    /// # Errors
    /// As [`Self::build`]; [`MeshError::Stopped`] once `go_on` said no.
    pub fn build_until(
        &self,
        field: &str,
        go_on: &dyn Fn() -> bool,
    ) -> Result<Arc<dyn SignedDistance>, AnnouncedError> {
        let plain = match self {
            Self::Plate(s) => IndenterSpec::Plate(*s),
            Self::Sphere(s) => IndenterSpec::Sphere(*s),
            Self::Cylinder(s) => IndenterSpec::Cylinder(*s),
            Self::Wedge(s) => IndenterSpec::Wedge(*s),
            Self::Punch(s) => IndenterSpec::Punch(*s),
            Self::Ring(s) => IndenterSpec::Ring(*s),
            Self::Cuboid(s) => IndenterSpec::Cuboid(*s),
            Self::Capsule(s) => IndenterSpec::Capsule(*s),
            Self::Torus(s) => IndenterSpec::Torus(*s),
            Self::Grating(s) => IndenterSpec::Grating(*s),
            Self::Dots(s) => IndenterSpec::Dots(*s),
            Self::Heightmap(s) => return Ok(Arc::new(s.build().map_err(|e| e.under(field))?)),
            Self::Mesh(s) => {
                let refuse = |source| AnnouncedError::Mesh { field: field.to_owned(), source };
                return Ok(Arc::new(s.build_until(go_on).map_err(refuse)?));
            }
            Self::Union(s) => return Ok(Arc::new(s.build(field, go_on)?)),
        };
        plain.validate_part().map_err(|e| e.under(field))?;
        Ok(plain.build(Path::new(""))?)
    }

    /// A member of lengths that are so small that metres may have been meant, and the size in
    /// question, mm: that of the whole `built` shape, or what its heights differ by.
    #[must_use]
    pub fn tiny(&self, built: &dyn SignedDistance) -> Option<(&'static str, f64)> {
        if let Self::Heightmap(grid) = self {
            return grid.tiny();
        }
        let member = match self {
            Self::Sphere(_) | Self::Punch(_) | Self::Torus(_) => "radius_mm",
            Self::Plate(_) | Self::Cuboid(_) => "size_mm",
            Self::Cylinder(_) | Self::Capsule(_) | Self::Wedge(_) | Self::Grating(_) => "length_mm",
            Self::Ring(_) => "outer_radius_mm",
            Self::Dots(_) => "plate_mm",
            Self::Heightmap(_) | Self::Union(_) => "parts",
            Self::Mesh(_) => "vertices_mm",
        };
        let wide = |i: usize| {
            let along =
                |sign| built.reach_mm(std::array::from_fn(|k| if k == i { sign } else { 0.0 }));
            along(1.0) + along(-1.0)
        };
        let largest = (0..3).map(wide).fold(0.0, f64::max);
        (largest < TINY_MM).then_some((member, largest))
    }

    /// Numbers that it takes memory for: triangles of meshes and heights.
    #[must_use]
    pub fn size(&self) -> usize {
        match self {
            Self::Mesh(s) => s.triangles.len(),
            Self::Heightmap(s) => s.heights_mm.len(),
            Self::Union(s) => s.parts.iter().map(|p| p.part.size()).sum(),
            _ => 0,
        }
    }
}

impl HeightGrid {
    fn tiny(&self) -> Option<(&'static str, f64)> {
        let rows = self.heights_mm.len() / self.columns.max(1);
        let wide = (self.columns as f64 * self.pixel_mm[0]).max(rows as f64 * self.pixel_mm[1]);
        let fold =
            |pick: fn(f64, f64) -> f64, from| self.heights_mm.iter().copied().fold(from, pick);
        let range = fold(f64::max, f64::NEG_INFINITY) - fold(f64::min, f64::INFINITY);
        if wide < TINY_MM {
            Some(("pixel_mm", wide))
        } else {
            (range > 0.0 && range < SMOOTH_MM).then_some(("heights_mm", range))
        }
    }

    fn build(&self) -> Result<HeightField, BadValue> {
        let n = self.heights_mm.len();
        let fits = self.columns >= 2 && n >= 2 * self.columns && n.is_multiple_of(self.columns);
        let rule = "has to be two or more, and heights_mm two or more whole rows of it";
        require(fits, "columns", &self.columns, rule)?;
        require(n <= HEIGHTS_MAX, "heights_mm", &n, "has to list 65536 heights at most")?;
        for pixel_mm in self.pixel_mm {
            length("pixel_mm", pixel_mm)?;
        }
        let low = self.heights_mm.iter().find(|h| !(h.abs() <= 1000.0));
        require(low.is_none(), "heights_mm", &low, "has to be within 1000 mm")?;
        let count = [self.columns, n / self.columns];
        Ok(HeightField::new(count, self.pixel_mm, self.heights_mm.clone()))
    }
}

impl AnnouncedUnion {
    fn build(&self, field: &str, go_on: &dyn Fn() -> bool) -> Result<AnyOf, AnnouncedError> {
        parts(self.parts.len()).map_err(|e| e.under(field))?;
        let parts = self.parts.iter().enumerate();
        let parts = parts.map(|(i, part)| part.build(&format!("{field}.parts[{i}]"), go_on));
        Ok(AnyOf::new(parts.collect::<Result<_, AnnouncedError>>()?))
    }
}

impl AnnouncedPart {
    fn build(&self, field: &str, go_on: &dyn Fn() -> bool) -> Result<Placed, AnnouncedError> {
        let check = || {
            let turns = [self.pitch_deg, self.roll_deg, self.yaw_deg];
            placed(self.at_mm, turns)?;
            let nested = matches!(*self.part, AnnouncedShape::Union(_));
            require(!nested, "part", &"union", "has to be no union: list its parts here")?;
            let flat = turns[0] == 0.0 && turns[1] == 0.0;
            let level = flat || !matches!(*self.part, AnnouncedShape::Heightmap(_));
            require(level, "pitch_deg", &turns, "and roll_deg have to be 0 for a height map")
        };
        check().map_err(|e| e.under(field))?;
        let [pitch, roll, yaw] = [self.pitch_deg, self.roll_deg, self.yaw_deg];
        let placement = Placement::turned(pitch, roll, yaw, self.at_mm);
        let part = self.part.build_until(&format!("{field}.part"), go_on)?;
        Ok(Placed { part, placement })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn built(text: &str) -> Result<Arc<dyn SignedDistance>, String> {
        let shape: AnnouncedShape = toml::from_str(text).map_err(|e| e.to_string())?;
        shape.build("objects[2].shape").map_err(|e| e.to_string())
    }

    #[test]
    fn what_a_scene_names_is_what_it_is_there() {
        let names = [
            "plate", "sphere", "cylinder", "wedge", "punch", "ring", "box", "capsule", "torus",
            "grating", "dots",
        ];
        for name in names {
            let text = format!("shape = \"{name}\"");
            let found = built(&text).expect("a shape");
            let scene: IndenterSpec = toml::from_str(&text).expect("a scene's shape");
            let due = scene.build(Path::new("")).expect("a shape");
            for p in [[0.3, 0.2, 4.0], [1.0, -2.0, -1.0]] {
                assert_eq!(found.distance(p), due.distance(p), "{name}");
            }
        }
    }

    #[test]
    fn heights_and_unions_are_told_whole() {
        let text = "shape = \"union\"\nparts = [{ part = { shape = \"heightmap\", columns = 2, \
                    pixel_mm = [1.0, 1.0], heights_mm = [1.0, 1.0, 1.0, 1.0] } }, { at_mm = \
                    [0.0, 0.0, 9.0], part = { shape = \"sphere\", radius_mm = 1.0 } }]";
        let shape = built(text).expect("a shape");
        assert!((shape.distance([5.0, 0.0, 2.0]).gap_mm - 1.0).abs() < 1e-12);
        assert!((shape.distance([0.0, 0.0, 11.0]).gap_mm - 1.0).abs() < 1e-12);
    }

    #[test]
    fn what_makes_no_shape_is_named() {
        let cases = [
            ("shape = \"sphere\"\nradius_mm = 0.0", "objects[2].shape.radius_mm"),
            ("shape = \"sphere\"\nradius_mm = nan", "objects[2].shape.radius_mm"),
            ("shape = \"cube\"", "cube"),
            ("shape = \"mesh\"\nvertices_mm = []\ntriangles = []", "objects[2].shape: triangles"),
            (
                "shape = \"heightmap\"\ncolumns = 3\npixel_mm = [1, 1]\nheights_mm = [1.0]",
                "columns",
            ),
            ("shape = \"heightmap\"\nfile = \"/etc/passwd\"", "file"),
            (
                "shape = \"union\"\nparts = [{ part = { shape = \"union\", parts = [] } }]",
                "objects[2].shape.parts[0].part",
            ),
            (
                "shape = \"union\"\nparts = [{ part = { shape = \"ring\", inner_radius_mm = 9.0 } }]",
                "objects[2].shape.parts[0].part.inner_radius_mm",
            ),
        ];
        for (text, word) in cases {
            let error = built(text).err().expect("refused");
            assert!(error.contains(word), "{error} should name {word}");
        }
    }
}
