//! A network on maps, laid out for the evaluation, and the working memory of one thread.

use super::correction::Correction;
use super::level::{Level, LevelSpace};
use super::near::Near;
use super::parts::{LevelParts, Parts};
use super::pixels::{Pixels, Target};
use super::pressures::{Layout, Pressures};
use super::reach::Reach;
use super::sums::{GROUP, MARGIN};
use super::upsampling::{Above, mix};
use pulp::{Arch, Simd, WithSimd};

#[derive(Debug)]
pub(super) struct Net {
    unit: f32,
    components: usize,
    /// The finest first.
    levels: Vec<Level>,
    reach: Reach,
    pixels: Pixels,
}

impl Net {
    pub(super) fn new(parts: &Parts) -> Self {
        let components = parts.components;
        let levels: Vec<_> =
            parts.levels.iter().map(|level| self::level(level, components)).collect();
        let coarsest = parts.levels[parts.levels.len() - 1].side;
        let reach = Reach::new(parts.rank, &parts.reach_in, &parts.reach_out, coarsest);
        let pixels = Pixels::new(parts.mask.clone());
        Self { unit: parts.unit, components, levels, reach, pixels }
    }
}

fn level(parts: &LevelParts, components: usize) -> Level {
    let LevelParts { side, kernel, mix: matrix, correction, .. } = parts;
    let (side, kernel) = (*side, *kernel);
    let layout = Layout { side, around: kernel / 2 };
    Level {
        layout,
        components,
        near: Near::new(parts, layout),
        mix: mix(components, side, |to, from| matrix[to * components + from]),
        correction: correction.as_ref().map(|parts| Correction::new(parts, side)),
    }
}

/// The working memory of one thread.
#[derive(Debug)]
pub(super) struct Workspace {
    pressures: Pressures,
    /// The input of each level from the coarser one, the finest level first.
    above: Vec<Above>,
    levels: Vec<LevelSpace>,
    reach: Vec<f32>,
    /// Densities of a row of blocks, `[4, n + MARGIN]`.
    densities: Vec<f32>,
}

impl Workspace {
    pub(super) fn new(net: &Net) -> Self {
        let layouts: Vec<_> = net.levels.iter().map(|level| level.layout).collect();
        let side = 2 * layouts[0].side;
        Self {
            pressures: Pressures::new(net.unit, &layouts),
            above: layouts.iter().map(|layout| Above::new(net.components, layout.side)).collect(),
            levels: net.levels.iter().map(LevelSpace::new).collect(),
            reach: net.reach.space(),
            densities: vec![0.0; GROUP * (side + MARGIN)],
        }
    }
}

/// One evaluation.
pub(super) struct Work<'a> {
    pub net: &'a Net,
    pub space: &'a mut Workspace,
    pub pressure_pa: &'a [f32],
    pub sed_j_per_m3: &'a mut [f32],
    /// Whether the result is added to `sed_j_per_m3` instead of replacing it.
    pub adds: bool,
}

impl Work<'_> {
    /// Runs with the widest vectors that this processor has.
    pub(super) fn run(self) {
        Arch::new().dispatch(self);
    }
}

impl WithSimd for Work<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { net, space, pressure_pa, sed_j_per_m3, adds } = self;
        let Workspace { pressures, above, levels, reach, densities } = space;
        if !pressures.take(pressure_pa) {
            // The network has no bias, so without pressure its answer is zero.
            if !adds {
                sed_j_per_m3.fill(0.0);
            }
            return;
        }
        let last = net.levels.len() - 1;
        net.reach.write(simd, pressures.coarsest(), reach, &mut above[last]);
        for index in (0..=last).rev() {
            let (finer, its) = above.split_at_mut(index);
            let mut target = match finer.last_mut() {
                Some(next) => Target::Next(next),
                None => Target::Pixels {
                    row: &mut densities[..],
                    pixels: &net.pixels,
                    map: &mut sed_j_per_m3[..],
                    adds,
                },
            };
            let level = &net.levels[index];
            level.evaluate(
                simd,
                &pressures.levels[index],
                &its[0],
                &mut levels[index],
                &mut target,
            );
        }
    }
}
