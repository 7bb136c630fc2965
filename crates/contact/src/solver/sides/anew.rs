//! Bodies that are in the finger at once: nothing, or little, tells from which side they came.

use super::look::{Asked, PASSED, Sweep, THROUGH};
use super::trusted_mm;
use crate::answer::Effort;
use crate::held::Front;
use papilla_vector::dot;

/// So many times as deep as is trusted, a body may have come from the side that is guessed.
const FIRST: f64 = 3.0;
/// Least motion that tells from where a body came, reference mm.
pub(super) const MOTION_MM: f64 = 1.0;

/// What vertices behind a body say of its side.
pub(super) enum Anew {
    /// None lies behind it: its nearest surface presses.
    Plain,
    /// Some do. It is to be held on this way out, which is a guess.
    Passed([f64; 3], Sweep),
    /// Some do, but so far that it may as well have come from elsewhere.
    Unsure,
}

impl Asked<'_> {
    /// Judges a body of which nothing is known, or that has jumped, by the vertices that lie behind it:
    /// the deepest one may still be nearer to its front while others are nearer to its back.
    pub(super) fn meet_anew(&self, way: [f64; 3], effort: &mut Effort) -> Anew {
        let is_known = self.past.witness.is_some() || self.past.way.is_some();
        let is_behind_pad = !is_known && self.pad_is_behind(effort);
        if is_behind_pad {
            let pad = self.normal(self.model.lowest);
            let sweep = self.sweep(pad, 0.0, effort);
            if sweep.any_met && sweep.depth_mm <= FIRST * trusted_mm(self.model) {
                return Anew::Passed(pad, sweep);
            }
        }
        if (!is_known || self.has_jumped()) && self.may_have_passed(way, effort) {
            let sweep = self.sweep(way, 0.0, effort);
            if sweep.any_met && sweep.any_passed {
                let is_near = sweep.depth_mm <= FIRST * trusted_mm(self.model);
                return if is_near { Anew::Passed(way, sweep) } else { Anew::Unsure };
            }
        }
        if is_behind_pad { Anew::Unsure } else { Anew::Plain }
    }

    /// Whether a body has moved so far since the last frame that what was known of it tells little.
    fn has_jumped(&self) -> bool {
        self.past.origin_mm.is_none_or(|was| {
            let by: [f64; 3] = std::array::from_fn(|i| self.place[i] - was[i]);
            dot(by, by) > MOTION_MM * MOTION_MM
        })
    }

    /// Whether the pad lies behind a body.
    fn pad_is_behind(&self, effort: &mut Effort) -> bool {
        let pad = self.model.lowest;
        let (_, normal) = self.nearest(pad, effort);
        let skin = self.normal(pad);
        dot(normal, skin) > 0.5 && matches!(self.front(pad, skin, 0.0), Front::Met { .. })
    }

    /// Whether a vertex near the body is nearest to a surface of it that faces out of the finger. Of
    /// one of several bodies nobody knows before they are gone through.
    fn may_have_passed(&self, way: [f64; 3], effort: &mut Effort) -> bool {
        let is_behind = |vertex: u32, effort: &mut Effort| {
            dot(self.normal(vertex), way) >= THROUGH && {
                let (_, normal) = self.nearest(vertex, effort);
                dot(normal, way) > PASSED
            }
        };
        self.candidates.is_empty() || self.candidates.iter().any(|(_, v)| is_behind(*v, effort))
    }
}
