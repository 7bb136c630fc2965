//! Products of the correction: one convolution computes both factors, the value and its gate. The
//! gate is limited to between -1 and 1, and their product is a hidden channel.

use super::parts::CorrectionParts;
use super::sums::GROUP;
use pulp::Simd;

/// Hidden channels in a group of sums, which holds one value and one gate for each.
pub(super) const PAIRS: usize = GROUP / 2;

/// The number of hidden channels, rounded up to whole groups.
pub(super) fn padded(hidden: usize) -> usize {
    hidden.next_multiple_of(GROUP)
}

/// A weight of the value's or the gate's convolution. `channel` counts the sums, which are two
/// values, two gates, two values and so on; `tap` counts the taps of all inputs. 0 beyond the last
/// hidden channel.
pub(super) fn gated(parts: &CorrectionParts, channel: usize, tap: usize) -> f32 {
    let (of, pair) = (channel / GROUP * PAIRS + channel % PAIRS, channel % GROUP / PAIRS);
    let weights = if pair == 0 { &parts.value } else { &parts.gate };
    let taps = parts.inputs * parts.kernel * parts.kernel;
    if of < parts.hidden { weights[of * taps + tap] } else { 0.0 }
}

/// A value times its gate, which is limited to between -1 and 1.
#[inline(always)]
pub(super) fn product<S: Simd>(simd: S, value: S::f32s, gate: S::f32s) -> S::f32s {
    let (least, most) = (simd.splat_f32s(-1.0), simd.splat_f32s(1.0));
    simd.mul_f32s(value, simd.max_f32s(least, simd.min_f32s(most, gate)))
}
