//! Sums over taps, for many neighbouring positions at a time: convolutions and products.

use pulp::Simd;
use std::ops::Range;

/// Channels whose sums are kept in registers at a time. With three vectors of positions for each
/// that takes twelve registers for sums, three for values and one for a weight: the sixteen of
/// AVX2.
pub(super) const GROUP: usize = 4;
/// The most vectors of positions at a time.
pub(super) const VECTORS: usize = 3;
/// How many values a vector may reach beyond the last position.
pub(super) const MARGIN: usize = 16;
/// Weights below this count as zero. Products with them may be denormal numbers, with which
/// processors are slow; beside other weights they are lost in rounding.
const WEIGHT_MIN: f32 = 1e-20;

/// The weight, or 0 if it is below [`WEIGHT_MIN`].
pub(super) fn settled(weight: f32) -> f32 {
    if weight.abs() < WEIGHT_MIN { 0.0 } else { weight }
}

/// `y[o] = sum over t of w[o, t] x[t]`, where `x[t]` lies `taps[t]` values behind the position.
#[derive(Debug)]
pub(super) struct Sums {
    /// For each group of channels, the range of its taps and weights.
    groups: Vec<Range<usize>>,
    taps: Vec<usize>,
    /// One weight for each channel of the group; 0 beyond the last channel.
    weights: Vec<[f32; GROUP]>,
}

impl Sums {
    /// `weight` gives the weight of a channel and a tap. A tap whose weights are zero in all
    /// channels of a group is left out of that group.
    pub(super) fn new(
        taps: &[usize],
        channels: usize,
        weight: impl Fn(usize, usize) -> f32,
    ) -> Self {
        let mut sums = Self { groups: vec![], taps: vec![], weights: vec![] };
        for first in (0..channels).step_by(GROUP) {
            let begin = sums.taps.len();
            for (tap, at) in taps.iter().enumerate() {
                let mut weights = [0.0; GROUP];
                for (channel, settled_weight) in (first..channels).zip(&mut weights) {
                    *settled_weight = settled(weight(channel, tap));
                }
                if weights.iter().any(|weight| *weight != 0.0) {
                    sums.taps.push(*at);
                    sums.weights.push(weights);
                }
            }
            sums.groups.push(begin..sums.taps.len());
        }
        sums
    }

    pub(super) fn groups(&self) -> usize {
        self.groups.len()
    }

    /// The sums of a group of channels at V vectors of positions; `map` begins at the first.
    #[inline(always)]
    pub(super) fn of_group<S: Simd, const V: usize>(
        &self,
        simd: S,
        group: usize,
        map: &[f32],
    ) -> [[S::f32s; V]; GROUP] {
        self.and(simd, 0.0, group, map)
    }

    /// As [`Self::of_group`], with `number` added to each sum.
    // The loops use indices, since the compiler leaves this many iterators uninlined, and a call
    // costs as much as a tap.
    #[inline(always)]
    pub(super) fn and<S: Simd, const V: usize>(
        &self,
        simd: S,
        number: f32,
        group: usize,
        map: &[f32],
    ) -> [[S::f32s; V]; GROUP] {
        let Range { start, end } = self.groups[group];
        let (taps, weights) = (&self.taps[start..end], &self.weights[start..end]);
        let mut sums = [[simd.splat_f32s(number); V]; GROUP];
        for tap in 0..taps.len() {
            let values = vectors::<S>(&map[taps[tap]..], V);
            for channel in 0..GROUP {
                let weight = simd.splat_f32s(weights[tap][channel]);
                for v in 0..V {
                    sums[channel][v] = simd.mul_add_e_f32s(weight, values[v], sums[channel][v]);
                }
            }
        }
        sums
    }
}

/// The first `count` vectors of a row.
#[inline(always)]
pub(super) fn vectors<S: Simd>(from: &[f32], count: usize) -> &[S::f32s] {
    &S::as_simd_f32s(&from[..count * S::F32_LANES]).0[..count]
}

/// As [`vectors`], mutable.
#[inline(always)]
pub(super) fn vectors_mut<S: Simd>(from: &mut [f32], count: usize) -> &mut [S::f32s] {
    &mut S::as_mut_simd_f32s(&mut from[..count * S::F32_LANES]).0[..count]
}

/// Stores vectors one after another.
#[inline(always)]
pub(super) fn store<S: Simd>(vectors: &[S::f32s], to: &mut [f32]) {
    S::as_mut_simd_f32s(&mut to[..vectors.len() * S::F32_LANES]).0.copy_from_slice(vectors);
}

/// Goes over positions in steps of one, two or three vectors. The last step may reach beyond the
/// end by less than a vector.
macro_rules! in_vectors {
    ($simd:ty, $from:expr, $to:expr, $at:ident, $count:ident => $step:expr) => {{
        let (mut $at, to) = ($from, $to);
        while $at < to {
            let left = (to - $at).div_ceil(<$simd>::F32_LANES);
            let done = match left {
                1 => {
                    const $count: usize = 1;
                    $step;
                    1
                }
                // Two and two are faster than three and one.
                2 | 4 => {
                    const $count: usize = 2;
                    $step;
                    2
                }
                _ => {
                    const $count: usize = $crate::map_net::sums::VECTORS;
                    $step;
                    $crate::map_net::sums::VECTORS
                }
            };
            $at += done * <$simd>::F32_LANES;
        }
    }};
}
pub(super) use in_vectors;
