//! Components of a level on the blocks of the next finer one: mixed, then interpolated linearly
//! between the centres of pixels.
//!
//! In the graph this is a convolution over 3 x 3 pixels. Its weights are a C x C matrix times the
//! fixed weights of the interpolation. So here the mix is done once for each pixel, then the
//! interpolation along rows, and last the one across rows, from three rows that are in the cache.

use super::sums::{GROUP, MARGIN, Sums, in_vectors, store, vectors, vectors_mut};
use pulp::Simd;
use std::ops::Range;

/// Weights of the interpolation: that of the pixel itself and that of its neighbour.
pub(super) const OWN: f32 = 0.75;
pub(super) const NEXT: f32 = 0.25;
/// Number of rows that are kept: the one above, the row itself and the one below.
const ROWS: usize = 3;

/// Components before they are mixed: `[C, n, n + MARGIN]`, with zeros in the margin.
#[derive(Debug)]
pub(super) struct Above {
    pub side: usize,
    pub values: Vec<f32>,
}

impl Above {
    pub(super) fn new(channels: usize, side: usize) -> Self {
        // Longer, for vectors that reach beyond the end of the last row.
        Self { side, values: vec![0.0; channels * side * (side + MARGIN) + MARGIN] }
    }

    pub(super) fn channels(&self) -> usize {
        self.values.len() / Self::plane_len(self.side)
    }

    pub(super) fn plane_len(side: usize) -> usize {
        side * (side + MARGIN)
    }

    pub(super) fn place(side: usize, channel: usize, row: usize) -> usize {
        channel * Self::plane_len(side) + row * (side + MARGIN)
    }
}

/// The sums that mix the components by a matrix.
pub(super) fn mix(channels: usize, side: usize, weight: impl Fn(usize, usize) -> f32) -> Sums {
    let taps: Vec<_> = (0..channels).map(|channel| channel * Above::plane_len(side)).collect();
    Sums::new(&taps, channels, weight)
}

/// The three rows that the interpolation works on.
#[derive(Debug)]
pub(super) struct Upsampling {
    side: usize,
    channels: usize,
    /// A row of each channel after the mix, `[C, MARGIN + n + MARGIN]`, with zeros before and
    /// behind.
    mixed: Vec<f32>,
    /// Values interpolated along each row: `[3, n / lanes, C, 2]` vectors, of the left and the
    /// right half of each pixel.
    halves: Vec<f32>,
}

impl Upsampling {
    pub(super) fn new(channels: usize, side: usize) -> Self {
        let padded = channels.next_multiple_of(GROUP);
        Self {
            side,
            channels,
            mixed: vec![0.0; padded * (side + 2 * MARGIN)],
            halves: vec![0.0; ROWS * channels * 2 * side.next_multiple_of(MARGIN)],
        }
    }

    fn row_len(&self) -> usize {
        self.channels * 2 * self.side.next_multiple_of(MARGIN)
    }

    /// Prepares for the first row.
    #[inline(always)]
    pub(super) fn begin<S: Simd>(&mut self, simd: S, above: &Above, mix: &Sums) {
        let len = self.row_len();
        self.halves[(ROWS - 1) * len..].fill(0.0);
        self.take(simd, above, mix, 0);
    }

