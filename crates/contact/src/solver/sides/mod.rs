//! From which side each object came, and which objects are held there.
//!
//! An object presses as it lies while its nearest surface faces the skin and no vertex lies deeper
//! than the model is trusted. Its *way out* is then the mean of the normals of the skin under it,
//! weighted by depth. If the skin is found behind an object, or deeper than that, the object is
//! [held](crate::held): it keeps its way out, and its force is continued from that at the trusted
//! depth. An object that is inside the finger in its first frame gets the shortest way out, and the
//! answer says so. Objects that touch are [one body](joined), as the parts of a union are: their ways
//! are one, and all of them are held or none.

mod anew;
mod body;
mod depth;
mod fading;
mod joined;
mod look;

use super::candidates::Seen;
use crate::answer::Effort;
use crate::held::Held;
use crate::model::ContactModel;
use crate::object::Object;
use crate::objects::{Things, View};
pub use fading::Hardest;
use joined::Joined;
use look::Asked;
use papilla_vector::{dot, norm};

/// Depth that is trusted if a model does not say, reference mm.
const TRUSTED_MM: f64 = 2.0;
/// How exactly depth is known, mm.
const EXACT_MM: f64 = 5e-3;
/// How force goes on beyond the trusted depth, as a power of depth there.
const POWER: f64 = 2.0;
/// Objects that memory is taken for at the start.
const OBJECTS: usize = 16;

/// What is known of an object's way.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Side {
    /// Unit vector, the way out of the finger, if any is known.
    pub way: Option<[f64; 3]>,
    /// Where the object was, reference mm.
    pub origin_mm: Option<[f64; 3]>,
    /// The vertex that was deepest in it, or nearest to it.
    pub witness: Option<u32>,
    /// Whether it is held.
    pub is_held: bool,
    /// Whether its way is a guess.
    pub is_guess: bool,
    /// Where it pressed hardest on a straight way in.
    pub hardest: Option<Hardest>,
}

/// What vertices at rest say of one object or body.
#[derive(Clone, Copy, Debug, Default)]
struct Survey {
    /// Depth, reference mm, and vertex.
    deepest: Option<(f64, u32)>,
    /// The skin's normals by depth.
    sum: [f64; 3],
    /// Free distance and vertex, if none lies in it.
    nearest: Option<(f64, u32)>,
    /// Whether another object may cover it at a vertex.
    is_covered: bool,
}

/// What a frame of objects is judged by.
#[derive(Clone, Copy)]
struct Frame<'a> {
    model: &'a ContactModel,
    view: View<'a>,
    objects: &'a [Object],
    seen: Seen<'a>,
}

/// Ways of all objects, from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct Sides {
    /// After the last frame, and in the frame that is tried.
    kept: Vec<Side>,
    now: Vec<Side>,
    held: Vec<Held>,
    surveys: Vec<Survey>,
    joined: Joined,
    /// How far the things that gaps tell of are drawn back, reference mm.
    back_mm: f64,
    /// What the force of the trusted depth is multiplied by.
    strength: f64,
    /// Whether a body is held deep, or on a side that is not certain.
    is_beyond: bool,
    any_held: bool,
    /// Direction of a net force.
    pub(crate) toward: Option<[f64; 3]>,
    /// Whether pixels see what lies between vertices.
    pub(crate) fine: bool,
    /// Whether skin is looked at where it rests alone.
    at_rest: bool,
}

impl Sides {
    pub(super) fn new(at_rest: bool) -> Self {
        let strength = 1.0;
        let room = || Vec::with_capacity(OBJECTS);
        let (kept, now) = (room(), room());
        let (held, surveys) = (Vec::with_capacity(OBJECTS), Vec::with_capacity(OBJECTS));
        let joined = Joined::new();
        Self { kept, now, held, surveys, joined, strength, at_rest, ..Self::default() }
    }

    pub(super) fn forget(&mut self) {
        self.kept.clear();
        self.now.clear();
        self.clear_frame();
    }

