//! One level of a network on maps: what is linear in the pressures around a block, plus what comes
//! from the level above, plus the correction.

use super::correction::{AddAlone, Correction, CorrectionSpace};
use super::near::{AddNear, Near};
use super::pixels::Target;
use super::pressures::{Blocks, Layout};
use super::sums::{GROUP, MARGIN, Sums};
use super::upsampling::{Above, Upsampling};
use pulp::Simd;
use std::ops::Range;

#[derive(Debug)]
pub(super) struct Level {
    pub layout: Layout,
    pub components: usize,
    pub near: Near,
    pub mix: Sums,
    pub correction: Option<Correction>,
}

/// The working memory of a level.
#[derive(Debug)]
pub(super) struct LevelSpace {
    upsampling: Upsampling,
    /// A row of components and pressures, `[4 C + 4, n + MARGIN]`.
    row: Vec<f32>,
    near: Vec<f32>,
    correction: Option<CorrectionSpace>,
}

impl LevelSpace {
    pub(super) fn new(level: &Level) -> Self {
        let (side, components) = (level.layout.side, level.components);
        let channels = GROUP * components;
        Self {
            upsampling: Upsampling::new(components, side),
            row: vec![0.0; (channels + GROUP) * (side + MARGIN)],
            near: level.near.space(),
            correction: level.correction.as_ref().map(Correction::space),
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
        space.upsampling.begin(simd, above, &self.mix);
        for row in 0..self.layout.side {
            space.upsampling.advance(simd, above, &self.mix, row);
            let columns = if self.correction.is_none() { target.columns(row) } else { None };
            let columns = columns.unwrap_or(0..self.layout.side);
            let bits = blocks.near(row) & bits(&columns);
            if bits == 0 && self.correction.is_none() && target.takes_phases() {
                target.take_phases(simd, row, &columns, &space.upsampling);
                continue;
            }
            space.upsampling.write(simd, row, &columns, &mut space.row);
            if bits != 0 {
                let LevelSpace { row: to, near: space, .. } = &mut *space;
                simd.vectorize(AddNear { near: &self.near, blocks, row, bits, to, space });
            }
            let LevelSpace { row: values, correction, .. } = &mut *space;
            if let (Some(Correction::Around(around)), Some(CorrectionSpace::Around(space))) =
                (&self.correction, &mut *correction)
            {
                self.pressures(row, blocks, values);
                for (channel, values) in values.chunks_exact(self.wide()).enumerate() {
                    around.keep(row, channel, &values[..self.layout.side], space);
                }
                continue;
            }
            if let (Some(Correction::Alone(alone)), Some(CorrectionSpace::Alone(space))) =
                (&self.correction, &mut *correction)
            {
                self.pressures(row, blocks, values);
                simd.vectorize(AddAlone { alone, row, values, space });
            }
            target.take_row(simd, row, values);
        }
        let LevelSpace { row: values, correction, .. } = space;
        if let (Some(Correction::Around(around)), Some(CorrectionSpace::Around(space))) =
            (&self.correction, correction)
        {
            around.add(simd, space);
            let (wide, channels) = (self.wide(), GROUP * self.components);
            for row in 0..self.layout.side {
                for (channel, values) in values.chunks_exact_mut(wide).take(channels).enumerate() {
                    around.sum_up(row, channel, &mut values[..self.layout.side], space);
                }
                target.take_row(simd, row, values);
            }
        }
    }

    /// Writes the pressures of a row of blocks behind its components.
    fn pressures(&self, row: usize, blocks: &Blocks, values: &mut [f32]) {
        let (wide, side) = (self.wide(), self.layout.side);
        let channels = GROUP * self.components;
        for plane in 0..GROUP {
            values[(channels + plane) * wide..][..side].copy_from_slice(blocks.row(plane, row));
        }
    }
}

fn bits(columns: &Range<usize>) -> u128 {
    let below = |end: usize| 1_u128.checked_shl(end as u32).map_or(u128::MAX, |bit| bit - 1);
    below(columns.end) & !below(columns.start)
}
