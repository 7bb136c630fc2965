//! The forms a map comes in and goes out in.

mod json;
mod npy;
mod png;

use std::fmt::Display;

use bytes::{BufMut, BytesMut};
use papilla_proto::{ErrorCode, MAP_LEN, MAP_SIDE_PX, Problem, SampleError, SampleType, Window};

pub(crate) use npy::is_npy;
pub(crate) use png::{encode_mask, is_png};

use crate::problem;

/// How a pressure map is decoded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Input {
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
pub(crate) enum Output {
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
    pub(crate) fn size_hint(self) -> usize {
        match self {
            Self::Samples(sample_type) => MAP_LEN * sample_type.bytes(),
            Self::Npy => npy::HEADER_LEN + MAP_LEN * 4,
            Self::Png => MAP_LEN * 2,
            Self::Json => MAP_LEN * 12,
        }
    }

    /// The content type of the encoded map.
    pub(crate) fn content_type(self) -> &'static str {
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
pub(crate) fn decode(input: Input, bytes: &[u8], pressure_pa: &mut [f32]) -> Result<(), Problem> {
    match input {
        Input::Samples { sample_type, scale } => {
            sample_type.decode(bytes, scale, pressure_pa).map_err(problem::of_samples)
        }
        Input::Window { window, sample_type, scale } => {
            window.decode(sample_type, bytes, scale, pressure_pa).map_err(problem::of_samples)
        }
        Input::Npy => npy::decode(bytes, pressure_pa),
        Input::Png { pressure_max_pa } => png::decode(bytes, pressure_max_pa, pressure_pa),
        Input::Json => json::decode(bytes, pressure_pa),
    }
}

/// What a map shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Quantity {
    /// Pressure on the skin, Pa.
    Pressure,
    /// Strain energy density at the interface, J/m3.
    Sed,
}

/// A map to encode.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Map<'a> {
    pub(crate) quantity: Quantity,
    /// [`MAP_LEN`] samples, finite, not negative.
    pub(crate) values: &'a [f32],
    /// The value that scaled forms map to their greatest unit. A map that goes beyond
    /// is scaled by its own maximum: it does not clip.
    pub(crate) value_max: f32,
    /// What made it; goes into JSON.
    pub(crate) source: &'a str,
}

/// The scale of a map whose greatest value is `value_max`: the value of one unit (u16,
/// u8), of full white (PNG), else 1.
pub(crate) fn scale_of(output: Output, value_max: f32) -> f32 {
    match output {
        Output::Samples(t) if t.is_scaled() => value_max / t.unit_max(),
        Output::Png => value_max,
        Output::Samples(_) | Output::Npy | Output::Json => 1.0,
    }
}

/// Appends `map` in the form `output` to `bytes`; returns its scale, see [`scale_of`].
///
/// # Errors
/// Only faults of our own.
pub(crate) fn encode(output: Output, map: Map<'_>, bytes: &mut BytesMut) -> Result<f32, Problem> {
    let failed = |error: &dyn Display| problem::internal("the map cannot be encoded", error);
    let values = map.values;
    let scale = match output {
        Output::Samples(SampleType::F32 | SampleType::F16) | Output::Npy | Output::Json => 1.0,
        Output::Samples(_) | Output::Png => {
            let top = values.iter().fold(map.value_max, |top, &v| if v > top { v } else { top });
            scale_of(output, top)
        }
    };
    match output {
        Output::Samples(sample_type) => {
            append(sample_type, values, scale, bytes).map_err(|e| failed(&e))?;
        }
        Output::Npy => npy::encode(values, bytes),
        Output::Png => png::encode(values, scale, bytes.writer()).map_err(|e| failed(&e))?,
        Output::Json => json::encode(map, bytes.writer()).map_err(|e| failed(&e))?,
    }
    Ok(scale)
}

/// Appends samples to `bytes`; values as they are, where they can be, are copied once.
///
/// # Errors
/// Only faults of our own.
pub(crate) fn append(
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
