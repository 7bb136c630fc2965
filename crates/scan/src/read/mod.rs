//! Files of surfaces: STL, OBJ, PLY and GLB.

mod glb;

use super::{ScanError, Surface};
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};
use std::io::Cursor;
use std::path::Path;

/// Unit of lengths in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Millimetre.
    Millimetre,
    /// Centimetre.
    Centimetre,
    /// Metre.
    Metre,
    /// Inch.
    Inch,
    /// Micrometre.
    Micrometre,
}

impl Unit {
    /// All of them, the likeliest first.
    pub const ALL: [Self; 5] =
        [Self::Millimetre, Self::Metre, Self::Centimetre, Self::Inch, Self::Micrometre];

    /// As it is written.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Millimetre => "mm",
            Self::Centimetre => "cm",
            Self::Metre => "m",
            Self::Inch => "in",
            Self::Micrometre => "um",
        }
    }

    /// Its length, mm.
    #[must_use]
    pub const fn mm(self) -> f64 {
        match self {
            Self::Millimetre => 1.0,
            Self::Centimetre => 10.0,
            Self::Metre => 1e3,
            Self::Inch => 25.4,
            Self::Micrometre => 1e-3,
        }
    }

    /// The unit of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|u| u.name() == name)
    }
}

/// Size from corner to corner of what is believed a finger or a hand, mm.
const SIZE_MM: [f64; 2] = [12.0, 450.0];
/// Largest file that is read.
const BYTES_MAX: u64 = 1 << 30;

/// Reads a surface; the ending of the name says which kind it is.
///
/// # Errors
/// [`ScanError::Read`], [`ScanError::Format`]; [`ScanError::Unit`] if it has a finger's size in
/// another unit alone.
pub fn surface(path: &Path, unit: Unit) -> Result<Surface, ScanError> {
    let failed = |source| ScanError::Read { path: path.into(), source };
    let format = |message: String| ScanError::Format { path: path.into(), message };
    let size = std::fs::metadata(path).map_err(failed)?.len();
    if size > BYTES_MAX {
        return Err(format(format!("has {} MB, 1 GB is the most: simplify it", size >> 20)));
    }
    let bytes = std::fs::read(path).map_err(failed)?;
    let kind = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
    let read = match kind.as_str() {
        "stl" => stl(&bytes),
        "obj" => obj(&bytes),
        "ply" => ply(&bytes),
        "glb" => glb::read(&bytes),
        _ => Err("is no .stl, .obj, .ply or .glb file".into()),
    };
    let mut surface = read.map_err(format)?;
    if surface.triangles.is_empty() {
        return Err(format("holds no triangles: a cloud of points has to be meshed first".into()));
    }
    for p in &mut surface.vertices_mm {
        *p = p.map(|v| unit.mm() * v);
    }
    let unused = |t: &[u32; 3]| t.iter().any(|&c| c as usize >= surface.vertices_mm.len());
    if let Some(triangle) = surface.triangles.iter().position(unused) {
        return Err(format(format!("triangle {triangle} names a corner that is not there")));
    }
    if let Some(vertex) = surface.vertices_mm.iter().position(|p| !p.iter().all(|v| v.is_finite()))
    {
        return Err(format(format!("corner {vertex} is not a finite number")));
    }
    believed(&surface, unit)?;
    Ok(surface)
}

/// Refuses a size that no finger has.
fn believed(surface: &Surface, unit: Unit) -> Result<(), ScanError> {
    let mm = surface.diagonal_mm();
    let is_a_size = |mm: f64| (SIZE_MM[0]..=SIZE_MM[1]).contains(&mm);
    if is_a_size(mm) {
        return Ok(());
    }
    let diagonal = mm / unit.mm();
    let meant: Vec<_> = Unit::ALL.into_iter().filter(|u| is_a_size(diagonal * u.mm())).collect();
    let Some(first) = meant.first() else {
        return Err(ScanError::Size { diagonal, unit: unit.name() });
    };
    let word = |u: &Unit| match u {
        Unit::Millimetre => "millimetres",
        Unit::Centimetre => "centimetres",
        Unit::Metre => "metres",
        Unit::Inch => "inches",
        Unit::Micrometre => "micrometres",
    };
    Err(ScanError::Unit {
        diagonal,
        unit: unit.name(),
        meant: meant.iter().map(word).collect::<Vec<_>>().join(" or "),
        first: first.name(),
    })
}

fn stl(bytes: &[u8]) -> Result<Surface, String> {
    let mesh =
        stl_io::read_stl(&mut Cursor::new(bytes)).map_err(|e| format!("no STL file: {e}"))?;
    Ok(Surface {
        vertices_mm: mesh.vertices.iter().map(|v| v.0.map(f64::from)).collect(),
        triangles: mesh.faces.iter().map(|f| f.vertices.map(|v| v as u32)).collect(),
    })
}

fn obj(bytes: &[u8]) -> Result<Surface, String> {
    let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
    // Materials do not matter: none is looked for.
    let materials = |_: &Path| Ok((Vec::new(), Default::default()));
    let (models, _) = tobj::load_obj_buf(&mut Cursor::new(bytes), &options, materials)
        .map_err(|e| format!("no OBJ file: {e}"))?;
    let mut surface = Surface::default();
    for tobj::Model { mesh, .. } in models {
        let first = surface.vertices_mm.len() as u32;
        let corners = mesh.positions.chunks_exact(3);
        surface.vertices_mm.extend(corners.map(|p| [p[0], p[1], p[2]].map(f64::from)));
        let triangles = mesh.indices.chunks_exact(3);
        surface.triangles.extend(triangles.map(|t| [t[0] + first, t[1] + first, t[2] + first]));
    }
    Ok(surface)
}

fn ply(bytes: &[u8]) -> Result<Surface, String> {
    let ply = Parser::<DefaultElement>::new()
        .read_ply(&mut Cursor::new(bytes))
        .map_err(|e| format!("no PLY file: {e}"))?;
    let vertices = ply.payload.get("vertex").ok_or("has no element `vertex`")?;
    let number = |element: &DefaultElement, name: &str| match element.get(name) {
        Some(Property::Float(v)) => Ok(f64::from(*v)),
        Some(Property::Double(v)) => Ok(*v),
        _ => Err(format!("its vertices have no float `{name}`")),
    };
    let mut surface = Surface::default();
    for v in vertices {
        surface.vertices_mm.push([number(v, "x")?, number(v, "y")?, number(v, "z")?]);
    }
    for face in ply.payload.get("face").into_iter().flatten() {
        let list = face.get("vertex_indices").or_else(|| face.get("vertex_index"));
        let corners: Vec<u32> = match list {
            Some(Property::ListInt(l)) => l.iter().map(|&i| i as u32).collect(),
            Some(Property::ListUInt(l)) => l.clone(),
            Some(Property::ListUShort(l)) => l.iter().map(|&i| u32::from(i)).collect(),
            Some(Property::ListUChar(l)) => l.iter().map(|&i| u32::from(i)).collect(),
            _ => return Err("its faces have no list `vertex_indices`".into()),
        };
        let rest = corners.get(1..).unwrap_or_default();
        surface.triangles.extend(rest.windows(2).map(|w| [corners[0], w[0], w[1]]));
    }
    Ok(surface)
}
