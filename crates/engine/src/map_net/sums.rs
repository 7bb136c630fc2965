//! Sums over taps, for many neighbouring positions at a time: convolutions and products.

use pulp::Simd;

/// Channels whose sums are in registers at a time. With three vectors of positions each that is
/// twelve sums, three vectors and a weight: the sixteen registers of AVX2.
pub(super) const GROUP: usize = 4;
/// Most vectors of positions at a time.
pub(super) const VECTORS: usize = 3;
/// Values behind the last position that a vector may reach over.
pub(super) const MARGIN: usize = 16;
/// Weights below this are none. Products of them may be denormal numbers, which processors are slow
/// with; beside other weights they are lost in rounding.
const WEIGHT_MIN: f32 = 1e-20;

/// A weight, or 0 if it is none.
pub(super) fn settled(weight: f32) -> f32 {
    if weight.abs() < WEIGHT_MIN { 0.0 } else { weight }
}

/// `y[o] = sum over t of w[o, t] x[t]`, where `x[t]` lies `taps[t]` values behind the position.
#[derive(Debug)]
pub(super) struct Sums {
    taps: Vec<usize>,
    /// `w[o / 4, t, o % 4]`, 0 beyond the last channel.
    weights: Vec<[f32; GROUP]>,
}

impl Sums {
    /// `weight`: of a channel and a tap.
    pub(super) fn new(
        taps: Vec<usize>,
        channels: usize,
        weight: impl Fn(usize, usize) -> f32,
    ) -> Self {
        let mut weights = vec![[0.0; GROUP]; channels.div_ceil(GROUP) * taps.len()];
        for channel in 0..channels {
            let group = &mut weights[channel / GROUP * taps.len()..][..taps.len()];
            for (tap, weights) in group.iter_mut().enumerate() {
                weights[channel % GROUP] = settled(weight(channel, tap));
            }
        }
        Self { taps, weights }
    }

    pub(super) fn groups(&self) -> usize {
        self.weights.len() / self.taps.len()
    }

    /// The sums of a group of channels at V vectors of positions; `map` begins at the first.
    #[inline(always)]
    pub(super) fn of_group<S: Simd, const V: usize>(
        &self,
        simd: S,
        group: usize,
        map: &[f32],
    ) -> [[S::f32s; V]; GROUP] {
        let weights = &self.weights[group * self.taps.len()..][..self.taps.len()];
        let mut sums = [[simd.splat_f32s(0.0); V]; GROUP];
        for (tap, weights) in self.taps.iter().zip(weights) {
            let (values, _) = S::as_simd_f32s(&map[*tap..*tap + V * S::F32_LANES]);
            for (sums, weight) in sums.iter_mut().zip(weights) {
                let weight = simd.splat_f32s(*weight);
                for (sum, value) in sums.iter_mut().zip(values) {
                    *sum = simd.mul_add_e_f32s(weight, *value, *sum);
                }
            }
        }
        sums
    }
}

/// So many vectors from the beginning of a row.
#[inline(always)]
pub(super) fn vectors<S: Simd>(from: &[f32], count: usize) -> &[S::f32s] {
    &S::as_simd_f32s(&from[..count * S::F32_LANES]).0[..count]
}

/// As [`vectors`], to be written to.
#[inline(always)]
pub(super) fn vectors_mut<S: Simd>(from: &mut [f32], count: usize) -> &mut [S::f32s] {
    &mut S::as_mut_simd_f32s(&mut from[..count * S::F32_LANES]).0[..count]
}

/// Stores vectors one behind the other.
#[inline(always)]
pub(super) fn store<S: Simd>(vectors: &[S::f32s], to: &mut [f32]) {
    S::as_mut_simd_f32s(&mut to[..vectors.len() * S::F32_LANES]).0.copy_from_slice(vectors);
}

/// Goes over positions in steps of V vectors. The last step may reach over the end by less than a
/// vector.
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
