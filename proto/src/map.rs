//! The map: 224 x 224 samples, row by row, with row 0 at the tip of the finger.

use crate::{ErrorCode, Problem, SampleType, effects::OutOfRange};

pub use papilla_atlas::{DOUBTED_BELOW_PA, MAP_LEN, MAP_SIDE_PX};

/// Room above the greatest trained pressure, as a factor.
///
/// A map at the very maximum that went through f16, u8 or a PNG may come back
/// a rounding step above it; such a map is not out of range.
pub const PRESSURE_HEADROOM: f32 = 1.01;

/// What is wrong with a pressure map. Rows and columns count from 0.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MapError {
    /// Another number of samples than [`MAP_LEN`].
    #[error("the map has {samples} samples, 224 x 224 = 50176 are needed")]
    WrongLength {
        /// Samples found.
        samples: usize,
    },
    /// NaN or an infinity.
    #[error("the sample at row {row}, column {column} is {value}; send finite pressures in Pa")]
    NotFinite {
        /// Row of the sample.
        row: usize,
        /// Column of the sample.
        column: usize,
        /// The sample, Pa.
        value: f32,
    },
    /// Below zero.
    #[error("the pressure at row {row}, column {column} is {value} Pa; it cannot be below zero")]
    Negative {
        /// Row of the sample.
        row: usize,
        /// Column of the sample.
        column: usize,
        /// The sample, Pa.
        value: f32,
    },
    /// Above what the model was trained on.
    #[error(
        "the pressure at row {row}, column {column} is {value} Pa; the model knows up to {pressure_max_pa} Pa"
    )]
    OutOfRange {
        /// Row of the sample.
        row: usize,
        /// Column of the sample.
        column: usize,
        /// The sample, Pa.
        value: f32,
        /// Greatest pressure the model was trained on, Pa.
        pressure_max_pa: f32,
    },
}

impl MapError {
    /// The wire code of this error.
    #[must_use]
    pub const fn code(&self) -> ErrorCode {
        match self {
            Self::WrongLength { .. } => ErrorCode::WrongLength,
            Self::NotFinite { .. } => ErrorCode::NotFinite,
            Self::Negative { .. } => ErrorCode::NegativePressure,
            Self::OutOfRange { .. } => ErrorCode::OutOfRange,
        }
    }
}

impl From<MapError> for Problem {
    fn from(error: MapError) -> Self {
        Self::new(error.code(), error.to_string()).at("pressure_pa")
    }
}

/// Room above the greatest trained pressure where a network may extrapolate, as a factor.
pub const FLAGGED_HEADROOM: f32 = 10.0;

/// Room above the greatest trained pressure where pressure is clamped, as a factor: far beyond any
/// finger, and sums over a map stay finite.
pub const CLAMPED_HEADROOM: f32 = 1e4;

/// What [`PressureRange::check`] learns on its way through the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapSummary {
    /// Greatest pressure in the map, Pa.
    pub peak_pa: f32,
}

/// The pressures that are taken, and those that a model was trained on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressureRange {
    /// Greatest pressure the model was trained on, Pa.
    pub trained_max_pa: f32,
    /// What becomes of pressures beyond.
    pub beyond: OutOfRange,
}

impl MapSummary {
    /// Whether nothing touches the finger: every sample is zero.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        self.peak_pa <= 0.0
    }

    /// Whether the greatest pressure is so small that its [unit is in doubt](DOUBTED_BELOW_PA).
    #[must_use]
    pub fn is_doubtful(&self) -> bool {
        !self.is_zero() && self.peak_pa < DOUBTED_BELOW_PA
    }

    /// Whether the greatest pressure is the greatest number of 16 bits (f16), to rounding. Encoders of
    /// clients write it in the place of any greater one, so the true pressure may be higher.
    #[must_use]
    pub fn is_full_scale(&self) -> bool {
        (self.peak_pa / SampleType::F16.value_max(1.0) - 1.0).abs() < 1e-6
    }
}

