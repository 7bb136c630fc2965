//! The global map of low rank, from the coarsest blocks to their components.

use super::sums::{in_vectors, settled, store, vectors};
use super::upsampling::Above;
use pulp::Simd;

/// Values that are summed up at a time.
const CHUNK: usize = 32;

#[derive(Debug)]
pub(super) struct Reach {
    rank: usize,
    side: usize,
    /// `[n^2, rank]`.
    inward: Vec<f32>,
    /// `[C n^2 / CHUNK, rank, CHUNK]`: one after the other as they are read.
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

    /// What [`Self::write`] works in: the inner numbers, then components one after the other.
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
            in_vectors!(S, 0, CHUNK, at, V => {
                let mut sums = [simd.splat_f32s(0.0); V];
                for (k, inner) in inner.iter().enumerate() {
                    let weights = vectors::<S>(&weights[k * CHUNK + at..], V);
                    let inner = simd.splat_f32s(*inner);
                    for (sum, weight) in sums.iter_mut().zip(weights) {
                        *sum = simd.mul_add_e_f32s(inner, *weight, *sum);
                    }
                }
                store::<S>(&sums, &mut components[at..]);
            });
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
