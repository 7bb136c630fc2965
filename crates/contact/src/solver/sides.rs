//! From which side each object came, and which objects are held there.
//!
//! An object presses as it lies while its nearest surface faces the skin and no vertex lies deeper
//! than the model is trusted. Its *way out* is then the mean of the normals of the skin under it,
//! weighted by depth. If the skin is found behind an object, or deeper than that, the object is
//! [held](crate::held): it keeps its way out, and its force is continued from that at the trusted
//! depth. An object that is inside the finger in its first frame gets the shortest way out, and the
//! answer says so.

use super::candidates::Seen;
use crate::answer::Effort;
use crate::held::{Front, Held, dot};
use crate::model::ContactModel;
use crate::object::Object;
use crate::objects::{Things, View};

/// Depth that is trusted if a model does not say, reference mm.
const TRUSTED_MM: f64 = 2.0;
/// How exactly depth is known, mm.
const EXACT_MM: f64 = 5e-3;
/// How force goes on beyond the trusted depth, as a power of depth there.
const POWER: f64 = 2.0;
/// Objects that memory is taken for at the start.
const OBJECTS: usize = 16;
/// Cosine between the skin's and a body's outward normals above which the body has passed the skin.
const PASSED: f64 = 0.3;
/// The same below which the nearest surface tells the depth.
const FACING: f64 = -0.7;
/// Farther from all of the finger than this no body lies in it, reference mm.
const NEARBY_MM: f64 = 0.8;
/// Nearer than this a body between vertices may cross the skin, reference mm.
const BETWEEN_MM: f64 = 0.7;
/// How far it has to go on behind the skin.
const BEHIND_MM: f64 = 0.1;
/// So many times as deep as is trusted, a body may as well have come from elsewhere.
const FAR_BEHIND: f64 = 2.0;
/// So many times as deep as is trusted, a body in a first frame may lie behind the pad.
const FIRST: f64 = 3.0;
/// Of so many times the trusted depth in one frame it may have jumped to another side.
const JUMP: f64 = 3.0;
/// Cosine between the way in and a front's normal above which depth is taken along the normal.
const SLANT: f64 = 0.7;
/// Fall of the force on a straight way in that is flagged, as part of it and N, and what is straight.
const FADE: f64 = 0.05;
const FADE_N: f64 = 8e-3;
const ASIDE: f64 = 0.4;
/// Farther in one frame an object was not followed on its way in, mm.
const FOLLOWED_MM: f64 = 2.0;
/// How many times as deep on its way as its nearest surface tells a narrow body is.
const NARROW: f64 = 2.0;
/// Beyond what a ray has to lie before a vertex counts as passed, mm.
const BESIDE_MM: f64 = 0.02;
/// Least motion that tells from where a body came, reference mm.
const MOTION_MM: f64 = 1.0;
/// Cosine between the way out and the normals of the skin that a body can have come through.
const THROUGH: f64 = 0.1;
/// By how much a body narrower than the vertices are apart is too wide, mm.
const WIDER_MM: f64 = 0.05;

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
    /// Where it was when it pressed hardest on a straight way in, reference mm, and that force, N.
    pub hardest: Option<[f64; 4]>,
}

/// What vertices at rest say of one object.
#[derive(Clone, Copy, Debug, Default)]
struct Survey {
    /// Depth, reference mm, and vertex.
    deepest: Option<(f64, u32)>,
    /// The skin's normals by depth.
    sum: [f64; 3],
    /// Free distance and vertex, if none lies in it.
    nearest: Option<(f64, u32)>,
}

/// How deep the skin lies on an object's way.
#[derive(Clone, Copy, Debug)]
struct Sweep {
    depth_mm: f64,
    along: f64,
    any_met: bool,
    any_passed: bool,
    closest_mm: f64,
}