    /// The frame that was tried has come to pass.
    pub(super) fn keep(&mut self) {
        self.kept.clone_from(&self.now);
    }

    pub(super) fn kept(&self) -> &[Side] {
        &self.kept
    }

    /// Takes ways; false: one of them is none.
    pub(super) fn recall(&mut self, sides: &[Side]) -> bool {
        let is_unit = |w: [f64; 3]| (dot(w, w) - 1.0).abs() < 1e-6;
        let fits = |side: &Side| {
            side.way.is_none_or(is_unit)
                && (side.way.is_some() || !side.is_held)
                && side.origin_mm.is_none_or(|o| o.iter().all(|v| v.is_finite()))
                && side.hardest.is_none_or(|hardest| hardest.is_finite())
        };
        self.kept.clear();
        self.kept.extend_from_slice(sides);
        sides.iter().all(fits)
    }

    pub(super) fn any_held(&self) -> bool {
        self.any_held
    }

    pub(super) fn is_beyond(&self) -> bool {
        self.is_beyond
    }

    /// What the force of the trusted depth is multiplied by, and its slope over that force,
    /// 1 / (reference mm), beyond it.
    pub(super) fn strength(&self, model: &ContactModel) -> Option<(f64, f64)> {
        (self.strength > 1.0).then(|| (self.strength, POWER / trusted_mm(model)))
    }

    /// The view with what is held where it is held.
    pub(super) fn view<'a>(&'a self, view: View<'a>) -> View<'a> {
        View { held: &self.held, back_mm: self.back_mm, ..view }
    }

    fn clear_frame(&mut self) {
        self.held.clear();
        (self.back_mm, self.strength) = (0.0, 1.0);
        (self.is_beyond, self.any_held) = (false, false);
    }

    /// Judges a frame by the vertices `seen` in it.
    pub(super) fn judge(
        &mut self,
        model: &ContactModel,
        view: View<'_>,
        seen: Seen<'_>,
        effort: &mut Effort,
    ) {
        self.clear_frame();
        let Things::Objects(objects) = view.things else {
            let deepest = seen.candidates.iter().map(|(free, _)| -free).fold(0.0, f64::max);
            self.go_beyond(model, deepest);
            self.back_mm = (deepest - trusted_mm(model)).max(0.0);
            self.any_held = self.back_mm > 0.0;
            return;
        };
        let frame = Frame { model, view, objects, seen };
        self.survey(frame, effort);
        self.joined.begin(objects.len());
        let Self { joined, surveys, kept, .. } = self;
        let of_kept = |i: usize| kept.get(i).copied().unwrap_or_default();
        joined.spread(frame, |i| surveys[i].is_covered || of_kept(i).is_held, of_kept, effort);
        self.judge_bodies(frame, effort);
        // What is held by itself only now may be a part of something wider.
        let Self { joined, now, .. } = self;
        let is_strange = |i: usize| now[i].is_held || now[i].is_guess;
        if joined.spread(frame, is_strange, |i| now[i], effort) {
            self.clear_frame();
            self.judge_bodies(frame, effort);
        }
        let is_held_at_odds = |(i, side): (usize, &Side)| side.is_held && self.joined.is_at_odds(i);
        self.is_beyond |= self.now.iter().enumerate().any(is_held_at_odds);
        if !self.any_held {
            self.held.clear();
        }
    }

