//! Factors about 1 that vary smoothly over the finger.

use super::sums::{MARGIN, settled};
use pulp::Simd;

/// `1 + sum over k of w[c, k] place[k]`, of each channel at each position.
#[derive(Debug)]
pub(super) struct Gain {
    /// `[channels, K]`.
    weights: Vec<f32>,
    /// `[parts, K, positions + MARGIN]`: a part is a row, or the whole map.
    place: Vec<f32>,
    places: usize,
    positions: usize,
}

impl Gain {
    /// `place` is `[K, n, n]`, `weights` `[channels, K]`; each row is a part.
    pub(super) fn of_rows(weights: &[f32], place: &[f32], side: usize) -> Self {
        let places = place.len() / (side * side);
        let wide = side + MARGIN;
        let mut rows = vec![0.0; side * places * wide];
        for row in 0..side {
            for k in 0..places {
                rows[(row * places + k) * wide..][..side]
                    .copy_from_slice(&place[(k * side + row) * side..][..side]);
            }
        }
        Self {
            weights: weights.iter().copied().map(settled).collect(),
            place: rows,
            places,
            positions: side,
        }
    }

    /// As [`Self::of_rows`], but the map is one part, its rows `stride` positions apart.
    pub(super) fn of_map(weights: &[f32], place: &[f32], side: usize, stride: usize) -> Self {
        let places = place.len() / (side * side);
        let positions = side * stride;
        let mut map = vec![0.0; places * (positions + MARGIN)];
        for (k, place) in place.chunks_exact(side * side).enumerate() {
            for (row, place) in place.chunks_exact(side).enumerate() {
                map[k * (positions + MARGIN) + row * stride..][..side].copy_from_slice(place);
            }
        }
        Self {
            weights: weights.iter().copied().map(settled).collect(),
            place: map,
            places,
            positions,
        }
    }

    /// The factors of a channel at V vectors of positions.
    #[inline(always)]
    pub(super) fn at<S: Simd, const V: usize>(
        &self,
        simd: S,
        channel: usize,
        part: usize,
        at: usize,
    ) -> [S::f32s; V] {
        let wide = self.positions + MARGIN;
        let place = &self.place[part * self.places * wide..][..self.places * wide];
        let weights = &self.weights[channel * self.places..][..self.places];
        let mut gain = [simd.splat_f32s(1.0); V];
        for (place, weight) in place.chunks_exact(wide).zip(weights) {
            let (place, _) = S::as_simd_f32s(&place[at..at + V * S::F32_LANES]);
            let weight = simd.splat_f32s(*weight);
            for (gain, place) in gain.iter_mut().zip(place) {
                *gain = simd.mul_add_e_f32s(weight, *place, *gain);
            }
        }
        gain
    }
}
