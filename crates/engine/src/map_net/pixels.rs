//! What a row of components becomes: the input of the next level, or energy densities of pixels.

use super::sums::{GROUP, MARGIN, settled, vectors, vectors_mut};
use super::upsampling::{Above, Upsampling};
use crate::MAP_SIDE_PX;
use pulp::Simd;
use std::ops::Range;

/// Blocks in a row or a column of the map.
const SIDE: usize = MAP_SIDE_PX / 2;
/// Blocks that are turned into pixels at a time. A range of columns begins at a multiple of MARGIN.
const STEP: usize = 8;

/// The last step of the network: its mask, and the columns in which that is not zero.
#[derive(Debug)]
pub(super) struct Pixels {
    /// The factor from the network's densities to J/m3 at each pixel, `[224, 224]`.
    mask: Vec<f32>,
    /// For each row of blocks, the range of columns outside which the mask is zero.
    columns: Vec<Range<usize>>,
}

/// Where a level's rows go.
pub(super) enum Target<'a> {
    /// They are the input of the next finer level.
    Next(&'a mut Above),
    /// They become densities of pixels.
    Pixels { row: &'a mut [f32], pixels: &'a Pixels, map: &'a mut [f32], adds: bool },
}

impl Pixels {
    pub(super) fn new(mask: Vec<f32>) -> Self {
        let mask: Vec<_> = mask.into_iter().map(settled).collect();
        let columns = mask.chunks_exact(2 * MAP_SIDE_PX).map(|rows| {
            let (upper, lower) = rows.split_at(MAP_SIDE_PX);
            let some = |column: usize| {
                [upper[2 * column], upper[2 * column + 1], lower[2 * column], lower[2 * column + 1]]
                    .iter()
                    .any(|factor| *factor != 0.0)
            };
            let first = (0..SIDE).find(|&column| some(column)).unwrap_or(0);
            let end = (0..SIDE).rfind(|&column| some(column)).map_or(0, |column| column + 1);
            first / MARGIN * MARGIN..end.next_multiple_of(STEP).min(SIDE)
        });
        let columns = columns.collect();
        Self { mask, columns }
    }

    /// Writes the pixels of a row of blocks: `row` is `[4, 112 + MARGIN]`.
    #[inline(always)]
    fn write(&self, at: usize, row: &[f32], map: &mut [f32], adds: bool) {
        let Range { start, end } = self.columns[at].clone();
        for (half, densities) in row.chunks_exact(2 * (SIDE + MARGIN)).take(2).enumerate() {
            let place = (2 * at + half) * MAP_SIDE_PX;
            let map = &mut map[place..place + MAP_SIDE_PX];
            let mask = &self.mask[place..place + MAP_SIDE_PX];
            let (left, right) = densities.split_at(SIDE + MARGIN);
            let (left, right) = (&left[start..end], &right[start..end]);
            let mask = &mask[2 * start..2 * end];
            if adds {
                interleave(left, right, &mut map[2 * start..2 * end], |was, value, at| {
                    was + value * mask[at]
                });
                continue;
            }
            interleave(left, right, &mut map[2 * start..2 * end], |_, value, at| value * mask[at]);
            map[..2 * start].fill(0.0);
            map[2 * end..].fill(0.0);
        }
    }
}

impl Target<'_> {
    /// The columns of a row that are needed; None: all.
    pub(super) fn columns(&self, row: usize) -> Option<Range<usize>> {
        match self {
            Self::Pixels { pixels, .. } => Some(pixels.columns[row].clone()),
            _ => None,
        }
    }

    /// Whether it can take components that were not written to a row.
    pub(super) fn takes_phases(&self) -> bool {
        matches!(self, Self::Pixels { .. })
    }

    /// Takes a row to which only the coarser level contributes.
    #[inline(always)]
    pub(super) fn take_phases<S: Simd>(
        &mut self,
        simd: S,
        row: usize,
        columns: &Range<usize>,
        upsampling: &Upsampling,
    ) {
        let Self::Pixels { row: densities, pixels, map, adds } = self else { return };
        upsampling.write_squares(simd, row, columns, densities);
        pixels.write(row, densities, map, *adds);
    }

    /// Takes a row of components, `[4 C .., n + MARGIN]`.
    #[inline(always)]
    pub(super) fn take_row<S: Simd>(&mut self, simd: S, at: usize, components: &[f32]) {
        match self {
            Self::Next(above) => {
                let side = above.side / 2;
                let wide = side + MARGIN;
                for channel in 0..above.channels() {
                    let of_channel = &components[GROUP * channel * wide..][..GROUP * wide];
                    to_pixels(of_channel, side, channel, at, above);
                }
            }
            Self::Pixels { row, pixels, map, adds } => {
                squares(simd, pixels.columns[at].clone(), components, row);
                pixels.write(at, row, map, *adds);
            }
        }
    }
}

/// Computes the sums of the squares of all components: `[4, 112 + MARGIN]`.
#[inline(always)]
fn squares<S: Simd>(simd: S, columns: Range<usize>, components: &[f32], densities: &mut [f32]) {
    let wide = SIDE + MARGIN;
    let components = &components[..components.len() - GROUP * wide];
    let count = columns.len().div_ceil(S::F32_LANES);
    for pixel in 0..GROUP {
        let sums = vectors_mut::<S>(&mut densities[pixel * wide + columns.start..], count);
        sums.fill(simd.splat_f32s(0.0));
        for of_component in components.chunks_exact(GROUP * wide) {
            let values = vectors::<S>(&of_component[pixel * wide + columns.start..], count);
            for k in 0..count {
                sums[k] = simd.mul_add_e_f32s(values[k], values[k], sums[k]);
            }
        }
    }
}

/// Turns the four values of each block of a row into pixels of two rows.
#[inline(always)]
fn to_pixels(blocks: &[f32], side: usize, channel: usize, row: usize, above: &mut Above) {
    let wide = side + MARGIN;
    for half in 0..2 {
        let left = &blocks[2 * half * wide..][..side];
        let right = &blocks[(2 * half + 1) * wide..][..side];
        let place = Above::place(above.side, channel, 2 * row + half);
        let pixels = &mut above.values[place..place + 2 * side];
        interleave(left, right, pixels, |_, value, _| value);
    }
}

/// Writes values of two rows alternately. `write` is given the old value, the new value and its
/// place, and returns what is stored.
#[inline(always)]
fn interleave(left: &[f32], right: &[f32], to: &mut [f32], write: impl Fn(f32, f32, usize) -> f32) {
    let count = left.len() / STEP;
    for k in 0..count {
        let (mut values, from) = ([0.0; 2 * STEP], k * STEP);
        let (left, right) = (&left[from..from + STEP], &right[from..from + STEP]);
        let to = &mut to[2 * from..2 * (from + STEP)];
        for i in 0..STEP {
            values[2 * i] = left[i];
            values[2 * i + 1] = right[i];
        }
        for i in 0..2 * STEP {
            to[i] = write(to[i], values[i], 2 * from + i);
        }
    }
    for k in count * STEP..left.len() {
        to[2 * k] = write(to[2 * k], left[k], 2 * k);
        to[2 * k + 1] = write(to[2 * k + 1], right[k], 2 * k + 1);
    }
}
