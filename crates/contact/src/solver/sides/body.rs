//! Whether a body is held, and on which side.

use super::anew::{Anew, MOTION_MM};
use super::depth::{BEHIND_MM, FACING};
use super::look::{Asked, PASSED, Sweep};
use super::{EXACT_MM, Side, Survey, trusted_mm, unit};
use crate::answer::Effort;
use crate::held::{Front, Held};
use papilla_vector::dot;

/// Farther from all of the finger than this no body lies in it, reference mm.
const NEARBY_MM: f64 = 0.8;
/// Nearer than this a body between vertices may cross the skin, reference mm.
const BETWEEN_MM: f64 = 0.7;
/// So many times as deep as is trusted, a body may as well have come from elsewhere.
const FAR_BEHIND: f64 = 2.0;
/// Of so many times the trusted depth in one frame it may have jumped to another side.
const JUMP: f64 = 3.0;
/// By how much a body narrower than the vertices are apart is too wide, mm.
const WIDER_MM: f64 = 0.05;

type Judged = (Side, Option<(Held, f64)>);

impl Asked<'_> {
    /// Where it is held, and how deep, if it is.
    pub(super) fn judge(&self, survey: Survey, is_far: bool, effort: &mut Effort) -> Judged {
        if let (true, Some(way)) = (self.past.is_held, self.past.way) {
            let sweep = self.sweep(way, 0.0, effort);
            let trusted = trusted_mm(self.model);
            let elsewhere =
                sweep.depth_mm > FAR_BEHIND * trusted && self.is_elsewhere(way, survey, effort);
            if sweep.any_met && !elsewhere {
                let is_deep = sweep.depth_mm > trusted + EXACT_MM;
                if sweep.any_passed || is_deep || self.is_narrow(survey, way, effort) {
                    return self.hold(way, sweep, 0.0, self.past.is_guess);
                }
                let witness = survey.deepest.map(|(_, vertex)| vertex);
                return (Side { way: Some(way), witness, ..Side::default() }, None);
            }
            if elsewhere {
                let past = Side { way: None, witness: None, ..self.past };
                return Asked { past, ..*self }.meet(survey, is_far, effort);
            }
        }
        self.meet(survey, is_far, effort)
    }

    /// Judges a body that is not held yet.
    fn meet(&self, survey: Survey, is_far: bool, effort: &mut Effort) -> Judged {
        let Some((depth_mm, vertex)) = survey.deepest else {
            return self.meet_outside(survey, is_far, effort);
        };
        let (gap_mm, normal) = self.nearest(vertex, effort);
        // Of bodies of several parts candidates know a lower bound of the depth.
        let depth_mm = depth_mm.max(-gap_mm);
        let skin = self.normal(vertex);
        let facing = dot(normal, skin);
        if facing > PASSED {
            return self.hold_somewhere(survey, vertex, effort);
        }
        if let Some(judged) = self.witness_passed(vertex, effort) {
            return judged;
        }
        let way = unit(survey.sum).unwrap_or(skin);
        let is_unsure = match self.meet_anew(way, effort) {
            Anew::Passed(way, sweep) => return self.hold(way, sweep, 0.0, true),
            Anew::Unsure => true,
            Anew::Plain => false,
        };
        let (deep, is_narrow) = self.depth(way, vertex, [depth_mm, facing], effort);
        if deep > trusted_mm(self.model) + EXACT_MM || is_narrow {
            let sweep = self.sweep(way, 0.0, effort);
            if sweep.any_met {
                return self.hold(way, sweep, 0.0, false);
            }
        }
        let side = Side { way: Some(way), witness: Some(vertex), ..Side::default() };
        (Side { is_guess: is_unsure, ..side }, None)
    }

    /// Judges a body in which no vertex lies.
    fn meet_outside(&self, survey: Survey, is_far: bool, effort: &mut Effort) -> Judged {
        if is_far {
            return (Side::default(), None);
        }
        let clear = |p: [f64; 3]| self.clear(p);
        let nearest = survey.nearest.or_else(|| {
            let (found, asked) =
                self.model.clusters.nearest(&self.model.positions_mm, NEARBY_MM, clear);
            self.alone().count(asked, effort);
            found
        });
        let Some((free, vertex)) = nearest else { return (Side::default(), None) };
        if free < 0.0 {
            // Another object's depth was greater everywhere.
            let skin = self.normal(vertex);
            let survey = Survey { deepest: Some((-free, vertex)), sum: skin, ..survey };
            return self.meet(survey, is_far, effort);
        }
        let skin = self.normal(vertex);
        if self.is_inside(vertex, effort) {
            return self.hold_somewhere(survey, vertex, effort);
        }
        if let Some(judged) = self.witness_passed(vertex, effort) {
            return judged;
        }
        let way = (!self.model.border[vertex as usize]).then_some(skin);
        (Side { way, witness: Some(vertex), ..Side::default() }, None)
    }

    /// Whether a body in which no vertex lies, of which `vertex` is the nearest, lies in the finger.
    fn is_inside(&self, vertex: u32, effort: &mut Effort) -> bool {
        let (gap, normal) = self.nearest(vertex, effort);
        let at = self.model.positions_mm[vertex as usize];
        let facing = dot(normal, self.normal(vertex));
        if facing > PASSED {
            let point = std::array::from_fn(|i| at[i] - gap * normal[i]);
            return self.model.is_between_ends(point);
        }
        // Pixels see what lies between vertices.
        let most = if self.fine { trusted_mm(self.model) } else { BEHIND_MM };
        let crosses = facing.abs() <= 0.5 && gap < BETWEEN_MM;
        crosses && !self.model.border[vertex as usize] && self.behind(vertex) > most
    }

    /// Holds a body that has passed the vertex of the last frame.
    fn witness_passed(&self, vertex: u32, effort: &mut Effort) -> Option<Judged> {
        let (witness, way) = (self.past.witness?, self.past.way?);
        if witness == vertex || witness as usize >= self.model.vertices() {
            return None;
        }
        let (_, normal) = self.nearest(witness, effort);
        if dot(normal, self.normal(witness)) <= 0.5 {
            return None;
        }
        self.alone().count_look(effort);
        let Front::Met { .. } = self.front(witness, way, 0.0) else { return None };
        let sweep = self.sweep(way, 0.0, effort);
        // As deep as its motion since the last frame tells, and not on its other side.
        let was = self.past.origin_mm.unwrap_or(self.place);
        let moved: f64 = (0..3).map(|i| way[i] * (was[i] - self.place[i])).sum();
        let is_near = sweep.depth_mm <= FAR_BEHIND * trusted_mm(self.model) + moved.max(0.0);
        is_near.then(|| self.hold(way, sweep, 0.0, false))
    }

    /// Whether a body that was held has left the finger on another side.
    fn is_elsewhere(&self, way: [f64; 3], survey: Survey, effort: &mut Effort) -> bool {
        let by: [f64; 3] =
            std::array::from_fn(|i| self.past.origin_mm.map_or(0.0, |was| self.place[i] - was[i]));
        let jumped = dot(by, by).sqrt() > JUMP * trusted_mm(self.model);
        if let (true, Some((_, vertex))) = (jumped, survey.deepest) {
            let (_, normal) = self.nearest(vertex, effort);
            return dot(normal, self.normal(vertex)) < FACING;
        }
        // All of it has gone on beyond the finger.
        -self.reach(way) > self.model.end_mm(way.map(|w| -w))
    }

    /// Holds a body that lies in the finger: on the way that it had, or the one that it moved
    /// along, or the shortest.
    fn hold_somewhere(&self, survey: Survey, vertex: u32, effort: &mut Effort) -> Judged {
        let motion = self.past.origin_mm.and_then(|was| {
            let by: [f64; 3] = std::array::from_fn(|i| was[i] - self.place[i]);
            unit(by).filter(|_| dot(by, by) > MOTION_MM * MOTION_MM)
        });
        let toward = self.toward.map(|d| d.map(|v| -v));
        for (way, is_guess) in [(self.past.way, self.past.is_guess), (motion, true), (toward, true)]
        {
            let Some(way) = way else { continue };
            let sweep = self.sweep(way, 0.0, effort);
            if sweep.any_met {
                return self.hold(way, sweep, 0.0, is_guess);
            }
        }
        let pad = self.normal(self.model.lowest);
        let skin = self.normal(vertex);
        let mut best: Option<([f64; 3], Sweep)> = None;
        for way in [Some(pad), Some(skin), unit(survey.sum)].into_iter().flatten() {
            let sweep = self.sweep(way, 0.0, effort);
            let is_better = best.is_none_or(|(_, b)| sweep.depth_mm < b.depth_mm);
            if sweep.any_met && is_better {
                best = Some((way, sweep));
            }
        }
        if let Some((way, sweep)) = best {
            return self.hold(way, sweep, 0.0, true);
        }
        // Narrower than the vertices are apart. Pixels see it; vertices see it as wide as it has to
        // be to meet one.
        let (way, is_guess) = match self.past.way {
            Some(way) => (way, self.past.is_guess),
            None => (motion.or(toward).unwrap_or(skin), true),
        };
        let mut sweep = self.sweep(way, 0.0, effort);
        if self.fine {
            sweep.depth_mm = self.behind(vertex).max(0.0);
            return self.hold(way, sweep, 0.0, is_guess);
        }
        let closest = sweep.closest_mm * self.view.length;
        let widen_mm = if closest.is_finite() { closest.max(0.0) + WIDER_MM } else { 0.0 };
        let sweep = self.sweep(way, widen_mm, effort);
        self.hold(way, sweep, widen_mm, is_guess)
    }

    fn hold(&self, way: [f64; 3], sweep: Sweep, widen_mm: f64, is_guess: bool) -> Judged {
        let beyond = (sweep.depth_mm - trusted_mm(self.model)).max(0.0);
        let back_mm = beyond / sweep.along * self.view.length;
        let held = Held { is_on: true, way, back_mm, widen_mm };
        let witness = self.past.witness;
        let side = Side { way: Some(way), witness, is_held: true, is_guess, ..Side::default() };
        (side, Some((held, sweep.depth_mm)))
    }
}