impl PressureRange {
    /// The range of what presses a finger of so many times the stiffness that the model knows: the
    /// model sees pressure over it.
    #[must_use]
    pub fn times(self, stiffness: f32) -> Self {
        Self { trained_max_pa: self.trained_max_pa * stiffness, ..self }
    }

    /// Greatest pressure that is taken, Pa.
    #[must_use]
    pub fn limit_pa(self) -> f32 {
        self.trained_max_pa
            * match self.beyond {
                OutOfRange::Refuse => PRESSURE_HEADROOM,
                OutOfRange::Flag => FLAGGED_HEADROOM,
                OutOfRange::Clamp => CLAMPED_HEADROOM,
            }
    }

    /// Whether a map with this peak is an extrapolation.
    #[must_use]
    pub fn is_left_by(self, summary: MapSummary) -> bool {
        summary.peak_pa > self.trained_max_pa * PRESSURE_HEADROOM
    }

    /// What the network is to see of a map that [leaves the range](Self::is_left_by), written to
    /// `seen_pa`; false where it is to see the map itself.
    pub fn clamp(self, map_pa: &[f32], summary: MapSummary, seen_pa: &mut [f32]) -> bool {
        let clamps = self.beyond == OutOfRange::Clamp && self.is_left_by(summary);
        if clamps {
            for (seen, &p) in seen_pa.iter_mut().zip(map_pa) {
                *seen = p.min(self.trained_max_pa);
            }
        }
        clamps
    }

    /// Checks a pressure map, Pa: length, finite, not negative, not above the limit.
    ///
    /// # Errors
    /// The first sample at fault, in row-major order.
    pub fn check(self, map_pa: &[f32]) -> Result<MapSummary, MapError> {
        if map_pa.len() != MAP_LEN {
            return Err(MapError::WrongLength { samples: map_pa.len() });
        }
        let limit_pa = self.limit_pa();
        // One branch-free pass decides, in lanes that the compiler makes vectors of; only a bad
        // map is searched for the culprit. NaN fails both comparisons.
        let (mut good, mut peaks) = ([true; LANES], [0.0_f32; LANES]);
        for lanes in map_pa.as_chunks::<LANES>().0 {
            for ((good, peak), &p) in good.iter_mut().zip(&mut peaks).zip(lanes) {
                *good &= (p >= 0.0) & (p <= limit_pa);
                *peak = if p > *peak { p } else { *peak };
            }
        }
        if good.iter().all(|&good| good) {
            return Ok(MapSummary { peak_pa: greatest(peaks) });
        }
        Err(self.culprit(map_pa))
    }

    fn culprit(self, map_pa: &[f32]) -> MapError {
        let (limit_pa, pressure_max_pa) = (self.limit_pa(), self.trained_max_pa);
        for (index, &value) in map_pa.iter().enumerate() {
            let (row, column) = (index / MAP_SIDE_PX, index % MAP_SIDE_PX);
            if !value.is_finite() {
                return MapError::NotFinite { row, column, value };
            }
            if value < 0.0 {
                return MapError::Negative { row, column, value };
            }
            if value > limit_pa {
                return MapError::OutOfRange { row, column, value, pressure_max_pa };
            }
        }
        // Reached only if the limit itself is not a number.
        MapError::OutOfRange { row: 0, column: 0, value: map_pa[0], pressure_max_pa }
    }
}

/// Some of a map's pixels, in the form that [`keep_inside`] is quick with: all bits of a sample
/// that stays, none of one that goes. (A fifth of the time of a choice by `bool`.)
#[derive(Debug, Clone)]
pub struct PixelMask(Vec<u32>);

impl From<&[bool]> for PixelMask {
    fn from(pixels: &[bool]) -> Self {
        Self(pixels.iter().map(|&stays| if stays { u32::MAX } else { 0 }).collect())
    }
}