/// Ways of all objects, from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct Sides {
    /// After the last frame, and in the frame that is tried.
    kept: Vec<Side>,
    now: Vec<Side>,
    held: Vec<Held>,
    surveys: Vec<Survey>,
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
        Self { kept, now, held, surveys, strength, at_rest, ..Self::default() }
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
                && side.hardest.is_none_or(|h| h.iter().all(|v| v.is_finite()))
        };
        self.kept.clear();
        self.kept.extend_from_slice(sides);
        sides.iter().all(fits)
    }

    /// Whether the force `force_n` of the only object has fallen on a straight way in. One that has not
    /// settled tells nothing, neither now nor later.
    pub(super) fn has_faded(&mut self, force_n: [f64; 3], is_settled: bool) -> bool {
        let [side] = &mut self.now[..] else { return false };
        let last = self.kept.first().copied().unwrap_or_default();
        let is_followed = |place: [f64; 3]| {
            let by = |was: [f64; 3]| (0..3).map(|i| (place[i] - was[i]).powi(2)).sum::<f64>();
            last.origin_mm.is_some_and(|was| by(was) <= FOLLOWED_MM * FOLLOWED_MM)
        };
        let past = last.hardest.filter(|_| side.origin_mm.is_some_and(is_followed));
        if !is_settled {
            side.hardest = past;
            return false;
        }
        let (Some(way), Some(place)) = (side.way, side.origin_mm) else { return false };
        let force = -dot(force_n, way);
        let Some([x, y, z, hardest]) = past else {
            side.hardest = (force > 0.0).then_some([place[0], place[1], place[2], force]);
            return false;
        };
        let by: [f64; 3] = std::array::from_fn(|i| place[i] - [x, y, z][i]);
        let along = -dot(by, way);
        let aside = (dot(by, by) - along * along).max(0.0).sqrt();
        if along >= 0.0 && aside <= ASIDE * along && force < hardest * (1.0 - FADE) - FADE_N {
            side.hardest = past;
            return true;
        }
        side.hardest = (force > 0.0).then_some([place[0], place[1], place[2], force]);
        false
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
        self.now.clear();
        self.held.resize(objects.len(), Held::default());
        self.survey(model, view, objects, seen, effort);
        for (index, object) in objects.iter().enumerate() {
            let origin = object.placement.origin_mm;
            let place = std::array::from_fn(|i| origin[i] / view.length + view.shift_mm[i]);
            let past = self.kept.get(index).copied().unwrap_or_default();
            let Self { toward, fine, at_rest, .. } = *self;
            let candidates = if objects.len() == 1 { seen.candidates } else { &[] };
            let asked =
                Asked { model, view, object, past, place, toward, fine, at_rest, candidates };
            let (side, held) = asked.judge(self.surveys[index], seen.is_far, effort);
            self.is_beyond |= side.is_guess;
            if let Some((held, depth_mm)) = held {
                self.held[index] = held;
                self.any_held = true;
                self.is_beyond |= held.widen_mm > 0.0;
                self.go_beyond(model, depth_mm);
            }
            self.now.push(Side { origin_mm: Some(place), ..side });
        }
        if !self.any_held {
            self.held.clear();
        }
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
    fn survey(
        &mut self,
        model: &ContactModel,
        view: View<'_>,
        objects: &[Object],
        seen: Seen<'_>,
        effort: &mut Effort,
    ) {
        self.surveys.clear();
        self.surveys.resize(objects.len(), Survey::default());
        for (free, vertex) in seen.candidates.iter().filter(|(free, _)| *free < 0.0) {
            let mut of = (0, -free);
            if objects.len() > 1 {
                let nearest = view.nearest(model, *vertex as usize, [0.0; 3]);
                view.count(1, effort);
                view.count_more(nearest.asked, effort);
                of = (nearest.object as usize, -nearest.gap_mm);
            }
            let survey = &mut self.surveys[of.0];
            if survey.deepest.is_none_or(|(depth, _)| of.1 > depth) {
                survey.deepest = Some((of.1, *vertex));
            }
            let normal = model.normals[*vertex as usize];
            (0..3).for_each(|i| survey.sum[i] += of.1 * f64::from(normal[i]));
        }
        if let [survey] = &mut self.surveys[..] {
            let nearer = |a: &&(f64, u32), b: &&(f64, u32)| a.0.total_cmp(&b.0);
            survey.nearest = seen.candidates.iter().min_by(nearer).copied();
        }
    }
}