    /// Judges each body, an object or some that touch.
    fn judge_bodies(&mut self, frame: Frame<'_>, effort: &mut Effort) {
        let Frame { model, view, objects, seen } = frame;
        let Self { toward, fine, at_rest, .. } = *self;
        let place = |object: &Object| {
            let origin = object.placement.origin_mm;
            std::array::from_fn(|i| origin[i] / view.length + view.shift_mm[i])
        };
        let unknown = |object| Side { origin_mm: Some(place(object)), ..Side::default() };
        self.now.clear();
        self.now.extend(objects.iter().map(unknown));
        self.held.clear();
        self.held.resize(objects.len(), Held::default());
        let mut joined = std::mem::take(&mut self.joined);
        for first in 0..objects.len() {
            if !joined.is_first(first) {
                continue;
            }
            let (survey, lead) = self.survey_of(&joined, first, seen);
            let body = joined.body(first, objects);
            let is_all = body.len() == objects.len();
            let candidates = if is_all { seen.candidates } else { &[] };
            let past = self.kept.get(lead).copied().unwrap_or_default();
            let place = place(&objects[lead]);
            let asked = Asked { model, view, body, past, place, toward, fine, at_rest, candidates };
            let (side, held) = asked.judge(survey, seen.is_far, effort);
            self.is_beyond |= side.is_guess;
            if let Some((held, depth_mm)) = held {
                self.any_held = true;
                self.is_beyond |= held.widen_mm > 0.0;
                self.go_beyond(model, depth_mm);
            }
            for i in joined.members(first) {
                self.now[i] = Side { origin_mm: self.now[i].origin_mm, ..side };
                self.held[i] = held.map(|(held, _)| held).unwrap_or_default();
            }
        }
        joined.let_go();
        self.joined = joined;
    }

    fn go_beyond(&mut self, model: &ContactModel, depth_mm: f64) {
        let trusted = trusted_mm(model);
        if depth_mm > trusted + EXACT_MM {
            let strength = 1.0 + POWER * (depth_mm - trusted) / trusted;
            self.strength = self.strength.max(strength);
            self.is_beyond = true;
        }
    }

    /// What the vertices near things say of each object.
    fn survey(&mut self, frame: Frame<'_>, effort: &mut Effort) {
        let Frame { model, view, objects, seen } = frame;
        self.surveys.clear();
        self.surveys.resize(objects.len(), Survey::default());
        for (free, vertex) in seen.candidates.iter().filter(|(free, _)| *free < 0.0) {
            let (mut of, mut is_covered) = ((0, -free), false);
            if objects.len() > 1 {
                let nearest = view.nearest(model, *vertex as usize, [0.0; 3]);
                view.count(1, effort);
                view.count_more(nearest.asked, effort);
                of = (nearest.object as usize, -nearest.gap_mm);
                is_covered = nearest.asked > 0;
            }
            let survey = &mut self.surveys[of.0];
            survey.is_covered |= is_covered;
            if survey.deepest.is_none_or(|(depth, _)| of.1 > depth) {
                survey.deepest = Some((of.1, *vertex));
            }
            let normal = model.normals[*vertex as usize];
            (0..3).for_each(|i| survey.sum[i] += of.1 * f64::from(normal[i]));
        }
    }

    /// The same of a body, and the one of its objects whose past counts: what is held, or else the
    /// deepest.
    fn survey_of(&self, joined: &Joined, first: usize, seen: Seen<'_>) -> (Survey, usize) {
        let (mut of, mut lead, mut count) = (self.surveys[first], first, 1);
        for i in joined.members(first).filter(|i| *i != first) {
            let other = self.surveys[i];
            let depth =
                |survey: Survey| survey.deepest.map_or(f64::NEG_INFINITY, |(depth, _)| depth);
            if depth(other) > depth(of) {
                (of.deepest, lead) = (other.deepest, i);
            }
            (0..3).for_each(|k| of.sum[k] += other.sum[k]);
            count += 1;
        }
        if count == self.surveys.len() {
            let nearer = |a: &&(f64, u32), b: &&(f64, u32)| a.0.total_cmp(&b.0);
            of.nearest = seen.candidates.iter().min_by(nearer).copied();
        }
        let is_held = |i: &usize| self.kept.get(*i).is_some_and(|side| side.is_held);
        (of, joined.members(first).find(is_held).unwrap_or(lead))
    }
}

/// Depth up to which a model is trusted, reference mm.
fn trusted_mm(model: &ContactModel) -> f64 {
    let told = f64::from(model.header().depth_max_mm);
    if told > 0.0 { told } else { TRUSTED_MM }
}

fn unit(v: [f64; 3]) -> Option<[f64; 3]> {
    let size = norm(v);
    (size > 1e-9).then(|| v.map(|x| x / size))
}