/// Takes the pressure off every pixel outside of `mask` (224 x 224); what is left in a summary.
///
/// A pixel that shows no skin cannot be pressed: what a client draws beyond the rim of the patch
/// must not become SED under it, and models differ in what they would make of it.
#[must_use]
pub fn keep_inside(map_pa: &mut [f32], mask: &PixelMask) -> MapSummary {
    let mut peaks = [0.0_f32; LANES];
    let lanes = map_pa.as_chunks_mut::<LANES>().0.iter_mut().zip(mask.0.as_chunks::<LANES>().0);
    for (map_pa, mask) in lanes {
        for ((p, bits), peak) in map_pa.iter_mut().zip(mask).zip(&mut peaks) {
            *p = f32::from_bits(p.to_bits() & bits);
            *peak = if *p > *peak { *p } else { *peak };
        }
    }
    MapSummary { peak_pa: greatest(peaks) }
}

/// The greatest value of a map, 224 x 224, of which none is negative or NaN.
#[must_use]
pub fn peak(map: &[f32]) -> f32 {
    let mut peaks = [0.0_f32; LANES];
    for lanes in map.as_chunks::<LANES>().0 {
        for (peak, &value) in peaks.iter_mut().zip(lanes) {
            *peak = if value > *peak { value } else { *peak };
        }
    }
    greatest(peaks)
}

/// The greatest value of a map and the sum of all.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PeakAndSum {
    /// The greatest.
    pub peak: f32,
    /// The sum, exact to 1e-5.
    pub sum: f32,
}

impl PeakAndSum {
    /// Of a map, 224 x 224, of which no value is negative or NaN, in one pass.
    #[must_use]
    pub fn of(map: &[f32]) -> Self {
        let (mut peaks, mut sum) = ([0.0_f32; LANES], 0.0_f64);
        for row in map.chunks(MAP_SIDE_PX) {
            let mut sums = [0.0_f32; LANES];
            for lanes in row.as_chunks::<LANES>().0 {
                for ((peak, sum), &value) in peaks.iter_mut().zip(&mut sums).zip(lanes) {
                    *peak = if value > *peak { value } else { *peak };
                    *sum += value;
                }
            }
            sum += f64::from(sums.iter().sum::<f32>());
        }
        Self { peak: greatest(peaks), sum: sum as f32 }
    }
}

fn greatest(peaks: [f32; LANES]) -> f32 {
    peaks.iter().fold(0.0, |peak, &p| if p > peak { p } else { peak })
}

/// Samples looked at together; [`MAP_SIDE_PX`] is a multiple.
pub(crate) const LANES: usize = 16;

