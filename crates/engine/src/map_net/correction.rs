//! What finite strain adds to the components of a level.

use super::gain::Gain;
use super::parts::CorrectionParts;
use super::sums::{GROUP, MARGIN, Sums, VECTORS, in_vectors, store};
use pulp::Simd;

/// Positions of which hidden values are kept at a time.
const CHUNK: usize = VECTORS * MARGIN;
/// Hidden channels of a group of sums: as many values as gates.
const PAIRS: usize = GROUP / 2;

/// `out (value * clamp(gate) * gain)`, where value and gate are convolutions of the components and
/// pressures of a level.
#[derive(Debug)]
pub(super) struct Correction {
    /// Pixels across the convolutions.
    pub kernel: usize,
    /// Positions of a part of the map: of a row if the kernel is one pixel, else of all.
    positions: usize,
    hidden: usize,
    /// Two values, two gates, two values and so on.
    gated: Sums,
    gain: Gain,
    out: Sums,
}

/// How a map lies with zeros around, so that a convolution may go over it as one row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flat {
    side: usize,
    around: usize,
}

impl Flat {
    pub(super) fn new(side: usize, kernel: usize) -> Self {
        Self { side, around: kernel / 2 }
    }

    fn stride(self) -> usize {
        self.side + 2 * self.around
    }

    /// Values between the channels that are read.
    pub(super) fn channel_len(self) -> usize {
        self.stride() * self.stride() + 2 * self.around + MARGIN
    }

    /// Values between the channels that are added.
    pub(super) fn added_len(self) -> usize {
        self.side * self.stride() + MARGIN
    }

    /// Where a row of a channel that is read begins.
    pub(super) fn row(self, channel: usize, row: usize) -> usize {
        channel * self.channel_len() + (row + self.around) * self.stride() + self.around
    }

    /// Where a row of a channel that is added begins.
    pub(super) fn added_row(self, channel: usize, row: usize) -> usize {
        channel * self.added_len() + row * self.stride()
    }
}

impl Correction {
    pub(super) fn new(parts: &CorrectionParts, side: usize) -> Self {
        let CorrectionParts { hidden, inputs, kernel, value, gate, out, over_finger, place } =
            parts;
        let (hidden, inputs, kernel) = (*hidden, *inputs, *kernel);
        let flat = Flat::new(side, kernel);
        let (channel_len, stride) = if kernel == 1 {
            (side + MARGIN, side + MARGIN)
        } else {
            (flat.channel_len(), flat.stride())
        };
        let area = kernel * kernel;
        let taps = (0..inputs * area)
            .map(|tap| tap / area * channel_len + tap % area / kernel * stride + tap % kernel)
            .collect();
        let gated = Sums::new(taps, hidden.div_ceil(PAIRS) * GROUP, |channel, tap| {
            let (of, pair) = (channel / GROUP * PAIRS + channel % PAIRS, channel % GROUP / PAIRS);
            let weights = if pair == 0 { value } else { gate };
            if of < hidden { weights[of * inputs * area + tap] } else { 0.0 }
        });
        let gain = if kernel == 1 {
            Gain::of_rows(over_finger, place, side)
        } else {
            Gain::of_map(over_finger, place, side, stride)
        };
        let taps = (0..hidden).map(|channel| channel * CHUNK).collect();
        let out = Sums::new(taps, out.len() / hidden, |channel, tap| out[channel * hidden + tap]);
        let positions = if kernel == 1 { side } else { side * stride };
        Self { kernel, positions, hidden, gated, gain, out }
    }

    /// Values that [`Self::add`] works in.
    pub(super) fn space(&self) -> Vec<f32> {
        vec![0.0; self.hidden.next_multiple_of(PAIRS) * CHUNK]
    }

    /// Writes what is added at all positions of a part of the map. `inputs`: components and
    /// pressures; `added`: the channels lie `added_len` values apart.
    #[inline(always)]
    pub(super) fn add<S: Simd>(
        &self,
        simd: S,
        part: usize,
        inputs: &[f32],
        space: &mut [f32],
        (added, added_len): (&mut [f32], usize),
    ) {
        in_vectors!(S, 0, self.positions, at, V => {
            for group in 0..self.gated.groups() {
                self.hide::<S, V>(simd, group, part, at, inputs, space);
            }
            for group in 0..self.out.groups() {
                let sums = self.out.of_group::<S, V>(simd, group, space);
                for (channel, sums) in sums.iter().enumerate() {
                    store::<S>(sums, &mut added[(group * GROUP + channel) * added_len + at..]);
                }
            }
        });
    }

    #[inline(always)]
    fn hide<S: Simd, const V: usize>(
        &self,
        simd: S,
        group: usize,
        part: usize,
        at: usize,
        inputs: &[f32],
        space: &mut [f32],
    ) {
        let sums = self.gated.of_group::<S, V>(simd, group, &inputs[at..]);
        let (values, gates) = sums.split_at(PAIRS);
        let (least, most) = (simd.splat_f32s(-1.0), simd.splat_f32s(1.0));
        for (pair, (values, gates)) in values.iter().zip(gates).enumerate() {
            let channel = group * PAIRS + pair;
            if channel == self.hidden {
                break;
            }
            let mut hidden = self.gain.at::<S, V>(simd, channel, part, at);
            for ((hidden, value), gate) in hidden.iter_mut().zip(values).zip(gates) {
                let gate = simd.max_f32s(least, simd.min_f32s(most, *gate));
                *hidden = simd.mul_f32s(*hidden, simd.mul_f32s(*value, gate));
            }
            store::<S>(&hidden, &mut space[channel * CHUNK..]);
        }
    }
}
