//! How one sample of a map travels: f32, f16, u16 or u8.
//!
//! `value = unit x scale` for the integer types, where `scale` is in Pa (or
//! J/m3) per unit and travels in the frame header. Floats carry the value
//! itself and their scale is 1.
//!
//! Greatest error of one encoding, for values in the type's range
//! ([`SampleType::value_max`]):
//!
//! | type | bytes | range | error |
//! |---|---|---|---|
//! | f32 | 4 | all | none |
//! | f16 | 2 | 0 ..= 65504 | value x 2^-11, or 2^-25 where that is more |
//! | u16 | 2 | 0 ..= 65535 x scale | scale / 2 |
//! | u8 | 1 | 0 ..= 255 x scale | scale / 2 |
//!
//! Values beyond the range are clamped to its ends, never wrapped; for the
//! integer types the arithmetic itself adds at most a few f32 rounding steps.

use half::f16;
use serde::{Deserialize, Serialize};

use crate::{ErrorCode, finite::first_not_finite};

/// The type of a sample on the wire. All are little-endian.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[repr(u8)]
pub enum SampleType {
    /// IEEE 754 binary32, the value itself.
    #[default]
    F32 = 0,
    /// IEEE 754 binary16, the value itself.
    F16 = 1,
    /// Unsigned 16-bit units of `scale`.
    U16 = 2,
    /// Unsigned 8-bit units of `scale`.
    U8 = 3,
}

/// Whether all values are finite, as an answer's have to be.
///
/// # Errors
/// The first that is not.
pub fn require_finite(values: &[f32]) -> Result<(), SampleError> {
    match first_not_finite(values) {
        Some(index) => Err(SampleError::NotFinite { index, value: values[index] }),
        None => Ok(()),
    }
}

/// What is wrong with an encoded map.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SampleError {
    /// The payload does not hold that many samples of that type.
    #[error("the payload has {bytes} bytes, {samples} samples of {sample_type:?} need {needed}")]
    WrongLength {
        /// Bytes found.
        bytes: usize,
        /// Bytes due.
        needed: usize,
        /// Samples due.
        samples: usize,
        /// Type of the samples.
        sample_type: SampleType,
    },
    /// An integer type without a usable scale.
    #[error("the scale is {scale}; u16 and u8 samples need a finite scale above zero")]
    BadScale {
        /// The scale found.
        scale: f32,
    },
    /// NaN or an infinity where an answer's samples are due: a fault of whoever made them.
    #[error("the value at place {index} is {value}; a finite one is due")]
    NotFinite {
        /// Its place, from 0.
        index: usize,
        /// The value.
        value: f32,
    },
}

impl SampleError {
    /// The wire code of this error.
    #[must_use]
    pub const fn code(&self) -> ErrorCode {
        match self {
            Self::WrongLength { .. } => ErrorCode::WrongLength,
            Self::BadScale { .. } => ErrorCode::BadScale,
            Self::NotFinite { .. } => ErrorCode::NotFinite,
        }
    }
}

impl SampleType {
    /// All types, in the order of their wire numbers.
    pub const ALL: [Self; 4] = [Self::F32, Self::F16, Self::U16, Self::U8];

    /// The type with this wire number.
    #[must_use]
    pub const fn from_wire(number: u8) -> Option<Self> {
        match number {
            0 => Some(Self::F32),
            1 => Some(Self::F16),
            2 => Some(Self::U16),
            3 => Some(Self::U8),
            _ => None,
        }
    }

    /// The wire number.
    #[must_use]
    pub const fn to_wire(self) -> u8 {
        self as u8
    }

