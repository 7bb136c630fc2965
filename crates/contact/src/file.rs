//! The file of a contact model, which `fe-datagen contact` writes.
//!
//! It has one line of text, a header in JSON on a second line, and a zlib stream of little-endian
//! arrays in the order of [`Arrays`]. Floats are f32 and indices u32. Before the compliance stand
//! the parents of its [`packed`] form, u32. The arrays of the second order are f16, in units of the
//! greatest value of the array divided by 32768; that value stands before the array as f32.

use crate::error::ModelError;
use crate::model::{Arrays, ContactModel, Header, lengths};
use crate::packed::{self, STEPS_MAX};
use flate2::Compression;
use flate2::bufread::ZlibDecoder;
use flate2::write::ZlibEncoder;
use half::f16;
use std::io::{self, BufReader, Read, Write};

/// First line of a file.
const MAGIC: &[u8] = b"papilla contact model\n";
/// Steps of the mean compliance of the skin's vertices under forces of their own: 8 um a newton. What
/// that changes: docs/concepts/contact.md.
const STEPS: f32 = 4096.0;
/// Largest value of an f16 in its unit.
const UNITS_MAX: f32 = 32_768.0;
/// Most bytes that a byte of a zlib stream becomes.
const INFLATION_MAX: usize = 1032;

/// Arrays that are read from the front.
struct Reader<'a>(BufReader<ZlibDecoder<&'a [u8]>>);

impl Reader<'_> {
    fn take<const N: usize, T>(
        &mut self,
        (array, expected): (&'static str, usize),
        value: impl Fn([u8; N]) -> T,
    ) -> Result<Vec<T>, ModelError> {
        let read = |_| {
            let mut bytes = [0; N];
            self.0.read_exact(&mut bytes).map(|()| value(bytes))
        };
        let values: io::Result<Vec<T>> = (0..expected).map(read).collect();
        values.map_err(|source| ModelError::Damaged { array, source })
    }

    /// An array of f16, behind its unit.
    fn take_rounded(&mut self, expected: (&'static str, usize)) -> Result<Vec<f32>, ModelError> {
        let unit = self.take((expected.0, 1), f32::from_le_bytes)?[0];
        self.take(expected, |bytes| unit * f16::from_le_bytes(bytes).to_f32())
    }

    fn take_compliance(
        &mut self,
        array: &'static str,
        header: &Header,
    ) -> Result<Vec<f32>, ModelError> {
        let parents = self.take(("parents", header.vertices), u32::from_le_bytes)?;
        if let Some(index) = (0..parents.len()).find(|v| parents[*v] as usize > *v) {
            let (array, value) = ("parents", f64::from(parents[index]));
            return Err(ModelError::Value { array, index, value, rule: "not a vertex before it" });
        }
        let mut values = packed::read(&parents, &mut self.0)
            .map_err(|source| ModelError::Damaged { array, source })?;
        values.iter_mut().for_each(|step| *step *= header.compliance_step_mm_per_n);
        Ok(values)
    }

    /// Refuses what goes on, and a stream whose checksum is wrong.
    fn end(mut self) -> Result<(), ModelError> {
        let more = self.0.read(&mut [0]);
        let more = more.map_err(|source| ModelError::Damaged { array: "displacements", source })?;
        if more == 0 && self.0.get_ref().get_ref().is_empty() {
            return Ok(());
        }
        Err(ModelError::Format("it goes on after its last array"))
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
        let header = Header::of_json(&rest[..end])?;
        let stream = &rest[end + 1..];
        let [positions, normals, areas, compliance, projection, products, displacements] =
            lengths(&header)?;
        // A few bytes must not ask for all memory: each entry has a byte at least.
        if compliance.1 > INFLATION_MAX * stream.len() {
            return Err(ModelError::Format("it is too short for what its header names"));
        }
        let mut reader = Reader(BufReader::with_capacity(1 << 16, ZlibDecoder::new(stream)));
        let float = f32::from_le_bytes;
        let arrays = Self {
            positions_mm: reader.take(positions, float)?,
            normals: reader.take(normals, float)?,
            areas_mm2: reader.take(areas, float)?,
            triangles: reader.take(("triangles", 3 * header.triangles), u32::from_le_bytes)?,
            compliance_mm_per_n: reader.take_compliance(compliance.0, &header)?,
            projection: reader.take_rounded(projection)?,
            products: reader.take_rounded(products)?,
            displacements: reader.take_rounded(displacements)?,
        };
        reader.end()?;
        Ok((header, arrays))
    }

    /// Bytes of a file, its compliance rounded to the header's step, or to one of this program's
    /// choice if that is 0.
    ///
    /// # Errors
    /// [`ModelError::Header`] if the header cannot be written, [`ModelError::Length`] for arrays
    /// that are not as long as it says.
    pub fn to_bytes(&self, header: &Header) -> Result<Vec<u8>, ModelError> {
        self.require_lengths(header)?;
        let step = self.step_mm_per_n(header.compliance_step_mm_per_n);
        let mut bytes = MAGIC.to_vec();
        let header = Header { compliance_step_mm_per_n: step, ..header.clone() };
        serde_json::to_writer(&mut bytes, &header)?;
        bytes.push(b'\n');
        let mut stream = ZlibEncoder::new(bytes, Compression::best());
        let written = stream.write_all(&self.contents(step)).and_then(|()| stream.finish());
        written.map_err(|source| ModelError::Damaged { array: "displacements", source })
    }

    /// Everything behind the header, before it is deflated.
    fn contents(&self, step_mm_per_n: f32) -> Vec<u8> {
        let mut bytes = Vec::new();
        for values in [&self.positions_mm, &self.normals, &self.areas_mm2] {
            bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        }
        let parents = packed::parents(&self.positions_mm);
        bytes.extend(self.triangles.iter().chain(&parents).flat_map(|i| i.to_le_bytes()));
        let steps: Vec<f32> =
            self.compliance_mm_per_n.iter().map(|c| (c / step_mm_per_n).round()).collect();
        packed::write(&steps, &parents, &mut bytes);
        for values in [&self.projection, &self.products, &self.displacements] {
            let unit = largest(values) / UNITS_MAX;
            let unit = if unit > 0.0 { unit } else { 1.0 };
            bytes.extend(unit.to_le_bytes());
            bytes.extend(values.iter().flat_map(|v| f16::from_f32(v / unit).to_le_bytes()));
        }
        bytes
    }

    /// The step that is wanted, if any and if it is not too fine.
    fn step_mm_per_n(&self, wanted: f32) -> f32 {
        let compliance = &self.compliance_mm_per_n;
        let size = 3 * self.areas_mm2.len();
        let mut at = 0;
        let own = (0..size).map(|i| {
            let value = compliance[at];
            at += size - i;
            value
        });
        let mean = own.sum::<f32>() / size as f32;
        let step = if wanted > 0.0 { wanted } else { mean / STEPS };
        let step = step.max(largest(compliance) / STEPS_MAX);
        if step > 0.0 { step } else { 1.0 }
    }
}

fn largest(values: &[f32]) -> f32 {
    values.iter().fold(0.0, |most, v| most.max(v.abs()))
}