/// Depth up to which a model is trusted, reference mm.
fn trusted_mm(model: &ContactModel) -> f64 {
    let told = f64::from(model.header().depth_max_mm);
    if told > 0.0 { told } else { TRUSTED_MM }
}

fn unit(v: [f64; 3]) -> Option<[f64; 3]> {
    let size = dot(v, v).sqrt();
    (size > 1e-9).then(|| v.map(|x| x / size))
}

/// One object of a frame.
struct Asked<'a> {
    model: &'a ContactModel,
    view: View<'a>,
    object: &'a Object,
    past: Side,
    /// Its origin, reference mm.
    place: [f64; 3],
    toward: Option<[f64; 3]>,
    fine: bool,
    at_rest: bool,
    /// Of the only object; none of several.
    candidates: &'a [(f64, u32)],
}

type Judged = (Side, Option<(Held, f64)>);

impl Asked<'_> {
    fn judge(&self, survey: Survey, is_far: bool, effort: &mut Effort) -> Judged {
        if let (true, Some(way)) = (self.past.is_held, self.past.way) {
            let sweep = self.sweep(way, 0.0, effort);
            let trusted = trusted_mm(self.model);
            let elsewhere =
                sweep.depth_mm > FAR_BEHIND * trusted && self.is_elsewhere(way, survey, effort);
            if sweep.any_met && !elsewhere {
                if sweep.any_passed || sweep.depth_mm > trusted + EXACT_MM {
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

    /// Judges an object that is not held yet.
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
        let is_unsure = self.pad_is_behind(effort);
        if is_unsure {
            let pad = self.normal(self.model.lowest);
            let sweep = self.sweep(pad, 0.0, effort);
            if sweep.any_met && sweep.depth_mm <= FIRST * trusted_mm(self.model) {
                return self.hold(pad, sweep, 0.0, true);
            }
        }
        let way = unit(survey.sum).unwrap_or(skin);
        let (mut deep, mut is_narrow) = (depth_mm, false);
        for at in [vertex, self.outermost(vertex, way)] {
            self.alone().count_look(effort);
            if let Front::Met { ahead_mm, along, .. } = self.front(at, way, 0.0) {
                deep = deep.max(ahead_mm * along.max(SLANT));
                // Springs know no displaced skin, which would lie before the front.
                is_narrow |= self.at_rest && at == vertex && facing > FACING && along > SLANT;
            }
        }
        // Vertices in a narrow body are nearer to its sides than to its front; pixels see that.
        is_narrow |= !self.fine && deep > NARROW * depth_mm + BEHIND_MM;
        if deep > trusted_mm(self.model) + EXACT_MM || is_narrow {
            let sweep = self.sweep(way, 0.0, effort);
            if sweep.any_met {
                return self.hold(way, sweep, 0.0, false);
            }
        }
        let side = Side { way: Some(way), witness: Some(vertex), ..Side::default() };
        (Side { is_guess: is_unsure, ..side }, None)
    }

    /// Whether the pad lies behind an object of which nothing is known yet.
    fn pad_is_behind(&self, effort: &mut Effort) -> bool {
        if self.past.origin_mm.is_some() {
            return false;
        }
        let pad = self.model.lowest;
        let (_, normal) = self.nearest(pad, effort);
        let skin = self.normal(pad);
        dot(normal, skin) > 0.5 && matches!(self.front(pad, skin, 0.0), Front::Met { .. })
    }

    /// The vertex farthest out along the way, of those that lie in the only object.
    fn outermost(&self, vertex: u32, way: [f64; 3]) -> u32 {
        let out = |vertex: u32| dot(self.model.positions_mm[vertex as usize], way);
        let inside = self.candidates.iter().filter(|(free, _)| *free < 0.0);
        inside.fold(vertex, |most, (_, v)| if out(*v) > out(most) { *v } else { most })
    }

    /// Judges an object in which no vertex lies.
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

    /// How far a body goes on behind the skin at a vertex, reference mm.
    fn behind(&self, vertex: u32) -> f64 {
        let inward = self.normal(vertex).map(|n| -n);
        self.reach(inward) - dot(self.model.positions_mm[vertex as usize], inward)
    }

    /// How far a body goes along a direction, reference mm from the finger's origin.
    fn reach(&self, direction: [f64; 3]) -> f64 {
        let Object { placement, shape, .. } = self.object;
        let reach = placement.reach_mm(shape.as_ref(), direction) / self.view.length;
        reach + dot(self.view.shift_mm, direction)
    }

    /// Holds an object that has passed the vertex of the last frame.
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

    /// How deep the skin that faces a way out lies on it.
    fn sweep(&self, way: [f64; 3], widen_mm: f64, effort: &mut Effort) -> Sweep {
        let held = Held { is_on: true, way, back_mm: 0.0, widen_mm };
        let mut sweep = Sweep {
            depth_mm: 0.0,
            along: 1.0,
            any_met: false,
            any_passed: false,
            closest_mm: f64::INFINITY,
        };
        let alone = self.alone();
        for vertex in 0..self.model.vertices() {
            let is_aside = dot(self.normal(vertex as u32), way) < THROUGH;
            if is_aside || alone.leaves_out(vertex, effort) {
                continue;
            }
            let at = self.model.positions_mm[vertex];
            alone.count_look(effort);
            match held.front(self.object, self.view.seen(at)) {
                Front::Met { ahead_mm, along, .. } => {
                    let along = along.max(SLANT);
                    let depth_mm = ahead_mm * along / self.view.length;
                    if depth_mm > sweep.depth_mm {
                        (sweep.depth_mm, sweep.along) = (depth_mm, along);
                    }
                    sweep.any_met = true;
                    sweep.any_passed |= self.is_passed(vertex as u32, way, effort);
                }
                Front::Missed { clear_mm } => {
                    sweep.closest_mm = sweep.closest_mm.min(clear_mm / self.view.length);
                }
            }
        }
        sweep
    }

    /// Whether a vertex on the way lies behind the body, or sees its far side.
    fn is_passed(&self, vertex: u32, way: [f64; 3], effort: &mut Effort) -> bool {
        let (gap, normal) = self.nearest(vertex, effort);
        gap > BESIDE_MM || dot(normal, way) > PASSED
    }

    fn front(&self, vertex: u32, way: [f64; 3], widen_mm: f64) -> Front {
        let held = Held { is_on: true, way, back_mm: 0.0, widen_mm };
        let at = self.view.seen(self.model.positions_mm[vertex as usize]);
        match held.front(self.object, at) {
            Front::Met { ahead_mm, along, normal } => {
                Front::Met { ahead_mm: ahead_mm / self.view.length, along, normal }
            }
            missed @ Front::Missed { .. } => missed,
        }
    }

    fn normal(&self, vertex: u32) -> [f64; 3] {
        self.model.normals[vertex as usize].map(f64::from)
    }

    /// The view of the object alone.
    fn alone(&self) -> View<'_> {
        self.view.only(self.object)
    }

    /// Free distance of a place, reference mm.
    fn clear(&self, at_mm: [f64; 3]) -> f64 {
        let placement = &self.object.placement;
        let shape = self.object.shape.as_ref();
        placement.clearance_mm(shape, self.view.seen(at_mm)) / self.view.length
    }

    /// Gap (reference mm) of a vertex at rest, and the object's normal there.
    fn nearest(&self, vertex: u32, effort: &mut Effort) -> (f64, [f64; 3]) {
        let view = self.alone();
        view.count(1, effort);
        let nearest = view.nearest(self.model, vertex as usize, [0.0; 3]);
        (nearest.gap_mm, nearest.normal)
    }
}