    /// Bytes of one sample.
    #[must_use]
    pub const fn bytes(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F16 | Self::U16 => 2,
            Self::U8 => 1,
        }
    }

    /// Whether a scale goes with the samples.
    #[must_use]
    pub const fn is_scaled(self) -> bool {
        matches!(self, Self::U16 | Self::U8)
    }

    /// The greatest unit: 65535 or 255; 1 for floats.
    #[must_use]
    pub const fn unit_max(self) -> f32 {
        match self {
            Self::F32 | Self::F16 => 1.0,
            Self::U16 => 65_535.0,
            Self::U8 => 255.0,
        }
    }

    /// The greatest value that is encoded without clamping, in the unit of `scale`.
    #[must_use]
    pub fn value_max(self, scale: f32) -> f32 {
        match self {
            Self::F32 => f32::MAX,
            Self::F16 => f16::MAX.to_f32(),
            Self::U16 | Self::U8 => self.unit_max() * scale,
        }
    }

    /// Whether one of `values` is beyond what this type can hold, whatever its scale: it would be
    /// clamped, so that the answer has to be flagged.
    #[must_use]
    pub fn clips(self, values: &[f32]) -> bool {
        let most = self.value_max(1.0);
        self == Self::F16 && values.iter().any(|value| value.abs() > most)
    }

    /// The greatest error of encoding `value`, see the module's table.
    #[must_use]
    pub fn error_max(self, value: f32, scale: f32) -> f32 {
        match self {
            Self::F32 => 0.0,
            Self::F16 => (value.abs() / 2048.0).max(1.0 / 33_554_432.0),
            // Half a unit, and the rounding of two f32 operations on the value.
            Self::U16 | Self::U8 => 0.5 * scale + 2.0 * f32::EPSILON * value.abs(),
        }
    }

    fn checked_scale(self, scale: f32) -> Result<f32, SampleError> {
        if !self.is_scaled() {
            return Ok(1.0);
        }
        // The greatest value must stay finite too, or decoding would make infinities.
        if scale.is_finite() && scale > 0.0 && (self.unit_max() * scale).is_finite() {
            Ok(scale)
        } else {
            Err(SampleError::BadScale { scale })
        }
    }

    fn checked_len(self, bytes: usize, samples: usize) -> Result<(), SampleError> {
        let needed = samples.saturating_mul(self.bytes());
        if bytes == needed {
            Ok(())
        } else {
            Err(SampleError::WrongLength { bytes, needed, samples, sample_type: self })
        }
    }

    /// Checks that `bytes` hold that many `samples`, and that the scale is usable.
    ///
    /// # Errors
    /// As [`decode`](Self::decode).
    pub fn require(self, bytes: usize, samples: usize, scale: f32) -> Result<(), SampleError> {
        self.checked_scale(scale)?;
        self.checked_len(bytes, samples)
    }

    /// Decodes `payload` into `values`, in the unit of `scale`. Floats are
    /// taken as they are, NaN and infinities included: checking is
    /// [`check_pressure`](crate::check_pressure)'s. `scale` is ignored for floats.
    ///
    /// # Errors
    /// The payload's length does not fit `values`, or the scale is unusable;
    /// `values` is then unchanged.
    pub fn decode(self, payload: &[u8], scale: f32, values: &mut [f32]) -> Result<(), SampleError> {
        let scale = self.checked_scale(scale)?;
        self.checked_len(payload.len(), values.len())?;
        match self {
            Self::F32 => {
                for (value, b) in values.iter_mut().zip(payload.chunks_exact(4)) {
                    *value = f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
                }
            }
            Self::F16 => {
                for (value, b) in values.iter_mut().zip(payload.chunks_exact(2)) {
                    *value = f16::from_le_bytes([b[0], b[1]]).to_f32();
                }
            }
            Self::U16 => {
                for (value, b) in values.iter_mut().zip(payload.chunks_exact(2)) {
                    *value = f32::from(u16::from_le_bytes([b[0], b[1]])) * scale;
                }
            }
            Self::U8 => {
                for (value, &b) in values.iter_mut().zip(payload) {
                    *value = f32::from(b) * scale;
                }
            }
        }
        Ok(())
    }

    /// Encodes `values` into `payload`. Integer types round to the nearest
    /// unit and clamp; f16 rounds to nearest even and clamps to its greatest
    /// finite value; NaN becomes 0 in the integer types.
    ///
    /// # Errors
    /// As [`decode`](Self::decode); `payload` is then unchanged.
    pub fn encode(self, values: &[f32], scale: f32, payload: &mut [u8]) -> Result<(), SampleError> {
        let scale = self.checked_scale(scale)?;
        self.checked_len(payload.len(), values.len())?;
        // `as` saturates and sends NaN to 0; adding a half rounds, for values are not negative.
        match self {
            Self::F32 => {
                for (b, value) in payload.chunks_exact_mut(4).zip(values) {
                    b.copy_from_slice(&value.to_le_bytes());
                }
            }
            Self::F16 => {
                let max = f16::MAX.to_f32();
                for (b, &value) in payload.chunks_exact_mut(2).zip(values) {
                    let value = f16::from_f32(value.clamp(-max, max));
                    b.copy_from_slice(&value.to_le_bytes());
                }
            }
            Self::U16 => {
                for (b, &value) in payload.chunks_exact_mut(2).zip(values) {
                    b.copy_from_slice(&((value / scale + 0.5) as u16).to_le_bytes());
                }
            }
            Self::U8 => {
                for (b, &value) in payload.iter_mut().zip(values) {
                    *b = (value / scale + 0.5) as u8;
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
