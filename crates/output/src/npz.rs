//! NumPy `.npz` archives whose bytes depend on nothing but the arrays.

use super::{OutputError, atomic};
use ndarray::{Array, ArrayBase, ArrayView, Data, Dimension};
use ndarray_npy::{NpzReader, NpzWriter, ReadableElement, WritableElement};
use std::io::Cursor;
use std::path::Path;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime};

/// Builds an archive in memory: deflated, with the zip epoch (1980-01-01) as
/// the time of every member, so that equal arrays give equal bytes.
pub struct NpzBuilder {
    writer: NpzWriter<Cursor<Vec<u8>>>,
}

impl Default for NpzBuilder {
    fn default() -> Self {
        Self::new()
    }
}

impl NpzBuilder {
    /// An empty archive.
    pub fn new() -> Self {
        // Permissions and time are stated: their defaults follow the clock or
        // the platform, depending on how the zip crate was built.
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .compression_level(Some(6))
            .last_modified_time(DateTime::default())
            .unix_permissions(0o644);
        Self { writer: NpzWriter::new_with_options(Cursor::new(Vec::new()), options) }
    }

    /// Appends an array under `name` (as `name.npy`, like `numpy.savez`).
    ///
    /// # Errors
    /// [`OutputError::Encode`] when the name is taken already.
    pub fn add<S, D>(&mut self, name: &str, array: &ArrayBase<S, D>) -> Result<(), OutputError>
    where
        S: Data,
        S::Elem: WritableElement,
        D: Dimension,
    {
        self.writer
            .add_array(name, array)
            .map_err(|e| OutputError::Encode { what: "npz", message: format!("{name}: {e}") })
    }

    /// Appends values in row-major order under `name` with the given shape.
    ///
    /// # Errors
    /// [`OutputError::Length`] when the shape does not fit the values.
    pub fn add_slice<T: WritableElement>(
        &mut self,
        name: &str,
        shape: &[usize],
        values: &[T],
    ) -> Result<(), OutputError> {
        let view = ArrayView::from_shape(shape, values).map_err(|_| OutputError::Length {
            what: name.to_string(),
            found: values.len(),
            expected: shape.iter().product(),
        })?;
        self.add(name, &view)
    }

    /// The finished archive.
    ///
    /// # Errors
    /// [`OutputError::Encode`] when the archive grows past the format's limits.
    pub fn finish(self) -> Result<Vec<u8>, OutputError> {
        self.writer
            .finish()
            .map(Cursor::into_inner)
            .map_err(|e| OutputError::Encode { what: "npz", message: e.to_string() })
    }

    /// Finishes the archive and writes it atomically; returns its bytes.
    ///
    /// # Errors
    /// As [`Self::finish`] and [`atomic::write`].
    pub fn write(self, path: &Path) -> Result<Vec<u8>, OutputError> {
        let bytes = self.finish()?;
        atomic::write(path, &bytes)?;
        Ok(bytes)
    }
}

/// Reads arrays by name from the bytes of an archive.
pub struct NpzArrays<'a> {
    path: &'a Path,
    reader: NpzReader<Cursor<&'a [u8]>>,
}

impl<'a> NpzArrays<'a> {
    /// Opens an archive; `path` is only for messages.
    ///
    /// # Errors
    /// [`OutputError::Malformed`] when the bytes are no zip archive.
    pub fn new(path: &'a Path, bytes: &'a [u8]) -> Result<Self, OutputError> {
        let reader =
            NpzReader::new(Cursor::new(bytes)).map_err(|e| OutputError::malformed(path, &e))?;
        Ok(Self { path, reader })
    }

    /// Whether there is an array of that name.
    ///
    /// # Errors
    /// [`OutputError::Malformed`] when the archive cannot be read.
    pub fn has(&mut self, name: &str) -> Result<bool, OutputError> {
        let names = self.reader.names().map_err(|e| OutputError::malformed(self.path, &e))?;
        Ok(names.iter().any(|n| n == name))
    }

    /// Reads one array.
    ///
    /// # Errors
    /// [`OutputError::Malformed`] when it is absent, of another type or another
    /// number of dimensions.
    pub fn get<T: ReadableElement, D: Dimension>(
        &mut self,
        name: &str,
    ) -> Result<Array<T, D>, OutputError> {
        self.reader
            .by_name(name)
            .map_err(|e| OutputError::malformed(self.path, &format!("array {name}: {e}")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{Ix1, Ix2};

    fn archive() -> Vec<u8> {
        let mut npz = NpzBuilder::new();
        npz.add_slice("a", &[2, 3], &[1f32, 2., 3., 4., 5., 6.]).unwrap();
        npz.add_slice("b", &[2], &[7u32, 8]).unwrap();
        npz.finish().unwrap()
    }

    #[test]
    fn arrays_come_back_with_type_and_shape() {
        let bytes = archive();
        let mut npz = NpzArrays::new(Path::new("x.npz"), &bytes).unwrap();
        let a = npz.get::<f32, Ix2>("a").unwrap();
        assert_eq!((a.dim(), a[[1, 2]].to_bits()), ((2, 3), 6f32.to_bits()));
        assert_eq!(npz.get::<u32, Ix1>("b").unwrap().to_vec(), [7, 8]);
        assert!(npz.get::<f64, Ix1>("b").is_err(), "a wrong type is an error");
        assert!(npz.get::<u32, Ix1>("c").unwrap_err().to_string().contains("array c"));
    }

    #[test]
    fn the_clock_is_not_in_the_bytes() {
        let first = archive();
        // Zip times have a resolution of 2 s.
        std::thread::sleep(std::time::Duration::from_millis(2100));
        assert_eq!(first, archive());
    }

    #[test]
    fn a_shape_that_does_not_fit_is_refused() {
        let error = NpzBuilder::new().add_slice("a", &[2, 2], &[1f32; 3]).unwrap_err();
        assert!(matches!(error, OutputError::Length { found: 3, expected: 4, .. }), "{error}");
    }
}
