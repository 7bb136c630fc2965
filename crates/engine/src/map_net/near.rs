//! The near field of a level: a convolution over the blocks of pressures, times a gain.
//!
//! The weights of each of the four pixels of a block are centred on that pixel. So three tenths of
//! the weights in a kernel over 3 x 3 blocks are zero. Sums are grouped by pixel and not by
//! component, because the sums of one pixel have their zeros at the same places, which are then
//! skipped.

use super::gain::Gain;
use super::parts::LevelParts;
use super::pressures::{Blocks, Layout};
use super::sums::{GROUP, MARGIN, Sums, VECTORS, store, vectors, vectors_mut};
use pulp::{Simd, WithSimd};

/// Number of positions whose gains are kept at a time.
const CHUNK: usize = VECTORS * MARGIN;

#[derive(Debug)]
pub(super) struct Near {
    layout: Layout,
    sums: Sums,
    /// For each sum, the index of its channel and that of its gain.
    of: Vec<(usize, usize)>,
    gain: Gain,
}

impl Near {
    pub(super) fn new(parts: &LevelParts, layout: Layout) -> Self {
        let LevelParts { side, kernel, near, over_finger, place, .. } = parts;
        let area = kernel * kernel;
        let taps: Vec<_> = (0..GROUP * area)
            .map(|tap| {
                let (plane, row, column) = (tap / area, tap % area / kernel, tap % kernel);
                plane * layout.plane_len() + row * layout.stride() + column
            })
            .collect();
        let channels = near.len() / (GROUP * area);
        let components = channels / GROUP;
        let places = over_finger.len() / channels;
        let of_channel = |channel: usize| &over_finger[channel * places..(channel + 1) * places];
        // As a rule the four pixels of a block have the same gain.
        let is_shared = (0..channels)
            .all(|channel| of_channel(channel).iter().eq(of_channel(channel / GROUP * GROUP)));
        let gained = (0..channels).step_by(if is_shared { GROUP } else { 1 });
        let weights: Vec<f32> = gained.flat_map(|channel| of_channel(channel).to_vec()).collect();
        let of: Vec<_> = (0..channels)
            .map(|sum| {
                let channel = sum % components * GROUP + sum / components;
                (channel, if is_shared { channel / GROUP } else { channel })
            })
            .collect();
        let weight = |sum: usize, tap: usize| near[of[sum].0 * GROUP * area + tap];
        let sums = Sums::new(&taps, channels, weight);
        Self { layout, sums, gain: Gain::of_rows(&weights, place, *side), of }
    }

    /// The working memory of [`AddNear`].
    pub(super) fn space(&self) -> Vec<f32> {
        vec![0.0; self.gain.groups() * GROUP * CHUNK]
    }
}

/// Adds the near field to a row of components, at the blocks that are near a pressure. Elsewhere it
/// is zero.
pub(super) struct AddNear<'a> {
    pub near: &'a Near,
    pub blocks: &'a Blocks,
    pub row: usize,
    /// A bit for each block of the row that is near a pressure.
    pub bits: u128,
    /// A row of components.
    pub to: &'a mut [f32],
    pub space: &'a mut [f32],
}

impl WithSimd for AddNear<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        while self.bits != 0 {
            let at = self.bits.trailing_zeros() as usize;
            let run = (self.bits >> at).trailing_ones() as usize;
            let vectors = run.div_ceil(S::F32_LANES).min(VECTORS);
            match vectors {
                1 => self.at::<S, 1>(simd, at),
                2 => self.at::<S, 2>(simd, at),
                _ => self.at::<S, VECTORS>(simd, at),
            }
            // Vectors that reach beyond the run's end have added the near field there too.
            let done = (at + vectors * S::F32_LANES) as u32;
            self.bits &= u128::MAX.checked_shl(done).unwrap_or(0);
        }
    }
}

impl AddNear<'_> {
    #[inline(always)]
    fn at<S: Simd, const V: usize>(&mut self, simd: S, at: usize) {
        let Self { near, blocks, row, to, space, .. } = self;
        let Near { layout, sums, of, gain } = near;
        for group in 0..gain.groups() {
            let gains = gain.of_group::<S, V>(simd, group, *row, at);
            for channel in 0..GROUP {
                let place = (group * GROUP + channel) * CHUNK;
                store::<S>(&gains[channel], &mut space[place..]);
            }
        }
        // The first tap of the kernel lies as far before the block as there are zeros around the
        // map.
        let corner = &blocks.planes[*row * layout.stride() + at..];
        let wide = layout.side + MARGIN;
        for group in 0..sums.groups() {
            let sums = sums.of_group::<S, V>(simd, group, corner);
            for sum in 0..GROUP.min(of.len() - group * GROUP) {
                let (channel, gain) = of[group * GROUP + sum];
                let gains = vectors::<S>(&space[gain * CHUNK..], V);
                let values = vectors_mut::<S>(&mut to[channel * wide + at..], V);
                for v in 0..V {
                    values[v] = simd.mul_add_e_f32s(sums[sum][v], gains[v], values[v]);
                }
            }
        }
    }
}
