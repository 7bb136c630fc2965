//! The file of a contact model, which `fe-datagen contact` writes.
//!
//! One text line, a header in JSON on a second line, and little-endian arrays in the order of
//! [`Arrays`]: f32, indices u32, and the compliance f16 in the header's unit, which rounds it to one
//! part in 2048 and halves the file.

use crate::error::ModelError;
use crate::model::{Arrays, ContactModel, Header, lengths};
use half::f16;

/// First line of a file.
const MAGIC: &[u8] = b"papilla contact model\n";
/// Largest value of the compliance in its unit.
const UNITS_MAX: f32 = 32_768.0;

/// Bytes that are read from the front.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize, T>(
        &mut self,
        (array, expected): (&'static str, usize),
        value: impl Fn([u8; N]) -> T,
    ) -> Result<Vec<T>, ModelError> {
        let (all, _) = self.0.as_chunks::<N>();
        let found = all.len().min(expected);
        if found < expected {
            return Err(ModelError::Length { array, found, expected });
        }
        self.0 = &self.0[N * expected..];
        Ok(all[..expected].iter().map(|bytes| value(*bytes)).collect())
    }
}

impl ContactModel {
    /// Reads a file's bytes.
    ///
    /// # Errors
    /// [`ModelError`] for what is no model, or one that is damaged.
    pub fn read(bytes: &[u8]) -> Result<Self, ModelError> {
        let (header, arrays) = Arrays::read(bytes)?;
        Self::new(header, arrays)
    }
}

impl Arrays {
    /// Reads a file's bytes.
    ///
    /// # Errors
    /// [`ModelError`] for what is no model, or one that is cut off.
    pub fn read(bytes: &[u8]) -> Result<(Header, Self), ModelError> {
        let rest = bytes.strip_prefix(MAGIC).ok_or(ModelError::Format("its first line differs"))?;
        let end = rest.iter().position(|b| *b == b'\n');
        let end = end.ok_or(ModelError::Format("its header does not end"))?;
        let header: Header = serde_json::from_slice(&rest[..end])?;
        header.require_format()?;
        let mut reader = Reader(&rest[end + 1..]);
        let [positions, normals, areas, compliance, projection, products, displacements] =
            lengths(&header)?;
        let unit = header.compliance_unit_mm_per_n;
        let float = f32::from_le_bytes;
        let arrays = Self {
            positions_mm: reader.take(positions, float)?,
            normals: reader.take(normals, float)?,
            areas_mm2: reader.take(areas, float)?,
            triangles: reader.take(("triangles", 3 * header.triangles), u32::from_le_bytes)?,
            compliance_mm_per_n: reader
                .take(compliance, |bytes| unit * f16::from_le_bytes(bytes).to_f32())?,
            projection: reader.take(projection, float)?,
            products: reader.take(products, float)?,
            displacements: reader.take(displacements, float)?,
        };
        if reader.0.is_empty() {
            return Ok((header, arrays));
        }
        Err(ModelError::Format("it goes on after its last array"))
    }

    /// Bytes of a file.
    ///
    /// # Errors
    /// [`ModelError::Header`] if the header cannot be written.
    pub fn to_bytes(&self, header: &Header) -> Result<Vec<u8>, ModelError> {
        let most = self.compliance_mm_per_n.iter().fold(0.0f32, |most, c| most.max(c.abs()));
        let unit = if most > 0.0 { most / UNITS_MAX } else { 1.0 };
        let mut bytes = MAGIC.to_vec();
        let header = Header { compliance_unit_mm_per_n: unit, ..header.clone() };
        serde_json::to_writer(&mut bytes, &header)?;
        bytes.push(b'\n');
        for (array, values) in self.floats() {
            if array == "compliance_mm_per_n" {
                let units = values.iter().flat_map(|v| f16::from_f32(v / unit).to_le_bytes());
                bytes.extend(units);
                continue;
            }
            bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
            if array == "areas_mm2" {
                bytes.extend(self.triangles.iter().flat_map(|i| i.to_le_bytes()));
            }
        }
        Ok(bytes)
    }
}
