//! Components of a level on the blocks of the next: mixed, then linear between pixels' middles.
//!
//! In the graph this is a convolution over 3 x 3 pixels. Its weights are a C x C matrix times the
//! fixed weights of the interpolation, so the mix is done once for each pixel, the interpolation
//! along rows once, and the one across rows from three rows that are in the cache.

use super::sums::{GROUP, MARGIN, Sums, in_vectors, store, vectors, vectors_mut};
use pulp::Simd;
use std::ops::Range;

/// Weights of the interpolation: of the pixel itself and of its neighbour.
pub(super) const OWN: f32 = 0.75;
pub(super) const NEXT: f32 = 0.25;
/// Rows that are kept: the one above, its own and the one below.
const ROWS: usize = 3;

/// Components before they are mixed: `[C, n, n + MARGIN]`, with zeros in the margin.
#[derive(Debug)]
pub(super) struct Above {
    pub side: usize,
    pub values: Vec<f32>,
}

impl Above {
    pub(super) fn new(channels: usize, side: usize) -> Self {
        // More for the vectors that reach over the end of the last row.
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

/// The matrix of a mix.
pub(super) fn mix(channels: usize, side: usize, weight: impl Fn(usize, usize) -> f32) -> Sums {
    let taps = (0..channels).map(|channel| channel * Above::plane_len(side)).collect();
    Sums::new(taps, channels, weight)
}

/// Three rows at work.
#[derive(Debug)]
pub(super) struct Upsampling {
    side: usize,
    channels: usize,
    /// A row of each channel, with zeros before and behind: `[C, MARGIN + n + MARGIN]`.
    mixed: Vec<f32>,
    /// Interpolated along the row: `[3, C, 2, n + MARGIN]`.
    halves: Vec<f32>,
}

impl Upsampling {
    pub(super) fn new(channels: usize, side: usize) -> Self {
        let padded = channels.next_multiple_of(GROUP);
        Self {
            side,
            channels,
            mixed: vec![0.0; padded * (side + 2 * MARGIN)],
            halves: vec![0.0; ROWS * channels * 2 * (side + MARGIN)],
        }
    }

    fn row_len(&self) -> usize {
        self.channels * 2 * (self.side + MARGIN)
    }

    /// Before the first row.
    #[inline(always)]
    pub(super) fn begin<S: Simd>(&mut self, simd: S, above: &Above, mix: Option<&Sums>) {
        let len = self.row_len();
        self.halves[(ROWS - 1) * len..].fill(0.0);
        self.take(simd, above, mix, 0);
    }

    /// Makes a row ready to be written; rows come one after the other.
    #[inline(always)]
    pub(super) fn advance<S: Simd>(
        &mut self,
        simd: S,
        above: &Above,
        mix: Option<&Sums>,
        row: usize,
    ) {
        if row + 1 < self.side {
            self.take(simd, above, mix, row + 1);
        } else {
            let len = self.row_len();
            self.halves[(row + 1) % ROWS * len..][..len].fill(0.0);
        }
    }

    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, above: &Above, mix: Option<&Sums>, row: usize) {
        let (side, width) = (self.side, self.side + 2 * MARGIN);
        let from = &above.values[Above::place(side, 0, row)..];
        if let Some(mix) = mix {
            for group in 0..mix.groups() {
                in_vectors!(S, 0, side, at, V => {
                    let sums = mix.of_group::<S, V>(simd, group, &from[at..]);
                    for (channel, sums) in sums.iter().enumerate() {
                        let channel = group * GROUP + channel;
                        store::<S>(sums, &mut self.mixed[channel * width + MARGIN + at..]);
                    }
                });
            }
        } else {
            for channel in 0..self.channels {
                let mixed = &mut self.mixed[channel * width + MARGIN..][..side];
                mixed.copy_from_slice(&from[channel * Above::plane_len(side)..][..side]);
            }
        }
        let (len, wide) = (self.row_len(), side + MARGIN);
        let count = side.div_ceil(S::F32_LANES);
        let (own, next) = (simd.splat_f32s(OWN), simd.splat_f32s(NEXT));
        for channel in 0..self.channels {
            let mixed = &self.mixed[channel * width + MARGIN - 1..];
            let before = vectors::<S>(mixed, count);
            let its = vectors::<S>(&mixed[1..], count);
            let behind = vectors::<S>(&mixed[2..], count);
            let halves = &mut self.halves[row % ROWS * len + channel * 2 * wide..][..2 * wide];
            let (left, right) = halves.split_at_mut(wide);
            let left = vectors_mut::<S>(left, count);
            let right = vectors_mut::<S>(right, count);
            for k in 0..count {
                let own = simd.mul_f32s(own, its[k]);
                left[k] = simd.mul_add_e_f32s(next, before[k], own);
                right[k] = simd.mul_add_e_f32s(next, behind[k], own);
            }
        }
    }

    /// The three rows of a channel that [`phases`] reads, from a column on.
    #[inline(always)]
    fn lines<S: Simd>(
        &self,
        channel: usize,
        row: usize,
        from: usize,
        count: usize,
    ) -> Lines<'_, S::f32s> {
        let (len, wide) = (self.row_len(), self.side + MARGIN);
        let place = channel * 2 * wide + from;
        let line = |row: usize, half: usize| {
            vectors::<S>(&self.halves[row % ROWS * len + place + half * wide..], count)
        };
        Lines {
            before: [line(row + ROWS - 1, 0), line(row + ROWS - 1, 1)],
            its: [line(row, 0), line(row, 1)],
            behind: [line(row + 1, 0), line(row + 1, 1)],
        }
    }

