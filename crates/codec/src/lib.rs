//! The forms that a map comes in and goes out in: bare samples, numpy arrays, PNG, JSON.
//!
//! A map is 224 x 224 `f32`, row-major, row 0 at the tip of the finger. Bytes from outside are
//! decoded within bounds: a file that claims more than a map is refused before it takes memory.
//!
//! ```
//! use bytes::BytesMut;
//! use papilla_codec::{Input, Map, Output, Quantity, decode, encode};
//!
//! let pressure_pa = vec![250.0; papilla_proto::MAP_LEN];
//! let map = Map { quantity: Quantity::Pressure, values: &pressure_pa, source: "example" };
//! let mut npy = BytesMut::new();
//! encode(Output::Npy, map, &mut npy)?;
//!
//! let mut back_pa = vec![0.0; papilla_proto::MAP_LEN];
//! decode(Input::Npy, &npy, &mut back_pa)?;
//! assert_eq!(back_pa, pressure_pa);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[cfg(any(test, fuzzing))]
#[doc(hidden)]
pub mod fuzz;
mod json;
mod npy;
mod png;

use bytes::{BufMut, BytesMut};
use papilla_proto::{
    ErrorCode, MAP_LEN, MAP_SIDE_PX, Problem, SampleError, SampleType, Window,
    sample::require_finite,
};

pub use npy::is_npy;
pub use png::{encode_mask, is_png};

/// How a pressure map is decoded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Input {
    /// Bare samples; `scale` in Pa per unit for u16 and u8.
    Samples {
        /// Type of each sample.
        sample_type: SampleType,
        /// Pa per unit.
        scale: f32,
    },
    /// Bare samples of a part of the map; the rest is zero.
    Window {
        /// Where they belong.
        window: Window,
        /// Type of each sample.
        sample_type: SampleType,
        /// Pa per unit.
        scale: f32,
    },
    /// A numpy array file.
    Npy,
    /// A gray PNG; full white is this many Pa.
    Png {
        /// Pressure of full white, Pa.
        pressure_max_pa: f32,
    },
    /// `{"pressure_pa": [...]}`.
    Json,
}

/// How a SED map is encoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Output {
    /// Bare samples.
    Samples(SampleType),
    /// A numpy array file, f32, 224 x 224.
    Npy,
    /// A 16-bit gray PNG.
    Png,
    /// `{"sed_j_per_m3": [...], ...}`.
    Json,
}

impl Output {
    /// Bytes the encoded map needs, or a good guess.
    pub fn size_hint(self) -> usize {
        match self {
            Self::Samples(sample_type) => MAP_LEN * sample_type.bytes(),
            Self::Npy => npy::HEADER_LEN + MAP_LEN * 4,
            Self::Png => MAP_LEN * 2,
            Self::Json => MAP_LEN * 12,
        }
    }

    /// The content type of the encoded map.
    pub fn content_type(self) -> &'static str {
        match self {
            Self::Samples(_) => "application/octet-stream",
            Self::Npy => "application/x-npy",
            Self::Png => "image/png",
            Self::Json => "application/json",
        }
    }
}

/// Decodes `bytes` into `pressure_pa` ([`MAP_LEN`] samples, Pa, unchecked).
///
/// # Errors
/// The bytes are not a map of that form.
pub fn decode(input: Input, bytes: &[u8], pressure_pa: &mut [f32]) -> Result<(), Problem> {
    match input {
        Input::Samples { sample_type, scale } => {
            sample_type.decode(bytes, scale, pressure_pa).map_err(refusal)
        }
        Input::Window { window, sample_type, scale } => {
            window.decode(sample_type, bytes, scale, pressure_pa).map_err(refusal)
        }
        Input::Npy => npy::decode(bytes, pressure_pa),
        Input::Png { pressure_max_pa } => png::decode(bytes, pressure_max_pa, pressure_pa),
        Input::Json => json::decode(bytes, pressure_pa),
    }
}

