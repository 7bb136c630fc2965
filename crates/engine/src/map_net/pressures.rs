//! The pressures of a map as blocks of 2 x 2 pixels, at every level, and which blocks have any.

use std::ops::Range;

use super::sums::MARGIN;
use crate::{MAP_LEN, MAP_SIDE_PX};

/// Pressures below this count as zero, Pa. The squares of the strain components that they cause may
/// be denormal numbers, with which processors are slow; as SED they are less than 1e-20 J/m3.
const PRESSURE_MIN_PA: f32 = 1e-9;

/// How the blocks of a level lie in memory: in four planes, for the pixels above left, above right,
/// below left and below right of each block. Each plane has zeros around it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    /// Blocks in a row or a column.
    pub side: usize,
    /// Width of the zeros around a plane: as far as a convolution reaches.
    pub around: usize,
}

impl Layout {
    pub(super) fn stride(self) -> usize {
        self.side + 2 * self.around + MARGIN
    }

    pub(super) fn plane_len(self) -> usize {
        self.stride() * (self.side + 2 * self.around)
    }

    /// Index of a block in the first plane.
    pub(super) fn place(self, row: usize, column: usize) -> usize {
        (row + self.around) * self.stride() + column + self.around
    }

    fn len(self) -> usize {
        4 * self.plane_len() + MARGIN
    }
}

/// The pressures of one level.
#[derive(Debug)]
pub(super) struct Blocks {
    pub layout: Layout,
    pub planes: Vec<f32>,
    /// For each row, a bit for each block with pressure.
    some: Vec<u128>,
}

impl Blocks {
    fn new(layout: Layout) -> Self {
        Self { layout, planes: vec![0.0; layout.len()], some: vec![0; layout.side] }
    }

    /// A bit for each block of a row that has a pressure at most `around` blocks away.
    pub(super) fn near(&self, row: usize) -> u128 {
        let Layout { side, around } = self.layout;
        let rows = row.saturating_sub(around)..(row + around + 1).min(side);
        let mut near = self.some[rows].iter().fold(0, |all, row| all | row);
        for _ in 0..around {
            near |= near << 1 | near >> 1;
        }
        near & (u128::MAX >> (128 - side))
    }

    /// A row of a plane.
    pub(super) fn row(&self, plane: usize, row: usize) -> &[f32] {
        let at = plane * self.layout.plane_len() + self.layout.place(row, 0);
        &self.planes[at..at + self.layout.side]
    }

    /// Takes a row of blocks from two rows of pixels, and writes the mean of each block. False: the
    /// row is zero and was zero before, so nothing was written.
    #[inline(always)]
    fn take(&mut self, row: usize, pixels: [&[f32]; 2], means: &mut [f32]) -> bool {
        let some = bits(pixels);
        if some == 0 && self.some[row] == 0 {
            return false;
        }
        self.some[row] = some;
        let (side, place) = (self.layout.side, self.layout.place(row, 0));
        let plane_len = self.layout.plane_len();
        for (pair, pixels) in self.planes.chunks_exact_mut(2 * plane_len).zip(pixels) {
            let (left, right) = pair.split_at_mut(plane_len);
            let blocks = left[place..place + side].iter_mut().zip(&mut right[place..place + side]);
            for ((left, right), [a, b]) in blocks.zip(pixels.as_chunks::<2>().0) {
                (*left, *right) = (*a, *b);
            }
        }
        halve(pixels, means);
        true
    }
}