    /// A row of components: `[4 C, n + MARGIN]`.
    #[inline(always)]
    pub(super) fn write<S: Simd>(
        &self,
        simd: S,
        row: usize,
        columns: &Range<usize>,
        components: &mut [f32],
    ) {
        let (wide, from) = (self.side + MARGIN, columns.start);
        let count = columns.len().div_ceil(S::F32_LANES);
        for channel in 0..self.channels {
            let lines = self.lines::<S>(channel, row, from, count);
            let components = &mut components[GROUP * channel * wide..][..GROUP * wide];
            let [a, b, c, d] = quarters::<S>(components, wide, from, count);
            for k in 0..count {
                [a[k], b[k], c[k], d[k]] = phases(simd, &lines, k);
            }
        }
    }

    /// Sums of the squares of a row of components: `[4, n + MARGIN]`.
    #[inline(always)]
    pub(super) fn write_squares<S: Simd>(
        &self,
        simd: S,
        row: usize,
        columns: &Range<usize>,
        sums: &mut [f32],
    ) {
        let (wide, from) = (self.side + MARGIN, columns.start);
        let count = columns.len().div_ceil(S::F32_LANES);
        let [a, b, c, d] = quarters::<S>(sums, wide, from, count);
        for channel in 0..self.channels {
            let lines = self.lines::<S>(channel, row, from, count);
            for k in 0..count {
                let values = phases(simd, &lines, k);
                let mut sums = [a[k], b[k], c[k], d[k]];
                for (sum, value) in sums.iter_mut().zip(values) {
                    *sum = if channel == 0 {
                        simd.mul_f32s(value, value)
                    } else {
                        simd.mul_add_e_f32s(value, value, *sum)
                    };
                }
                [a[k], b[k], c[k], d[k]] = sums;
            }
        }
    }
}

/// The four rows of a group, one after another, each from a column on.
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
    [a, b, c, d].map(|row| vectors_mut::<S>(&mut row[from..], count))
}

/// A row and its neighbours, each interpolated to the left and to the right.
struct Lines<'a, V> {
    before: [&'a [V]; 2],
    its: [&'a [V]; 2],
    behind: [&'a [V]; 2],
}

/// Values at a vector of blocks: above left, above right, below left, below right.
#[inline(always)]
fn phases<S: Simd>(simd: S, lines: &Lines<'_, S::f32s>, k: usize) -> [S::f32s; 4] {
    let (own, next) = (simd.splat_f32s(OWN), simd.splat_f32s(NEXT));
    let [left, right] = [simd.mul_f32s(own, lines.its[0][k]), simd.mul_f32s(own, lines.its[1][k])];
    [
        simd.mul_add_e_f32s(next, lines.before[0][k], left),
        simd.mul_add_e_f32s(next, lines.before[1][k], right),
        simd.mul_add_e_f32s(next, lines.behind[0][k], left),
        simd.mul_add_e_f32s(next, lines.behind[1][k], right),
    ]
}
