//! Factors about 1 that vary smoothly over the finger.

use super::sums::{GROUP, MARGIN, Sums};
use pulp::Simd;

/// The factor `1 + sum over k of w[c, k] place[k]` of each channel c at each position.
#[derive(Debug)]
pub(super) struct Gain {
    sums: Sums,
    /// `[parts, K, positions]`.
    place: Vec<f32>,
    part_len: usize,
}

impl Gain {
    /// `place` is `[K, n, n]`, `weights` `[channels, K]`; each row is a part.
    pub(super) fn of_rows(weights: &[f32], place: &[f32], side: usize) -> Self {
        let at = |row, column| (row, column);
        Self::of_parts(weights, place, side, (side, side + MARGIN), at)
    }

    /// As [`Self::of_rows`], for any division into `parts` of `positions` each. `at` gives the part
    /// and the position for a row and a column.
    pub(super) fn of_parts(
        weights: &[f32],
        place: &[f32],
        side: usize,
        (parts, positions): (usize, usize),
        at: impl Fn(usize, usize) -> (usize, usize),
    ) -> Self {
        let places = place.len() / (side * side);
        let part_len = places * positions;
        let mut laid_out = vec![0.0; parts * part_len];
        for (k, place) in place.chunks_exact(side * side).enumerate() {
            for (index, value) in place.iter().enumerate() {
                let (part, position) = at(index / side, index % side);
                laid_out[part * part_len + k * positions + position] = *value;
            }
        }
        let taps: Vec<_> = (0..places).map(|k| k * positions).collect();
        let sums =
            Sums::new(&taps, weights.len() / places, |channel, k| weights[channel * places + k]);
        Self { sums, place: laid_out, part_len }
    }

    pub(super) fn groups(&self) -> usize {
        self.sums.groups()
    }

    /// The factors of a group of channels at V vectors of positions; 1 for channels beyond the
    /// last.
    #[inline(always)]
    pub(super) fn of_group<S: Simd, const V: usize>(
        &self,
        simd: S,
        group: usize,
        part: usize,
        at: usize,
    ) -> [[S::f32s; V]; GROUP] {
        let place = &self.place[part * self.part_len..(part + 1) * self.part_len];
        self.sums.and::<S, V>(simd, 1.0, group, &place[at..])
    }
}
