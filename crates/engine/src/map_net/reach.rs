//! The global map of low rank: from the pressures of the coarsest blocks to the components there.

use super::sums::{settled, store, vectors};
use super::upsampling::Above;
use pulp::Simd;

/// Number of components that are computed at a time.
const CHUNK: usize = 32;

#[derive(Debug)]
pub(super) struct Reach {
    rank: usize,
    side: usize,
    /// `[n^2, rank]`.
    inward: Vec<f32>,
    /// `[C n^2 / CHUNK, rank, CHUNK]`, stored in the order in which they are read.
    outward: Vec<f32>,
}

impl Reach {
    /// `inward` is `[n^2, rank]`, `outward` `[rank, C n^2]`.
    pub(super) fn new(rank: usize, inward: &[f32], outward: &[f32], side: usize) -> Self {
        let len = outward.len() / rank;
        let mut chunks = vec![0.0; len.div_ceil(CHUNK) * rank * CHUNK];
        for (k, values) in outward.chunks_exact(len).enumerate() {
            for (chunk, values) in values.chunks(CHUNK).enumerate() {
                chunks[(chunk * rank + k) * CHUNK..]
                    .iter_mut()
                    .zip(values)
                    .for_each(|(chunk, value)| *chunk = settled(*value));
            }
        }
        Self { rank, side, inward: inward.iter().copied().map(settled).collect(), outward: chunks }
    }

    /// The working memory of [`Self::write`]: the `rank` inner numbers, then the components.
    pub(super) fn space(&self) -> Vec<f32> {
        vec![0.0; self.rank + self.outward.len() / self.rank]
    }

    #[inline(always)]
    pub(super) fn write<S: Simd>(
        &self,
        simd: S,
        means: &[f32],
        space: &mut [f32],
        above: &mut Above,
    ) {
        let (inner, components) = space.split_at_mut(self.rank);
        inner.fill(0.0);
        for (mean, weights) in means.iter().zip(self.inward.chunks_exact(self.rank)) {
            if *mean != 0.0 {
                inner.iter_mut().zip(weights).for_each(|(inner, weight)| *inner += mean * weight);
            }
        }
        for (chunk, components) in components.chunks_exact_mut(CHUNK).enumerate() {
            let weights = &self.outward[chunk * self.rank * CHUNK..][..self.rank * CHUNK];
            match CHUNK / S::F32_LANES {
                2 => outward::<S, 2>(simd, inner, weights, components),
                4 => outward::<S, 4>(simd, inner, weights, components),
                _ => outward::<S, 8>(simd, inner, weights, components),
            }
        }
        let side = self.side;
        for (channel, components) in
            components.chunks_exact(side * side).take(above.channels()).enumerate()
        {
            for (row, components) in components.chunks_exact(side).enumerate() {
                above.values[Above::place(side, channel, row)..][..side]
                    .copy_from_slice(components);
            }
        }
    }
}

/// Computes a chunk of components, V vectors at a time.
#[inline(always)]
fn outward<S: Simd, const V: usize>(
    simd: S,
    inner: &[f32],
    weights: &[f32],
    components: &mut [f32],
) {
    for first in (0..CHUNK).step_by(V * S::F32_LANES) {
        let mut sums = [simd.splat_f32s(0.0); V];
        for k in 0..inner.len() {
            let weights = vectors::<S>(&weights[k * CHUNK + first..], V);
            let inner = simd.splat_f32s(inner[k]);
            for v in 0..V {
                sums[v] = simd.mul_add_e_f32s(inner, weights[v], sums[v]);
            }
        }
        store::<S>(&sums, &mut components[first..]);
    }
}
