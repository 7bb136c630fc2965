//! One level: what is linear in the pressures around and what comes from above, corrected.

use super::correction::{Correction, Flat};
use super::gain::Gain;
use super::pixels::Target;
use super::pressures::{Blocks, Layout};
use super::sums::{GROUP, MARGIN, Sums, VECTORS, vectors, vectors_mut};
use super::upsampling::{Above, Upsampling};
use pulp::Simd;
use std::ops::Range;

#[derive(Debug)]
pub(super) struct Level {
    pub layout: Layout,
    /// From the pressures around. A group of four channels is a component of a block's pixels.
    pub near: Sums,
    pub gain: Gain,
    pub mix: Sums,
    pub correction: Option<Correction>,
}

/// Where a level is worked on.
#[derive(Debug)]
pub(super) struct LevelSpace {
    upsampling: Upsampling,
    /// A row of components and pressures, `[4 C + 4, n + MARGIN]`.
    row: Vec<f32>,
    /// All rows, if the correction looks at neighbours.
    map: Vec<f32>,
    /// What the correction adds: to a row or to all.
    added: Vec<f32>,
    hidden: Vec<f32>,
}

impl LevelSpace {
    pub(super) fn new(level: &Level, components: usize) -> Self {
        let side = level.layout.side;
        let channels = GROUP * components;
        let (map, added) = match (flat(level), &level.correction) {
            (Some(flat), _) => ((channels + GROUP) * flat.channel_len(), flat.added_len()),
            (None, Some(_)) => (0, side + MARGIN),
            (None, None) => (0, 0),
        };
        Self {
            upsampling: Upsampling::new(components, side),
            row: vec![0.0; (channels + GROUP) * (side + MARGIN)],
            map: vec![0.0; map],
            added: vec![0.0; channels * added],
            hidden: level.correction.as_ref().map_or(vec![], Correction::space),
        }
    }
}

impl Level {
    fn wide(&self) -> usize {
        self.layout.side + MARGIN
    }

    #[inline(always)]
    pub(super) fn evaluate<S: Simd>(
        &self,
        simd: S,
        blocks: &Blocks,
        above: &Above,
        space: &mut LevelSpace,
        target: &mut Target<'_>,
    ) {
        let flat = flat(self);
        space.upsampling.begin(simd, above, Some(&self.mix));
        for row in 0..self.layout.side {
            space.upsampling.advance(simd, above, Some(&self.mix), row);
            let columns = if self.correction.is_none() { target.columns(row) } else { None };
            let columns = columns.unwrap_or(0..self.layout.side);
            let near = blocks.near(row) & bits(&columns);
            if near == 0 && self.correction.is_none() && target.takes_phases() {
                target.take_phases(simd, row, &columns, &space.upsampling);
                continue;
            }
            space.upsampling.write(simd, row, &columns, &mut space.row);
            self.add_near(simd, row, near, blocks, &mut space.row);
            match (&self.correction, flat) {
                (None, _) => target.take_row(simd, row, &space.row),
                (Some(_), Some(flat)) => self.keep(row, flat, blocks, space),
                (Some(correction), None) => {
                    self.correct_row(simd, row, correction, blocks, space);
                    target.take_row(simd, row, &space.row);
                }
            }
        }
        if let (Some(correction), Some(flat)) = (&self.correction, flat) {
            let LevelSpace { map, added, hidden, .. } = space;
            correction.add(simd, 0, map, hidden, (added, flat.added_len()));
            for row in 0..self.layout.side {
                self.sum_up(row, flat, space);
                target.take_row(simd, row, &space.row);
            }
        }
    }

    /// Adds what pressures around give, at the blocks that are near to one: elsewhere it is zero.
    #[inline(always)]
    fn add_near<S: Simd>(
        &self,
        simd: S,
        row: usize,
        mut near: u128,
        blocks: &Blocks,
        components: &mut [f32],
    ) {
        while near != 0 {
            let at = near.trailing_zeros() as usize;
            let run = (near >> at).trailing_ones() as usize;
            let vectors = run.div_ceil(S::F32_LANES).min(VECTORS);
            match vectors {
                1 => self.add_near_at::<S, 1>(simd, row, at, blocks, components),
                2 => self.add_near_at::<S, 2>(simd, row, at, blocks, components),
                _ => self.add_near_at::<S, VECTORS>(simd, row, at, blocks, components),
            }
            // Vectors that reach over the run's end have added what is due there too.
            near &= u128::MAX.checked_shl((at + vectors * S::F32_LANES) as u32).unwrap_or(0);
        }
    }

