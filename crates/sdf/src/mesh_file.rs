//! Indenter `mesh` of a scene: triangles from an STL, OBJ, PLY or GLB file, in the unit it names.

use super::Mesh;
use super::mesh::{Decimated, MeshError, TRIANGLES_MAX};
use super::rules::{BadValue, ShapeError, require};
use crate::MeshDistance;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Unit of lengths in a file of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum LengthUnit {
    /// Millimetre.
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
    /// All of them, the likeliest first.
    const ALL: [Self; 4] = [Self::Millimetre, Self::Metre, Self::Centimetre, Self::Inch];

    const fn mm(self) -> f64 {
        match self {
            Self::Millimetre => 1.0,
            Self::Centimetre => 10.0,
            Self::Metre => 1e3,
            Self::Inch => 25.4,
        }
    }

    /// As a scene writes it.
    const fn name(self) -> &'static str {
        match self {
            Self::Millimetre => "mm",
            Self::Centimetre => "cm",
            Self::Metre => "m",
            Self::Inch => "in",
        }
    }

    /// What a file is in that says nothing of it: GLB is in metres by its standard, others are taken
    /// to be in mm.
    fn of(file: &Path) -> Self {
        let is_glb = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("glb"));
        if is_glb { Self::Metre } else { Self::Millimetre }
    }
}

/// Greatest side of what is believed to press a finger if no unit is given, mm; the loader of the
/// Python client believes the same.
#[cfg(feature = "files")]
const SIZE_MM: [f64; 2] = [0.5, 500.0];

/// A body whose surface is in a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct MeshFile {
    /// STL, OBJ, PLY or GLB, relative to the scene's folder.
    pub file: PathBuf,
    /// Unit of its lengths; GLB is in m and others are in mm if not given, and a size that looks wrong
    /// is asked about.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<LengthUnit>,
    /// What the file holds, once it was read.
    #[serde(skip)]
    pub surface: Option<Arc<FileSurface>>,
}

/// The surface that a file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct FileSurface {
    /// Its triangles: few enough to press with.
    pub mesh: Mesh,
    /// What was done where the file has more.
    pub decimated: Option<Decimated>,
}

impl MeshFile {
    pub(super) fn validate(&self) -> Result<(), BadValue> {
        let named = !self.file.as_os_str().is_empty();
        require(named, "file", &self.file, "has to name an STL, OBJ, PLY or GLB file")
    }

    /// Reads the file, which `folder` is the place of, if it was not read, and names the unit that it
    /// was taken in.
    pub(super) fn load(&mut self, folder: &Path) -> Result<(), ShapeError> {
        if self.surface.is_none() {
            self.surface = Some(Arc::new(self.read(folder)?));
            #[cfg(feature = "files")]
            self.unit.get_or_insert(LengthUnit::of(&self.file));
        }
        Ok(())
    }

    /// Refuses the file: this build reads none.
    #[cfg(not(feature = "files"))]
    fn read(&self, folder: &Path) -> Result<FileSurface, ShapeError> {
        let message = "this program is built without the feature `files`".into();
        Err(ShapeError::MeshFile { path: folder.join(&self.file), message })
    }

    #[cfg(feature = "files")]
    fn read(&self, folder: &Path) -> Result<FileSurface, ShapeError> {
        let path = folder.join(&self.file);
        let refused = |message| Err(ShapeError::MeshFile { path: path.clone(), message });
        let unit = self.unit.unwrap_or_else(|| LengthUnit::of(&self.file));
        let mesh = match crate::files::surface(&path, unit.mm()) {
            Ok(mesh) => mesh,
            Err(error) => return refused(error.to_string()),
        };
        if let (None, Err(doubt)) = (self.unit, believed(&mesh, unit)) {
            return refused(doubt);
        }
        match super::mesh::few_enough(&mesh) {
            Ok(None) => Ok(FileSurface { mesh, decimated: None }),
            Ok(Some((mesh, done))) => Ok(FileSurface { mesh, decimated: Some(done) }),
            Err(error) => refused(with_cure(&error, &path)),
        }
    }

    /// How far it goes along a unit vector, mm; infinite before the file was read.
    pub(super) fn bound_mm(&self, direction: [f64; 3]) -> f64 {
        let along = |p: &[f64; 3]| papilla_vector::dot(*p, direction);
        self.surface.as_ref().map_or(f64::INFINITY, |of| {
            of.mesh.vertices_mm.iter().map(along).fold(f64::NEG_INFINITY, f64::max)
        })
    }

