//! A mesh from a file.

use super::Mesh;
use super::rules::{BadValue, ShapeError, require};
use crate::MeshDistance;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Unit of lengths in a file of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum LengthUnit {
    /// Millimetre.
    #[default]
    #[serde(rename = "mm")]
    Millimetre,
    /// Centimetre.
    #[serde(rename = "cm")]
    Centimetre,
    /// Metre.
    #[serde(rename = "m")]
    Metre,
    /// Inch.
    #[serde(rename = "in")]
    Inch,
}

#[cfg(feature = "files")]
impl LengthUnit {
    const fn mm(self) -> f64 {
        match self {
            Self::Millimetre => 1.0,
            Self::Centimetre => 10.0,
            Self::Metre => 1e3,
            Self::Inch => 25.4,
        }
    }
}

/// A body whose surface is in a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct MeshFile {
    /// STL, OBJ, PLY or GLB, relative to the scene's folder.
    pub file: PathBuf,
    /// Unit of its lengths.
    #[serde(default)]
    pub unit: LengthUnit,
    /// What the file holds, once it was read.
    #[serde(skip)]
    pub mesh: Option<Arc<Mesh>>,
}

impl MeshFile {
    pub(super) fn validate(&self) -> Result<(), BadValue> {
        let named = !self.file.as_os_str().is_empty();
        require(named, "file", &self.file, "has to name an STL, OBJ, PLY or GLB file")
    }

    /// Reads the file, which `folder` is the place of, if it was not read.
    pub(super) fn load(&mut self, folder: &Path) -> Result<(), ShapeError> {
        if self.mesh.is_none() {
            self.mesh = Some(Arc::new(self.read(folder)?));
        }
        Ok(())
    }

    /// Refuses the file: this build reads none.
    #[cfg(not(feature = "files"))]
    fn read(&self, folder: &Path) -> Result<Mesh, ShapeError> {
        let message = "this program is built without the feature `files`".into();
        Err(ShapeError::MeshFile { path: folder.join(&self.file), message })
    }

    #[cfg(feature = "files")]
    fn read(&self, folder: &Path) -> Result<Mesh, ShapeError> {
        let path = folder.join(&self.file);
        let read = crate::files::surface(&path, self.unit.mm());
        read.map_err(|error| ShapeError::MeshFile { path, message: error.to_string() })
    }

    /// How far it goes along a unit vector, mm; infinite before the file was read.
    pub(super) fn bound_mm(&self, direction: [f64; 3]) -> f64 {
        let along = |p: &[f64; 3]| crate::vector::dot(*p, direction);
        self.mesh.as_ref().map_or(f64::INFINITY, |mesh| {
            mesh.vertices_mm.iter().map(along).fold(f64::NEG_INFINITY, f64::max)
        })
    }

    /// Its signed distance.
    pub(super) fn build(&self, folder: &Path) -> Result<MeshDistance, ShapeError> {
        let read = match &self.mesh {
            Some(mesh) => Arc::clone(mesh),
            None => Arc::new(self.read(folder)?),
        };
        read.build().map_err(|error| ShapeError::MeshFile {
            path: folder.join(&self.file),
            message: error.to_string(),
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::IndenterSpec;
    use std::fmt::Write as _;

    /// A box of 4 x 6 x 2 mm about the origin as an OBJ, in units of `unit_mm`.
    fn obj(unit_mm: f64) -> String {
        let mut text = String::new();
        for corner in 0..8 {
            let side = |bit: i32, half: f64| if corner >> bit & 1 == 1 { half } else { -half };
            let p = [side(0, 2.0), side(1, 3.0), side(2, 1.0)].map(|v| v / unit_mm);
            writeln!(text, "v {} {} {}", p[0], p[1], p[2]).unwrap();
        }
        // Faces at the least and greatest x, y and z, counter-clockwise from outside.
        for f in ["1 5 7 3", "2 4 8 6", "1 2 6 5", "3 7 8 4", "1 3 4 2", "5 6 8 7"] {
            writeln!(text, "f {f}").unwrap();
        }
        text
    }

    #[test]
    fn a_file_is_the_body_that_it_holds_in_its_unit() {
        let folder = tempfile::tempdir().unwrap();
        for (name, unit_mm) in [("mm", 1.0), ("m", 1e3), ("in", 25.4)] {
            let file = format!("box-{name}.obj");
            std::fs::write(folder.path().join(&file), obj(unit_mm)).unwrap();
            let text = format!("shape = \"mesh\"\nfile = \"{file}\"\nunit = \"{name}\"");
            let mut spec: IndenterSpec = toml::from_str(&text).unwrap();
            spec.validate().unwrap();
            assert!(spec.top_mm().is_infinite(), "nobody has read it");
            spec.load(folder.path()).unwrap();
            assert!((spec.top_mm() - 1.0).abs() < 1e-5, "{name}: {}", spec.top_mm());
            let shape = spec.build(folder.path()).unwrap();
            for (p, due_mm) in [([0.0, 0.0, 3.0], 2.0), ([0.0; 3], -1.0), ([5.0, 7.0, 1.0], 5.0)] {
                let found = shape.distance(p).gap_mm;
                assert!((found - due_mm).abs() < 1e-5, "{name} at {p:?}: {found}");
            }
            assert_eq!(
                toml::to_string(&spec).unwrap().trim(),
                text,
                "the corners stay in the file"
            );
        }
    }

    #[test]
    fn a_file_of_an_open_surface_is_the_body_that_it_goes_round() {
        let folder = tempfile::tempdir().unwrap();
        let open = obj(1.0).replace("f 5 6 8 7\n", "");
        std::fs::write(folder.path().join("open.obj"), open).unwrap();
        let spec: IndenterSpec = toml::from_str("shape = \"mesh\"\nfile = \"open.obj\"").unwrap();
        let shape = spec.build(folder.path()).unwrap();
        assert!((shape.distance([0.0, 0.0, 3.0]).gap_mm - 2.0).abs() < 1e-12);
        let said = shape.mended();
        assert!(said.len() == 1 && said[0].contains("1 hole was closed"), "{said:?}");
    }

    #[test]
    fn a_file_that_is_no_body_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let refused = |file: &str, text: &str| {
            std::fs::write(folder.path().join(file), text).unwrap();
            let mut spec: IndenterSpec =
                toml::from_str(&format!("shape = \"mesh\"\nfile = \"{file}\"")).unwrap();
            let loaded = spec.load(folder.path());
            loaded.and_then(|()| spec.build(folder.path()).map(drop)).unwrap_err().to_string()
        };
        // Two sides that face each other go round nothing.
        let sides = ["f 1 5 7 3", "f 2 4 8 6"];
        let whole = obj(1.0);
        let kept = whole.lines().filter(|line| line.starts_with('v') || sides.contains(line));
        let open = kept.collect::<Vec<_>>().join("\n");
        for (file, text, word) in [
            ("a.step", "", ".stl, .obj, .ply or .glb"),
            ("b.obj", "v 0 0 0\n", "no triangles"),
            ("c.obj", open.as_str(), "no inside"),
        ] {
            let said = refused(file, text);
            assert!(said.contains(file) && said.contains(word), "{said}");
        }
        let spec: IndenterSpec = toml::from_str("shape = \"mesh\"\nfile = \"d.stl\"").unwrap();
        let said = spec.build(folder.path()).err().unwrap().to_string();
        assert!(said.contains("cannot read") && said.contains("d.stl"), "{said}");
    }
}