    #[inline(always)]
    fn add_near_at<S: Simd, const V: usize>(
        &self,
        simd: S,
        row: usize,
        at: usize,
        blocks: &Blocks,
        components: &mut [f32],
    ) {
        // The corner of the kernel: as far before the block as there are zeros around.
        let corner = &blocks.planes[row * self.layout.stride() + at..];
        let wide = self.wide();
        for component in 0..self.near.groups() {
            let sums = self.near.of_group::<S, V>(simd, component, corner);
            for (pixel, sums) in sums.iter().enumerate() {
                let channel = GROUP * component + pixel;
                let gain = self.gain.at::<S, V>(simd, channel, row, at);
                let place = channel * wide + at;
                let values = &mut components[place..place + V * S::F32_LANES];
                let (values, _) = S::as_mut_simd_f32s(values);
                for ((value, sum), gain) in values.iter_mut().zip(sums).zip(gain) {
                    *value = simd.mul_add_e_f32s(*sum, gain, *value);
                }
            }
        }
    }

    /// Adds the correction to a row that has none but itself to look at.
    #[inline(always)]
    fn correct_row<S: Simd>(
        &self,
        simd: S,
        row: usize,
        correction: &Correction,
        blocks: &Blocks,
        space: &mut LevelSpace,
    ) {
        let (wide, side) = (self.wide(), self.layout.side);
        let LevelSpace { row: values, added, hidden, .. } = space;
        let channels = GROUP * self.near.groups();
        for plane in 0..GROUP {
            values[(channels + plane) * wide..][..side].copy_from_slice(blocks.row(plane, row));
        }
        correction.add(simd, row, values, hidden, (added, wide));
        let count = side.div_ceil(S::F32_LANES);
        for channel in 0..channels {
            let values = vectors_mut::<S>(&mut values[channel * wide..], count);
            let added = vectors::<S>(&added[channel * wide..], count);
            for k in 0..count {
                values[k] = simd.add_f32s(values[k], added[k]);
            }
        }
    }

    /// Keeps a row for the correction of all.
    fn keep(&self, row: usize, flat: Flat, blocks: &Blocks, space: &mut LevelSpace) {
        let (wide, side) = (self.wide(), self.layout.side);
        let channels = GROUP * self.near.groups();
        for channel in 0..channels {
            space.map[flat.row(channel, row)..][..side]
                .copy_from_slice(&space.row[channel * wide..][..side]);
        }
        for plane in 0..GROUP {
            space.map[flat.row(channels + plane, row)..][..side]
                .copy_from_slice(blocks.row(plane, row));
        }
    }

    /// A row that was kept, with what the correction adds.
    #[inline(always)]
    fn sum_up(&self, row: usize, flat: Flat, space: &mut LevelSpace) {
        let (wide, side) = (self.wide(), self.layout.side);
        let LevelSpace { row: values, map, added, .. } = space;
        for channel in 0..GROUP * self.near.groups() {
            let kept = &map[flat.row(channel, row)..][..side];
            let added = &added[flat.added_row(channel, row)..][..side];
            let values = values[channel * wide..][..side].iter_mut();
            for ((value, kept), added) in values.zip(kept).zip(added) {
                *value = kept + added;
            }
        }
    }
}

fn bits(columns: &Range<usize>) -> u128 {
    let below = |end: usize| 1_u128.checked_shl(end as u32).map_or(u128::MAX, |bit| bit - 1);
    below(columns.end) & !below(columns.start)
}

/// How a level's map lies where its correction looks at neighbours.
fn flat(level: &Level) -> Option<Flat> {
    let correction = level.correction.as_ref()?;
    (correction.kernel > 1).then(|| Flat::new(level.layout.side, correction.kernel))
}