    /// Its signed distance.
    pub(super) fn build(&self, folder: &Path) -> Result<MeshDistance, ShapeError> {
        let read = match &self.surface {
            Some(read) => Arc::clone(read),
            None => Arc::new(self.read(folder)?),
        };
        match read.mesh.build() {
            Ok(built) => Ok(built.with(read.decimated)),
            Err(error) => {
                let path = folder.join(&self.file);
                Err(ShapeError::MeshFile { message: with_cure(&error, &path), path })
            }
        }
    }
}

/// Why a mesh bounds no body; of one that cannot be decimated far enough also what else to do.
fn with_cure(error: &MeshError, path: &Path) -> String {
    match error {
        MeshError::Count { found } if *found > TRIANGLES_MAX => format!(
            "{found} triangles are left where decimation ends; {TRIANGLES_MAX} at most press. A mesh \
             program may get further (MeshLab: Quadric Edge Collapse Decimation; Blender: the modifier \
             Decimate), or leave parts of {} out that do not touch the finger",
            path.display()
        ),
        _ => error.to_string(),
    }
}

/// Refuses a size that is not plausible for what presses a finger, and says in which unit it would be.
#[cfg(feature = "files")]
fn believed(mesh: &Mesh, unit: LengthUnit) -> Result<(), String> {
    let side = |i: usize| {
        let along = || mesh.vertices_mm.iter().map(|p| p[i]);
        along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
    };
    let size_mm = (0..3).map(side).fold(0.0, f64::max);
    let [least, most] = SIZE_MM;
    if (least..=most).contains(&size_mm) {
        return Ok(());
    }
    let fits = LengthUnit::ALL.into_iter().filter_map(|other| {
        let meant_mm = size_mm / unit.mm() * other.mm();
        let fits = (least..=most).contains(&meant_mm);
        fits.then(|| format!("unit = \"{}\" ({meant_mm:.4} mm)", other.name()))
    });
    let meant = fits.collect::<Vec<_>>().join(" or ");
    let meant = if meant.is_empty() { "another size".into() } else { meant };
    Err(format!(
        "it would measure {size_mm:.4e} mm if its lengths are in {unit}: give {meant} if that is meant, \
         or unit = \"{unit}\" if it is so",
        unit = unit.name()
    ))
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

    /// A triangle pyramid with these edges as a GLB: one buffer of places, no indices.
    fn glb(edge: f32) -> Vec<u8> {
        let corners = [[0.0, 0.0, 0.0], [edge, 0.0, 0.0], [0.0, edge, 0.0], [0.0, 0.0, edge]];
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let places = faces.iter().flatten().flat_map(|&c: &usize| corners[c]);
        let binary: Vec<u8> = places.flat_map(f32::to_le_bytes).collect();
        let length = binary.len();
        let mut json = format!(
            "{{\"asset\":{{\"version\":\"2.0\"}},\"meshes\":[{{\"primitives\":[{{\"attributes\":\
             {{\"POSITION\":0}}}}]}}],\"accessors\":[{{\"bufferView\":0,\"componentType\":5126,\
             \"count\":12,\"type\":\"VEC3\"}}],\"bufferViews\":[{{\"byteLength\":{length}}}]}}"
        );
        json += &" ".repeat(3 - (json.len() + 3) % 4);
        let mut bytes = b"glTF".to_vec();
        let whole = 12 + 8 + json.len() + 8 + length;
        bytes.extend([2, whole as u32].into_iter().flat_map(u32::to_le_bytes));
        for (kind, chunk) in [(0x4E4F_534A_u32, json.as_bytes()), (0x004E_4942, &binary)] {
            bytes.extend([chunk.len() as u32, kind].into_iter().flat_map(u32::to_le_bytes));
            bytes.extend(chunk);
        }
        bytes
    }

    #[test]
    fn a_glb_is_in_metres_and_a_size_that_looks_wrong_is_asked_about() {
        let folder = tempfile::tempdir().unwrap();
        let taken = |file: &str, bytes: &[u8], unit: &str| {
            std::fs::write(folder.path().join(file), bytes).unwrap();
            let text = format!("shape = \"mesh\"\nfile = \"{file}\"\n{unit}");
            let mut spec: IndenterSpec = toml::from_str(&text).unwrap();
            spec.load(folder.path()).map_err(|e| e.to_string())?;
            Ok::<_, String>((spec.top_mm(), toml::to_string(&spec).unwrap()))
        };
        let (top_mm, text) = taken("a.glb", &glb(0.012), "").unwrap();
        assert!((top_mm - 12.0).abs() < 1e-5 && text.contains("unit = \"m\""), "{top_mm} {text}");
        let (top_mm, _) = taken("a.glb", &glb(12.0), "unit = \"mm\"").unwrap();
        assert!((top_mm - 12.0).abs() < 1e-5, "{top_mm}");
        let said = taken("a.glb", &glb(12.0), "").unwrap_err();
        assert!(
            said.contains("1.2000e4 mm") && said.contains("unit = \"mm\" (12.0000 mm)"),
            "{said}"
        );
        let said = taken("b.obj", obj(1e3).as_bytes(), "").unwrap_err();
        assert!(said.contains("unit = \"m\" (6.0000 mm)"), "{said}");
        // Said, it is not asked about.
        let (top_mm, _) = taken("b.obj", obj(1e3).as_bytes(), "unit = \"mm\"").unwrap();
        assert!((top_mm - 1e-3).abs() < 1e-9, "{top_mm}");
        let (top_mm, text) = taken("b.obj", obj(1.0).as_bytes(), "").unwrap();
        assert!((top_mm - 1.0).abs() < 1e-9 && text.contains("unit = \"mm\""), "{text}");
    }

    /// A plate of many small squares, its faces as even as they were.
    #[test]
    fn too_many_triangles_become_fewer_and_it_is_said_how_far_they_are_off() {
        let folder = tempfile::tempdir().unwrap();
        let (side, bulge_mm) = (120u32, 0.01);
        let mut text = String::new();
        // Two sheets, the upper one a bowl turned over, and a rim between them.
        for z in [0.0, 1.0] {
            for (i, j) in (0..side).flat_map(|i| (0..side).map(move |j| (i, j))) {
                let [x, y] = [i, j].map(|k| 2.0 * f64::from(k) / f64::from(side - 1) - 1.0);
                let round = z * bulge_mm * (1.0 - x * x) * (1.0 - y * y);
                text += &format!("v {x} {y} {}\n", z + round);
            }
        }
        let at = |i: u32, j: u32, top: bool| 1 + side * i + j + if top { side * side } else { 0 };
        let mut square =
            |[a, b, c, d]: [u32; 4]| text += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
        for (i, j) in (0..side - 1).flat_map(|i| (0..side - 1).map(move |j| (i, j))) {
            square([(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| at(i, j, true)));
            square([(i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)].map(|(i, j)| at(i, j, false)));
        }
        let last = side - 1;
        for k in 0..last {
            for [p, q] in [
                [(k, 0), (k + 1, 0)],
                [(last, k), (last, k + 1)],
                [(k + 1, last), (k, last)],
                [(0, k + 1), (0, k)],
            ] {
                let [low, high] = [false, true].map(|top| [p, q].map(|(i, j)| at(i, j, top)));
                square([low[0], low[1], high[1], high[0]]);
            }
        }
        std::fs::write(folder.path().join("many.obj"), text).unwrap();
        let mut spec: IndenterSpec =
            toml::from_str("shape = \"mesh\"\nfile = \"many.obj\"").unwrap();
        spec.load(folder.path()).unwrap();
        let shape = spec.build(folder.path()).unwrap();
        let said = shape.mended();
        assert!(said.len() == 1, "{said:?}");
        let told = 4 * (last * last + 2 * last);
        assert!(said[0].starts_with(&format!("{told} triangles became 16")), "{said:?}");
        let off_mm: f64 =
            said[0].split(" at most ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!(off_mm > 0.0 && off_mm < 1e-4, "{said:?}");
        // As far from points above as the bowl is, but for that.
        for [x, y] in [[0.0, 0.0], [0.5, 0.25], [-0.75, 0.5]] {
            let top_mm = 1.0 + bulge_mm * (1.0 - x * x) * (1.0 - y * y);
            let gap_mm = shape.distance([x, y, 2.0]).gap_mm;
            assert!((gap_mm - (2.0 - top_mm)).abs() < 1e-4, "{gap_mm} at {x}, {y}");
        }
        assert!((spec.top_mm() - 1.01).abs() < 1e-5, "{}", spec.top_mm());
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