/// Checks a pressure map, Pa: length, finite, not negative, not above
/// `pressure_max_pa` x [`PRESSURE_HEADROOM`].
///
/// # Errors
/// The first sample at fault, in row-major order.
pub fn check_pressure(map_pa: &[f32], pressure_max_pa: f32) -> Result<MapSummary, MapError> {
    PressureRange { trained_max_pa: pressure_max_pa, beyond: OutOfRange::Refuse }.check(map_pa)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn wrong_lengths_are_refused() {
        for samples in [0, 1, MAP_LEN - 1, MAP_LEN + 1] {
            let error = check_pressure(&vec![0.0; samples], 1.0).unwrap_err();
            assert_eq!(error, MapError::WrongLength { samples });
            assert_eq!(error.code(), ErrorCode::WrongLength);
        }
    }

    #[test]
    fn a_zero_map_is_zero_even_with_minus_zeros() {
        let mut map = vec![0.0; MAP_LEN];
        map[7] = -0.0;
        assert!(check_pressure(&map, 1.0).unwrap().is_zero());
        map[MAP_LEN - 1] = f32::MIN_POSITIVE;
        assert!(!check_pressure(&map, 1.0).unwrap().is_zero());
    }

    #[test]
    fn a_peak_and_a_sum_are_found_in_one_pass() {
        let map: Vec<f32> = (0..MAP_LEN).map(|i| (i * 7919 % 1009) as f32).collect();
        let found = PeakAndSum::of(&map);
        let sum: f64 = map.iter().map(|v| f64::from(*v)).sum();
        assert_eq!(found.peak.to_bits(), peak(&map).to_bits());
        assert!((f64::from(found.sum) / sum - 1.0).abs() < 1e-6, "{found:?}, {sum} is due");
    }

    #[test]
    fn a_limit_that_is_no_number_lets_nothing_through() {
        assert!(check_pressure(&vec![1.0; MAP_LEN], f32::NAN).is_err());
    }

    #[test]
    fn pressure_beyond_the_range_is_taken_as_far_as_was_asked_for() {
        let (mut map, mut seen) = (vec![1.0; MAP_LEN], vec![0.0; MAP_LEN]);
        for (beyond, limit_pa) in [
            (OutOfRange::Refuse, 101.0),
            (OutOfRange::Flag, 1000.0),
            (OutOfRange::Clamp, 1_000_000.0),
        ] {
            let range = PressureRange { trained_max_pa: 100.0, beyond };
            for pressure_pa in [100.0, 102.0, 999.0, 1001.0, 999e3, 1001e3] {
                map[5] = pressure_pa;
                let found = range.check(&map);
                assert_eq!(found.is_ok(), pressure_pa < limit_pa, "{beyond:?} {pressure_pa} Pa");
                let Ok(found) = found else { continue };
                assert_eq!(range.is_left_by(found), pressure_pa > 101.0, "{pressure_pa} Pa");
                let clamped = range.clamp(&map, found, &mut seen);
                let due = beyond == OutOfRange::Clamp && pressure_pa > 101.0;
                assert_eq!(clamped, due);
                assert!(!due || seen[5].to_bits() == 100_f32.to_bits() && seen[6] < 1.5);
            }
        }
    }

    #[test]
    fn pressure_off_the_mask_is_taken_off() {
        let mask: Vec<bool> = (0..MAP_LEN).map(|i| i % 3 == 0).collect();
        let mut map: Vec<f32> = (0..MAP_LEN).map(|i| i as f32).collect();
        let summary = keep_inside(&mut map, &PixelMask::from(&mask[..]));
        for (i, p) in map.iter().enumerate() {
            let due = if i % 3 == 0 { i as f32 } else { 0.0 };
            assert_eq!(p.to_bits(), due.to_bits(), "pixel {i}");
        }
        let last = (MAP_LEN - 1) / 3 * 3;
        assert_eq!(summary.peak_pa.to_bits(), (last as f32).to_bits());
        assert!(keep_inside(&mut map, &PixelMask::from(&vec![false; MAP_LEN][..])).is_zero());
    }

    proptest! {
        #[test]
        fn the_sample_at_fault_is_named(
            index in 0..MAP_LEN,
            value in prop_oneof![
                Just(f32::NAN), Just(f32::INFINITY), Just(f32::NEG_INFINITY),
                -1e9f32..-1e-30, 102.0f32..1e30,
            ],
        ) {
            let mut map = vec![50.0; MAP_LEN];
            map[index] = value;
            let expected = (index / MAP_SIDE_PX, index % MAP_SIDE_PX);
            let (code, place) = match check_pressure(&map, 100.0).unwrap_err() {
                e @ (MapError::NotFinite { row, column, .. }
                | MapError::Negative { row, column, .. }
                | MapError::OutOfRange { row, column, .. }) => (e.code(), (row, column)),
                e @ MapError::WrongLength { .. } => (e.code(), (0, 0)),
            };
            prop_assert_eq!(place, expected);
            let due = if !value.is_finite() {
                ErrorCode::NotFinite
            } else if value < 0.0 {
                ErrorCode::NegativePressure
            } else {
                ErrorCode::OutOfRange
            };
            prop_assert_eq!(code, due);
        }

        #[test]
        fn the_peak_is_the_greatest_sample(index in 0..MAP_LEN, value in 0.0f32..=100.0) {
            let mut map = vec![0.0; MAP_LEN];
            map[index] = value;
            let summary = check_pressure(&map, 100.0).unwrap();
            prop_assert_eq!(summary.peak_pa.to_bits(), value.to_bits());
        }
    }
}