    /// Prepares a row for writing. Rows must come one after another.
    #[inline(always)]
    pub(super) fn advance<S: Simd>(&mut self, simd: S, above: &Above, mix: &Sums, row: usize) {
        if row + 1 < self.side {
            self.take(simd, above, mix, row + 1);
        } else {
            let len = self.row_len();
            self.halves[(row + 1) % ROWS * len..][..len].fill(0.0);
        }
    }

    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, above: &Above, mix: &Sums, row: usize) {
        let (side, width) = (self.side, self.side + 2 * MARGIN);
        let from = &above.values[Above::place(side, 0, row)..];
        for group in 0..mix.groups() {
            in_vectors!(S, 0, side, at, V => {
                let sums = mix.of_group::<S, V>(simd, group, &from[at..]);
                for (channel, sums) in sums.iter().enumerate() {
                    let channel = group * GROUP + channel;
                    store::<S>(sums, &mut self.mixed[channel * width + MARGIN + at..]);
                }
            });
        }
        let (len, channels) = (self.row_len(), self.channels);
        let count = side.div_ceil(S::F32_LANES);
        let (own, next) = (simd.splat_f32s(OWN), simd.splat_f32s(NEXT));
        let halves = &mut self.halves[row % ROWS * len..(row % ROWS + 1) * len];
        let halves = vectors_mut::<S>(halves, len / S::F32_LANES);
        for channel in 0..channels {
            let mixed = &self.mixed[channel * width + MARGIN - 1..];
            let before = vectors::<S>(mixed, count);
            let its = vectors::<S>(&mixed[1..], count);
            let behind = vectors::<S>(&mixed[2..], count);
            for k in 0..count {
                let own = simd.mul_f32s(own, its[k]);
                let halves = &mut halves[2 * (k * channels + channel)..][..2];
                halves[0] = simd.mul_add_e_f32s(next, before[k], own);
                halves[1] = simd.mul_add_e_f32s(next, behind[k], own);
            }
        }
    }

    /// The vectors of one of the kept rows.
    #[inline(always)]
    fn line<S: Simd>(&self, row: usize) -> &[S::f32s] {
        let len = self.row_len();
        vectors::<S>(&self.halves[row % ROWS * len..], len / S::F32_LANES)
    }

    /// Writes a row of components: `[4 C, n + MARGIN]`. `columns` must begin at a multiple of
    /// MARGIN.
    #[inline(always)]
    pub(super) fn write<S: Simd>(
        &self,
        simd: S,
        row: usize,
        columns: &Range<usize>,
        components: &mut [f32],
    ) {
        let (wide, from) = (self.side + MARGIN, columns.start);
        let (first, count) = (from / S::F32_LANES, columns.len().div_ceil(S::F32_LANES));
        let before = self.line::<S>(row + ROWS - 1);
        let its = self.line::<S>(row);
        let behind = self.line::<S>(row + 1);
        for channel in 0..self.channels {
            let components = &mut components[GROUP * channel * wide..][..GROUP * wide];
            let [a, b, c, d] = quarters::<S>(components, wide, from, count);
            for k in 0..count {
                let at = 2 * ((first + k) * self.channels + channel);
                let at = at..at + 2;
                [a[k], b[k], c[k], d[k]] =
                    phases(simd, &before[at.clone()], &its[at.clone()], &behind[at]);
            }
        }
    }

    /// Writes the sums of the squares of a row of components: `[4, n + MARGIN]`. `columns` as
    /// above.
    #[inline(always)]
    pub(super) fn write_squares<S: Simd>(
        &self,
        simd: S,
        row: usize,
        columns: &Range<usize>,
        sums: &mut [f32],
    ) {
        let (wide, from) = (self.side + MARGIN, columns.start);
        let (first, count) = (from / S::F32_LANES, columns.len().div_ceil(S::F32_LANES));
        let [a, b, c, d] = quarters::<S>(sums, wide, from, count);
        let before = self.line::<S>(row + ROWS - 1);
        let its = self.line::<S>(row);
        let behind = self.line::<S>(row + 1);
        for k in 0..count {
            let place = 2 * (first + k) * self.channels;
            let mut sums = [simd.splat_f32s(0.0); 4];
            for channel in 0..self.channels {
                let at = place + 2 * channel;
                let at = at..at + 2;
                let values = phases(simd, &before[at.clone()], &its[at.clone()], &behind[at]);
                for pixel in 0..4 {
                    sums[pixel] = simd.mul_add_e_f32s(values[pixel], values[pixel], sums[pixel]);
                }
            }
            [a[k], b[k], c[k], d[k]] = sums;
        }
    }
}

/// The vectors of the four rows of a group, each from column `from` on.
#[inline(always)]
fn quarters<S: Simd>(
    rows: &mut [f32],
    wide: usize,
    from: usize,
    count: usize,
) -> [&mut [S::f32s]; 4] {
    let (upper, lower) = rows.split_at_mut(2 * wide);
    let (a, b) = upper.split_at_mut(wide);
    let (c, d) = lower.split_at_mut(wide);
    [
        vectors_mut::<S>(&mut a[from..], count),
        vectors_mut::<S>(&mut b[from..], count),
        vectors_mut::<S>(&mut c[from..], count),
        vectors_mut::<S>(&mut d[from..], count),
    ]
}

/// The values above left, above right, below left and below right of a vector of pixels. The inputs
/// are the row itself and its neighbours, each interpolated to the left and to the right.
#[inline(always)]
fn phases<S: Simd>(
    simd: S,
    before: &[S::f32s],
    its: &[S::f32s],
    behind: &[S::f32s],
) -> [S::f32s; 4] {
    let (own, next) = (simd.splat_f32s(OWN), simd.splat_f32s(NEXT));
    let (left, right) = (simd.mul_f32s(own, its[0]), simd.mul_f32s(own, its[1]));
    [
        simd.mul_add_e_f32s(next, before[0], left),
        simd.mul_add_e_f32s(next, before[1], right),
        simd.mul_add_e_f32s(next, behind[0], left),
        simd.mul_add_e_f32s(next, behind[1], right),
    ]
}
