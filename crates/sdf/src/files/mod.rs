//! Files of surfaces: STL, OBJ, PLY and GLB.

mod glb;

use crate::Mesh;
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// Why a file holds no surface.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// It cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Not a surface of a known kind.
    #[error("{}: {message}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong, with the cure.
        message: String,
    },
}

/// Largest file that is read.
const BYTES_MAX: u64 = 1 << 30;

/// Reads a surface, whose lengths are `unit_mm` long; the ending of the name says which kind it is.
///
/// # Errors
/// [`FileError`].
pub fn surface(path: &Path, unit_mm: f64) -> Result<Mesh, FileError> {
    let failed = |source| FileError::Read { path: path.into(), source };
    let format = |message: String| FileError::Format { path: path.into(), message };
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
        *p = p.map(|v| unit_mm * v);
    }
    let unused = |t: &[u32; 3]| t.iter().any(|&c| c as usize >= surface.vertices_mm.len());
    if let Some(triangle) = surface.triangles.iter().position(unused) {
        return Err(format(format!("triangle {triangle} names a corner that is not there")));
    }
    if let Some(vertex) = surface.vertices_mm.iter().position(|p| !p.iter().all(|v| v.is_finite()))
    {
        return Err(format(format!("corner {vertex} is not a finite number")));
    }
    Ok(surface)
}

fn stl(bytes: &[u8]) -> Result<Mesh, String> {
    let mesh = stl_io::read_stl(&mut Cursor::new(bytes)).map_err(|e| match e.kind() {
        std::io::ErrorKind::UnexpectedEof => "no STL file, or one that was cut short".to_owned(),
        _ => format!("no STL file: {e}"),
    })?;
    Ok(Mesh {
        vertices_mm: mesh.vertices.iter().map(|v| v.0.map(f64::from)).collect(),
        triangles: mesh.faces.iter().map(|f| f.vertices.map(|v| v as u32)).collect(),
    })
}

fn obj(bytes: &[u8]) -> Result<Mesh, String> {
    let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
    // Materials do not matter: none is looked for.
    let materials = |_: &Path| Ok((Vec::new(), Default::default()));
    let (models, _) = tobj::load_obj_buf(&mut Cursor::new(bytes), &options, materials)
        .map_err(|e| format!("no OBJ file: {e}"))?;
    let mut surface = Mesh::default();
    for tobj::Model { mesh, .. } in models {
        let first = surface.vertices_mm.len() as u32;
        let corners = mesh.positions.chunks_exact(3);
        surface.vertices_mm.extend(corners.map(|p| [p[0], p[1], p[2]].map(f64::from)));
        let triangles = mesh.indices.chunks_exact(3);
        surface.triangles.extend(triangles.map(|t| [t[0] + first, t[1] + first, t[2] + first]));
    }
    Ok(surface)
}

fn ply(bytes: &[u8]) -> Result<Mesh, String> {
    let ply = Parser::<DefaultElement>::new()
        .read_ply(&mut Cursor::new(bytes))
        .map_err(|e| format!("no PLY file: {e}"))?;
    let vertices = ply.payload.get("vertex").ok_or("has no element `vertex`")?;
    let number = |element: &DefaultElement, name: &str| match element.get(name) {
        Some(Property::Float(v)) => Ok(f64::from(*v)),
        Some(Property::Double(v)) => Ok(*v),
        _ => Err(format!("its vertices have no float `{name}`")),
    };
    let mut surface = Mesh::default();
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
