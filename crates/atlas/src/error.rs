//! What can be wrong with an atlas, or with a buffer handed to it.

use super::Patch;
use papilla_json::JsonError;
use thiserror::Error;

/// Why an atlas, or the use of one, is refused.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum AtlasError {
    /// The text is not JSON, or not JSON of this shape.
    #[error("the atlas cannot be read: {0}")]
    Json(JsonError),
    /// A version of the format that this code does not know.
    #[error("atlas format version {found} is not supported (this build reads {expected})")]
    Version {
        /// Version in the file.
        found: u32,
        /// Version this code reads.
        expected: u32,
    },
    /// Image side other than 224.
    #[error("the atlas is laid out in {found} px, but maps are {expected} px a side")]
    Size {
        /// Side in the file, pixels.
        found: u32,
        /// Side of the maps, pixels.
        expected: u32,
    },
    /// A scale that is not a positive number.
    #[error("mm_per_px is {0}, but must be a positive finite length")]
    Scale(f32),
    /// No triangles.
    #[error("the atlas has no triangles")]
    Empty,
    /// Lists of different lengths, or too long for 32-bit indices.
    #[error("{patch} {list} holds {found} entries where {expected} are due")]
    Count {
        /// Patch concerned.
        patch: Patch,
        /// Name of the list.
        list: &'static str,
        /// Length found.
        found: usize,
        /// Length of the skin's positions.
        expected: usize,
    },
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} names vertex {vertex}, but there are {count} vertices")]
    Index {
        /// Index of the triangle.
        triangle: usize,
        /// Vertex it names.
        vertex: u32,
        /// Vertices of the atlas.
        count: usize,
    },
    /// NaN or infinity.
    #[error("{patch} {list} of vertex {vertex} is not finite")]
    NotFinite {
        /// Patch concerned.
        patch: Patch,
        /// Name of the list.
        list: &'static str,
        /// Vertex concerned.
        vertex: usize,
    },
    /// A vertex outside the image.
    #[error("vertex {vertex} of the {patch} lies at ({u}, {v}) px, outside the image of {size} px")]
    Outside {
        /// Patch concerned.
        patch: Patch,
        /// Vertex concerned.
        vertex: usize,
        /// Its column coordinate, pixels.
        u: f32,
        /// Its row coordinate, pixels.
        v: f32,
        /// Side of the image, pixels.
        size: usize,
    },
    /// A triangle that is mirrored, or has no area, in the image.
    #[error("triangle {triangle} of the {patch} is {} in the image; every triangle must be wound counter-clockwise", if *.empty { "without area" } else { "flipped" })]
    Flipped {
        /// Patch concerned.
        patch: Patch,
        /// Index of the triangle.
        triangle: usize,
        /// True if its area is zero, false if it is mirrored.
        empty: bool,
    },
    /// Two triangles cover the same pixel centre: the layout folds over itself.
    #[error("triangles {first} and {second} of the {patch} both cover row {row}, column {column}")]
    Overlap {
        /// Patch concerned.
        patch: Patch,
        /// Row of the pixel.
        row: usize,
        /// Column of the pixel.
        column: usize,
        /// Lower triangle index.
        first: u32,
        /// Higher triangle index.
        second: u32,
    },
    /// The contents do not belong to the hash.
    #[error("the atlas was altered: it names hash {found}, its contents have {expected}")]
    Hash {
        /// Hash of the contents.
        expected: String,
        /// Hash written in the file.
        found: String,
    },
    /// Data of another atlas.
    #[error("this is data for atlas {found}, but atlas {expected} is in use; the two do not mix")]
    Mismatch {
        /// Hash of the atlas in use.
        expected: String,
        /// Hash that the data names.
        found: String,
    },
    /// A buffer of the wrong length was handed to the rasteriser.
    #[error("{what} holds {found} values where {expected} are due")]
    BufferLength {
        /// Which buffer.
        what: &'static str,
        /// Length found.
        found: usize,
        /// Length needed.
        expected: usize,
    },
}
