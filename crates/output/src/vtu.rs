//! VTK XML unstructured grids (`.vtu`) and time series of them (`.pvd`).
//!
//! Data go in one appended raw block, little-endian, uncompressed: the most
//! compact form that every VTK reader takes without a decompressor. Format:
//! <https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>.

use super::{OutputError, atomic};
use std::fmt::Write as _;
use std::path::Path;

/// VTK's number of each cell type that a mesh here may hold.
///
/// Node orders are VTK's: for hex8 the face zeta = -1 counter-clockwise, then
/// zeta = +1; for hex27 ([`TRIQUADRATIC_HEXAHEDRON`](cell::TRIQUADRATIC_HEXAHEDRON))
/// the 8 corners, the edges of the lower face, of the upper face and the
/// upright ones, then the faces -x, +x, -y, +y, -z, +z and the centre.
pub mod cell {
    /// 2-node line.
    pub const LINE: u8 = 3;
    /// 3-node triangle.
    pub const TRIANGLE: u8 = 5;
    /// 4-node quadrilateral.
    pub const QUAD: u8 = 9;
    /// 4-node tetrahedron.
    pub const TETRA: u8 = 10;
    /// 8-node hexahedron.
    pub const HEXAHEDRON: u8 = 12;
    /// 6-node triangle.
    pub const QUADRATIC_TRIANGLE: u8 = 22;
    /// 8-node quadrilateral.
    pub const QUADRATIC_QUAD: u8 = 23;
    /// 10-node tetrahedron.
    pub const QUADRATIC_TETRA: u8 = 24;
    /// 20-node hexahedron.
    pub const QUADRATIC_HEXAHEDRON: u8 = 25;
    /// 9-node quadrilateral.
    pub const BIQUADRATIC_QUAD: u8 = 28;
    /// 27-node hexahedron.
    pub const TRIQUADRATIC_HEXAHEDRON: u8 = 29;
}

/// The cells of a mesh of any mixture of types.
#[derive(Clone, Copy, Debug)]
pub struct VtuMesh<'a> {
    /// Node positions, mm; 2-D meshes have z = 0.
    pub points: &'a [[f64; 3]],
    /// Node numbers of all cells, one cell after the other, in VTK's order.
    pub connectivity: &'a [usize],
    /// For each cell where its nodes end in `connectivity`.
    pub offsets: &'a [usize],
    /// For each cell its type, see [`cell`].
    pub types: &'a [u8],
}

/// A named field on the points or the cells.
#[derive(Clone, Copy, Debug)]
pub struct Field<'a> {
    /// Name shown in ParaView, with the unit last (`pressure_pa`).
    pub name: &'a str,
    /// Values per point or cell: 1 scalar, 3 vector, 9 tensor.
    pub components: usize,
    /// The values, all components of the first point first.
    pub values: Values<'a>,
}

