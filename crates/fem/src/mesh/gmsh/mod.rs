//! Meshes from Gmsh `.msh` files, ASCII format 4.1.
//!
//! Volumes belong to physical groups whose names the caller knows as regions. Physical surfaces
//! become surfaces and node sets of their name, physical curves and points node sets: lengths are
//! taken as mm.
//!
//! Hexahedra with 8, 20 or 27 nodes and tetrahedra with 4 or 10. The faces of
//! 20-node hexahedra carry no contact until [`super::complete`] has been there.
//!
//! A file without volumes is a plane-strain mesh in the plane z = 0: surfaces
//! of quadrangles with 4, 8 or 9 nodes name regions, curves become surfaces and
//! node sets, points node sets. Quadrangles may be numbered either way round.

mod build;
mod error;
mod order;
mod parse;

pub use error::GmshError;

use super::Mesh;
use std::{io, path::Path};

/// Reads a mesh from the text of a `.msh` file; `regions` are the names of the groups of volumes
/// by [`Region::index`](super::Region::index).
///
/// Nodes that no solid element uses are left out; the others keep the order in
/// which elements first use them. Faces look outward (between two regions: away
/// from the one of the higher number).
///
/// # Errors
/// [`GmshError`] names the line and what to do about it.
pub fn read(text: &str, regions: &[&str]) -> Result<Mesh, GmshError> {
    build::build(&parse::parse(text)?, regions)
}

/// Reads a mesh from a `.msh` file.
///
/// # Errors
/// As [`read`], and if the file cannot be read.
pub fn read_file(path: &Path, regions: &[&str]) -> Result<Mesh, GmshError> {
    let failed = |source| GmshError::Io { path: path.into(), source };
    let bytes = std::fs::read(path).map_err(failed)?;
    let bytes = papilla_json::plain(&bytes)
        .map_err(|error| failed(io::Error::new(io::ErrorKind::InvalidData, error)))?;
    // A binary file is not UTF-8, but its first lines are, and they say so.
    read(&String::from_utf8_lossy(bytes), regions)
}