/// A bit for each block of two rows of pixels that is not all zero.
#[inline(always)]
fn bits([upper, lower]: [&[f32]; 2]) -> u128 {
    const BLOCKS: usize = 8;
    let mut bits = 0;
    let chunks = upper.chunks(2 * BLOCKS).zip(lower.chunks(2 * BLOCKS)).enumerate();
    for (chunk, (upper, lower)) in chunks {
        let any =
            upper.iter().zip(lower).fold(false, |any, (a, b)| any | (*a != 0.0) | (*b != 0.0));
        if any {
            let pairs = upper.chunks_exact(2).zip(lower.chunks_exact(2)).enumerate();
            bits |= pairs.fold(0, |bits, (block, (a, b))| {
                let some = (a[0] != 0.0) | (a[1] != 0.0) | (b[0] != 0.0) | (b[1] != 0.0);
                bits | u128::from(some) << (chunk * BLOCKS + block)
            });
        }
    }
    bits
}

/// The pressures of a map, at every level.
#[derive(Debug)]
pub(super) struct Pressures {
    /// The factor from Pa to the network's unit.
    unit: f32,
    /// Two rows of the map in the network's unit.
    rows: Vec<f32>,
    /// The finest first.
    pub levels: Vec<Blocks>,
    /// The pixels that the blocks of each level but the finest are made of, and last the means of
    /// the coarsest blocks.
    maps: Vec<Vec<f32>>,
    /// Which pairs of rows of the map had any pressure the last time.
    had_some: Vec<bool>,
}

impl Pressures {
    pub(super) fn new(unit: f32, layouts: &[Layout]) -> Self {
        let pixels = layouts.iter().map(|layout| 4 * layout.side * layout.side);
        let mut maps: Vec<_> = pixels.skip(1).map(|count| vec![0.0; count]).collect();
        let coarsest = layouts[layouts.len() - 1].side;
        maps.push(vec![0.0; coarsest * coarsest]);
        Self {
            unit,
            rows: vec![0.0; 2 * MAP_SIDE_PX],
            levels: layouts.iter().map(|layout| Blocks::new(*layout)).collect(),
            maps,
            had_some: vec![true; MAP_SIDE_PX / 2],
        }
    }

    /// The means of the coarsest blocks.
    pub(super) fn coarsest(&self) -> &[f32] {
        self.maps.last().map_or(&[], |map| &map[..])
    }

    /// Takes a map, Pa. False: there is no pressure in it.
    #[inline(always)]
    pub(super) fn take(&mut self, pressure_pa: &[f32]) -> bool {
        debug_assert_eq!(pressure_pa.len(), MAP_LEN);
        let mut any = false;
        for (row, pressure_pa) in pressure_pa.chunks_exact(2 * MAP_SIDE_PX).enumerate() {
            let some =
                pressure_pa.iter().fold(false, |some, p| some | (p.abs() >= PRESSURE_MIN_PA));
            any |= some;
            if !some && !self.had_some[row] {
                continue;
            }
            self.had_some[row] = some;
            for (value, p) in self.rows.iter_mut().zip(pressure_pa) {
                *value = if p.abs() >= PRESSURE_MIN_PA { *p * self.unit } else { 0.0 };
            }
            let (upper, lower) = self.rows.split_at(MAP_SIDE_PX);
            let means = of_row(row, MAP_SIDE_PX / 2);
            self.levels[0].take(row, [upper, lower], &mut self.maps[0][means]);
        }
        for (level, blocks) in self.levels[1..].iter_mut().enumerate() {
            let (maps, coarser) = self.maps.split_at_mut(level + 1);
            let (map, side) = (&maps[level], blocks.layout.side);
            for row in 0..side {
                let (upper, lower) = map[4 * side * row..4 * side * (row + 1)].split_at(2 * side);
                blocks.take(row, [upper, lower], &mut coarser[0][of_row(row, side)]);
            }
        }
        any
    }
}

/// Writes the means of the blocks of two rows of pixels.
#[inline(always)]
fn halve([upper, lower]: [&[f32]; 2], means: &mut [f32]) {
    let pairs = upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0);
    for (mean, ([a, b], [c, d])) in means.iter_mut().zip(pairs) {
        *mean = 0.25 * (a + b + c + d);
    }
}

fn of_row(row: usize, side: usize) -> Range<usize> {
    row * side..(row + 1) * side
}
