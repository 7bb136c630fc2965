//! What finite strain adds to the components of a level.

use super::around::{Around, Space};
use super::gain::Gain;
use super::gated::{PAIRS, gated, padded, product};
use super::parts::CorrectionParts;
use super::sums::{GROUP, MARGIN, Sums, VECTORS, in_vectors, vectors_mut};
use pulp::{Simd, WithSimd};

/// Positions of which hidden values are kept at a time.
const CHUNK: usize = VECTORS * MARGIN;
/// The correction `out (value * clamp(gate) * gain)`. Value and gate are convolutions of the
/// components and pressures of a level.
#[derive(Debug)]
pub(super) enum Correction {
    /// Kernels of one block.
    Alone(Alone),
    /// Kernels of 3 x 3 blocks.
    Around(Around),
}

/// The working memory of a correction.
#[derive(Debug)]
pub(super) enum CorrectionSpace {
    Alone(Vec<f32>),
    Around(Space),
}

impl Correction {
    /// The kernel is one block wide or, since the search in the graph accepts no others, three.
    pub(super) fn new(parts: &CorrectionParts, side: usize) -> Self {
        match parts.kernel {
            1 => Self::Alone(Alone::new(parts, side)),
            _ => Self::Around(Around::new(parts, side)),
        }
    }

    pub(super) fn space(&self) -> CorrectionSpace {
        match self {
            Self::Alone(alone) => CorrectionSpace::Alone(alone.space()),
            Self::Around(around) => CorrectionSpace::Around(around.space()),
        }
    }
}

/// A correction by the block's own components and pressures.
#[derive(Debug)]
pub(super) struct Alone {
    side: usize,
    /// The sums of values and gates: two values, two gates, two values and so on.
    gated: Sums,
    gain: Gain,
    out: Sums,
}

impl Alone {
    fn new(parts: &CorrectionParts, side: usize) -> Self {
        let CorrectionParts { hidden, inputs, out, over_finger, place, .. } = parts;
        let (hidden, wide) = (*hidden, side + MARGIN);
        let taps: Vec<_> = (0..*inputs).map(|input| input * wide).collect();
        let gated = Sums::new(&taps, 2 * padded(hidden), |channel, tap| gated(parts, channel, tap));
        let taps: Vec<_> = (0..hidden).map(|channel| channel * CHUNK).collect();
        let out = Sums::new(&taps, out.len() / hidden, |channel, tap| out[channel * hidden + tap]);
        Self { side, gated, gain: Gain::of_rows(over_finger, place, side), out }
    }

    fn space(&self) -> Vec<f32> {
        vec![0.0; self.gated.groups() * PAIRS * CHUNK]
    }
}

/// Adds the correction to a row of components, behind which the pressures lie.
pub(super) struct AddAlone<'a> {
    pub alone: &'a Alone,
    pub row: usize,
    pub values: &'a mut [f32],
    pub space: &'a mut [f32],
}

impl WithSimd for AddAlone<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        in_vectors!(S, 0, self.alone.side, at, V => self.at::<S, V>(simd, at));
    }
}

impl AddAlone<'_> {
    #[inline(always)]
    fn at<S: Simd, const V: usize>(&mut self, simd: S, at: usize) {
        let Self { alone, row, values, space } = self;
        let wide = alone.side + MARGIN;
        for group in 0..alone.gated.groups() {
            let sums = alone.gated.of_group::<S, V>(simd, group, &values[at..]);
            for pair in 0..PAIRS {
                let hidden = vectors_mut::<S>(&mut space[(group * PAIRS + pair) * CHUNK..], V);
                for v in 0..V {
                    hidden[v] = product(simd, sums[pair][v], sums[PAIRS + pair][v]);
                }
            }
        }
        for group in 0..alone.gain.groups() {
            let gains = alone.gain.of_group::<S, V>(simd, group, *row, at);
            for channel in 0..GROUP {
                let hidden = vectors_mut::<S>(&mut space[(group * GROUP + channel) * CHUNK..], V);
                for v in 0..V {
                    hidden[v] = simd.mul_f32s(hidden[v], gains[channel][v]);
                }
            }
        }
        for group in 0..alone.out.groups() {
            let sums = alone.out.of_group::<S, V>(simd, group, space);
            for channel in 0..GROUP {
                let place = (group * GROUP + channel) * wide + at;
                let values = vectors_mut::<S>(&mut values[place..], V);
                for v in 0..V {
                    values[v] = simd.add_f32s(values[v], sums[channel][v]);
                }
            }
        }
    }
}