/// The refusal of samples: what is wrong, and whether the payload or its scale is.
fn refusal(error: SampleError) -> Problem {
    let field = if error.code() == ErrorCode::BadScale { "scale" } else { "payload" };
    Problem::new(error.code(), error.to_string()).at(field)
}

/// Why a map could not be encoded: always a fault of the caller or of this crate, never of what a
/// client sent.
#[derive(Debug, thiserror::Error)]
pub enum EncodeError {
    /// Samples do not fit their type or their room.
    #[error(transparent)]
    Samples(#[from] SampleError),
    /// The image cannot be written.
    #[error(transparent)]
    Png(#[from] ::png::EncodingError),
    /// The JSON cannot be written.
    #[error(transparent)]
    Json(#[from] std::io::Error),
}

/// What a map shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// Pressure on the skin, Pa.
    Pressure,
    /// Strain energy density at the interface, J/m3.
    Sed,
}

/// A map to encode.
#[derive(Debug, Clone, Copy)]
pub struct Map<'a> {
    /// What it shows.
    pub quantity: Quantity,
    /// [`MAP_LEN`] samples, finite, not negative.
    pub values: &'a [f32],
    /// What made it; goes into JSON.
    pub source: &'a str,
}

/// Greatest value of a map that counts as zero: a 65535th part of more is still a normal number.
const NOTHING: f32 = 1e-30;

/// The scale of a map whose greatest value is `value_max`: the value of one unit (u16,
/// u8), of full white (PNG), else 1, as for a map of zeros.
pub fn scale_of(output: Output, value_max: f32) -> f32 {
    match output {
        _ if value_max <= NOTHING => 1.0,
        Output::Samples(t) if t.is_scaled() => value_max / t.unit_max(),
        Output::Png => value_max,
        Output::Samples(_) | Output::Npy | Output::Json => 1.0,
    }
}

/// Appends `map` in the form `output` to `bytes`; returns its scale: that of its own greatest
/// value ([`scale_of`]), so that light touch is as precise as heavy touch.
///
/// # Errors
/// A value that is not finite.
pub fn encode(output: Output, map: Map<'_>, bytes: &mut BytesMut) -> Result<f32, EncodeError> {
    let values = map.values;
    require_finite(values)?;
    let scale = match output {
        Output::Samples(SampleType::F32 | SampleType::F16) | Output::Npy | Output::Json => 1.0,
        Output::Samples(_) | Output::Png => {
            scale_of(output, values.iter().fold(0.0, |top, &v| if v > top { v } else { top }))
        }
    };
    match output {
        Output::Samples(sample_type) => append(sample_type, values, scale, bytes)?,
        Output::Npy => npy::encode(values, bytes),
        Output::Png => png::encode(values, scale, bytes.writer())?,
        Output::Json => json::encode(map, bytes.writer())?,
    }
    Ok(scale)
}

/// Appends samples to `bytes`; values as they are, where they can be, are copied once.
///
/// # Errors
/// A scale that is none.
pub fn append(
    sample_type: SampleType,
    values: &[f32],
    scale: f32,
    bytes: &mut BytesMut,
) -> Result<(), SampleError> {
    if sample_type == SampleType::F32 && cfg!(target_endian = "little") {
        bytes.extend_from_slice(bytemuck::cast_slice(values));
        return Ok(());
    }
    let at = bytes.len();
    bytes.resize(at + values.len() * sample_type.bytes(), 0);
    sample_type.encode(values, scale, &mut bytes[at..])
}

/// The refusal of a map that is not 224 x 224.
fn wrong_shape(rows: usize, columns: usize) -> Problem {
    let message = format!(
        "the map has {rows} rows and {columns} columns; {MAP_SIDE_PX} x {MAP_SIDE_PX} are needed"
    );
    Problem::new(ErrorCode::WrongShape, message)
}

#[cfg(test)]
mod tests;