/// Values of a field and the type they are stored in.
#[derive(Clone, Copy, Debug)]
pub enum Values<'a> {
    /// Stored in 64 bits.
    F64(&'a [f64]),
    /// Stored rounded to 32 bits: half the size, enough for the eye.
    F64As32(&'a [f64]),
    /// Stored in 32 bits.
    F32(&'a [f32]),
    /// Whole numbers, such as a layer's id.
    I32(&'a [i32]),
}

impl Values<'_> {
    fn len(&self) -> usize {
        match self {
            Self::F64(v) | Self::F64As32(v) => v.len(),
            Self::F32(v) => v.len(),
            Self::I32(v) => v.len(),
        }
    }

    fn type_name(&self) -> &'static str {
        match self {
            Self::F64(_) => "Float64",
            Self::F64As32(_) | Self::F32(_) => "Float32",
            Self::I32(_) => "Int32",
        }
    }

    fn bytes(&self) -> Vec<u8> {
        match self {
            Self::F64(v) => v.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Self::F64As32(v) => v.iter().flat_map(|x| (*x as f32).to_le_bytes()).collect(),
            Self::F32(v) => v.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Self::I32(v) => v.iter().flat_map(|x| x.to_le_bytes()).collect(),
        }
    }
}

impl<'a> From<(&'a str, usize, &'a [f64])> for Field<'a> {
    fn from((name, components, values): (&'a str, usize, &'a [f64])) -> Self {
        Self { name, components, values: Values::F64(values) }
    }
}

/// Collects the XML head and the binary block it points into.
#[derive(Default)]
struct Document {
    xml: String,
    block: Vec<u8>,
}

impl Document {
    fn array(&mut self, name: &str, kind: &str, components: usize, bytes: &[u8]) {
        // Writing to a String cannot fail.
        let _ = writeln!(
            self.xml,
            "        <DataArray type=\"{kind}\" Name=\"{}\" NumberOfComponents=\"{components}\" format=\"appended\" offset=\"{}\"/>",
            escape(name),
            self.block.len()
        );
        self.block.extend((bytes.len() as u64).to_le_bytes());
        self.block.extend(bytes);
    }

    fn section(
        &mut self,
        tag: &str,
        fields: &[Field<'_>],
        count: usize,
    ) -> Result<(), OutputError> {
        let _ = writeln!(self.xml, "      <{tag}>");
        for field in fields {
            let expected = count * field.components;
            if field.components == 0 || field.values.len() != expected {
                return Err(OutputError::Length {
                    what: format!("field {} ({} components)", field.name, field.components),
                    found: field.values.len(),
                    expected,
                });
            }
            let bytes = field.values.bytes();
            self.array(field.name, field.values.type_name(), field.components, &bytes);
        }
        let _ = writeln!(self.xml, "      </{tag}>");
        Ok(())
    }
}

/// The bytes of a `.vtu` file.
///
/// # Errors
/// [`OutputError::Length`] when a field, the offsets or the node numbers do
/// not fit the mesh.
pub fn encode(
    mesh: &VtuMesh<'_>,
    point_data: &[Field<'_>],
    cell_data: &[Field<'_>],
) -> Result<Vec<u8>, OutputError> {
    check(mesh)?;
    let mut doc = Document::default();
    doc.xml.push_str(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" \
         byte_order=\"LittleEndian\" header_type=\"UInt64\">\n  <UnstructuredGrid>\n",
    );
    let (points, cells) = (mesh.points.len(), mesh.types.len());
    let _ = writeln!(doc.xml, "    <Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">");
    doc.section("PointData", point_data, points)?;
    doc.section("CellData", cell_data, cells)?;
    doc.xml.push_str("      <Points>\n");
    let flat: Vec<u8> = mesh.points.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    doc.array("Points", "Float64", 3, &flat);
    doc.xml.push_str("      </Points>\n      <Cells>\n");
    doc.array("connectivity", "Int64", 1, &i64_bytes(mesh.connectivity));
    doc.array("offsets", "Int64", 1, &i64_bytes(mesh.offsets));
    doc.array("types", "UInt8", 1, mesh.types);
    doc.xml.push_str(
        "      </Cells>\n    </Piece>\n  </UnstructuredGrid>\n  <AppendedData encoding=\"raw\">\n_",
    );
    let mut bytes = doc.xml.into_bytes();
    bytes.extend(doc.block);
    bytes.extend(b"\n  </AppendedData>\n</VTKFile>\n");
    Ok(bytes)
}

/// Writes a `.vtu` file atomically.
///
/// # Errors
/// As [`encode`] and [`atomic::write`].
pub fn write(
    path: &Path,
    mesh: &VtuMesh<'_>,
    point_data: &[Field<'_>],
    cell_data: &[Field<'_>],
) -> Result<(), OutputError> {
    atomic::write(path, &encode(mesh, point_data, cell_data)?)
}

/// Writes a `.pvd` series: `steps` are (time or depth, file name relative to
/// the `.pvd`). ParaView shows the first number as its time.
///
/// # Errors
/// As [`atomic::write`].
pub fn write_pvd(path: &Path, steps: &[(f64, String)]) -> Result<(), OutputError> {
    let mut xml = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" \
         byte_order=\"LittleEndian\" header_type=\"UInt64\">\n  <Collection>\n",
    );
    for (time, file) in steps {
        let _ = writeln!(
            xml,
            "    <DataSet timestep=\"{time}\" group=\"\" part=\"0\" file=\"{}\"/>",
            escape(file)
        );
    }
    xml.push_str("  </Collection>\n</VTKFile>\n");
    atomic::write(path, xml.as_bytes())
}

fn i64_bytes(values: &[usize]) -> Vec<u8> {
    values.iter().flat_map(|v| (*v as i64).to_le_bytes()).collect()
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('"', "&quot;").replace('<', "&lt;").replace('>', "&gt;")
}

fn check(mesh: &VtuMesh<'_>) -> Result<(), OutputError> {
    let length = |what: &str, found, expected| {
        Err(OutputError::Length { what: what.to_string(), found, expected })
    };
    if mesh.offsets.len() != mesh.types.len() {
        return length("offsets", mesh.offsets.len(), mesh.types.len());
    }
    let end = mesh.offsets.last().copied().unwrap_or(0);
    if end != mesh.connectivity.len() || !mesh.offsets.is_sorted() {
        return length("connectivity", mesh.connectivity.len(), end);
    }
    match mesh.connectivity.iter().max() {
        Some(&node) if node >= mesh.points.len() => {
            length("points (by the largest node number)", mesh.points.len(), node + 1)
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const POINTS: [[f64; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.5]];

    fn mesh() -> VtuMesh<'static> {
        VtuMesh {
            points: &POINTS,
            connectivity: &[0, 1, 2, 3, 0, 1, 2],
            offsets: &[4, 7],
            types: &[cell::QUAD, cell::TRIANGLE],
        }
    }

    /// Reads one array back the way a VTK reader does: by its offset.
    fn array(bytes: &[u8], name: &str) -> Vec<u8> {
        let at = bytes.windows(7).position(|w| w == b"\"raw\">\n").unwrap() + 8;
        let head = std::str::from_utf8(&bytes[..at]).unwrap();
        let line = head.lines().find(|l| l.contains(&format!("Name=\"{name}\""))).unwrap();
        let offset: usize =
            line.split("offset=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap();
        let start = at + offset;
        let len = u64::from_le_bytes(bytes[start..start + 8].try_into().unwrap()) as usize;
        bytes[start + 8..start + 8 + len].to_vec()
    }

    #[test]
    fn arrays_are_found_at_their_offsets() {
        let depth = [0.5, 1.5, 2.5, -1.0];
        let bytes = encode(
            &mesh(),
            &[("depth_mm", 1, &depth[..]).into()],
            &[Field { name: "layer", components: 1, values: Values::I32(&[3, 1]) }],
        )
        .unwrap();
        let f64s = |b: &[u8]| -> Vec<f64> {
            b.chunks(8).map(|c| f64::from_le_bytes(c.try_into().unwrap())).collect()
        };
        assert_eq!(f64s(&array(&bytes, "depth_mm")), depth);
        assert_eq!(f64s(&array(&bytes, "Points")), POINTS.concat());
        assert_eq!(array(&bytes, "types"), [9, 5]);
        assert_eq!(array(&bytes, "layer"), [3, 0, 0, 0, 1, 0, 0, 0]);
        assert_eq!(array(&bytes, "offsets").len(), 16);
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        assert!(encode(&mesh(), &[("p", 1, &[1.0][..]).into()], &[]).is_err());
        let loose = VtuMesh { points: &POINTS[..3], ..mesh() };
        assert!(encode(&loose, &[], &[]).is_err(), "node 3 does not exist");
        let short = VtuMesh { offsets: &[4], ..mesh() };
        assert!(encode(&short, &[], &[]).is_err());
    }

    #[test]
    fn a_series_lists_its_steps_in_order() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("press.pvd");
        write_pvd(&path, &[(0.5, "a&b.vtu".into()), (1.0, "c.vtu".into())]).unwrap();
        let text = std::fs::read_to_string(path).unwrap();
        let (a, c) = (text.find("a&amp;b.vtu").unwrap(), text.find("timestep=\"1\"").unwrap());
        assert!(a < c);
    }
}
