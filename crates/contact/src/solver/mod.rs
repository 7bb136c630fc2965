//! Contact of a finger, from frame to frame.
//!
//! A frame linearises the distance of every displaced vertex from the nearest object, solves for
//! forces along the normals of the objects, displaces the vertices under them, and repeats. It
//! starts from the forces of the last frame. Objects that have jumped deep into the skin are moved
//! back along the normals of the skin and in again by steps, so that each vertex meets the side
//! that it would have met on the way.

mod approach;
mod candidates;
mod friction;
mod iteration;
mod memory;
mod missed;
mod sides;

use crate::answer::{Contact, Effort, Person, collect};
use crate::bounded::{BoundedSolver, Symmetric};
use crate::error::ContactError;
use crate::gaps::Field;
use crate::ladder::Method;
use crate::model::{ContactModel, Header};
use crate::object::Object;
use crate::objects::{Scene, Things, View, validate};
use crate::patch::{Patch, Slots};
use crate::second_order::Amplitudes;
use crate::springs;
use candidates::Seen;
pub use friction::Anchor;
use friction::Friction;
pub use memory::Memory;
use papilla_vector::norm;
use sides::Sides;
pub use sides::{Hardest, Side};
use std::sync::Arc;

/// Undeformed vertices nearer than this may come into contact, reference mm.
const CANDIDATE_MM: f64 = 0.6;
/// Candidates that are nearer than this stay candidates, reference mm.
const KEPT_MM: f64 = 0.8;
/// Force of a vertex that counts as none, reference N.
const FORCE_MIN_N: f32 = 1e-12;
/// Displaced vertices nearer than this may carry force in this frame, reference mm.
const NEAR_MM: f32 = 0.08;
/// Deepest that a displaced vertex may lie in an object before objects are brought in by steps.
const STEP_MM: f64 = 0.25;
/// Most steps.
const STEPS_MAX: u32 = 16;
/// Farthest that objects are drawn back, reference mm.
const BACK_MAX_MM: f64 = 8.0;
/// Linearisations in a step on the way.
const ITERATIONS_ON_THE_WAY: u32 = 3;
/// Linearisations in a frame's last step.
const ITERATIONS_MAX: u32 = 25;
/// Change of displacement that ends a frame, reference mm.
const SETTLED_MM: f32 = 5e-5;
/// Change of displacement above which an answer is not settled, reference mm.
const UNSETTLED_MM: f32 = 1e-3;
/// Depth of a displaced vertex in a thing, beyond how far that gives way, above which an answer is
/// not settled, reference mm.
const INSIDE_MAX_MM: f32 = 5e-3;
/// Violation of a complementarity condition that is accepted, reference mm.
const VIOLATION_MM: f32 = 1e-5;
/// Most products with the matrix in a complementarity solve.
const PRODUCTS_MAX: u32 = 200;
/// The same in a frame; then each solve has the least.
const FRAME_PRODUCTS_MAX: u32 = 3000;
const PRODUCTS_MIN: u32 = 10;
/// Turn of a normal, as a difference of unit vectors, beyond which the matrix is made anew.
const TURN_MAX: f32 = 0.05;
/// Range of the over- or under-relaxation.
const RELAXATION: [f32; 2] = [0.3, 2.5];
/// Range of the share of tangent compliance that the second order takes.
const SHARE: [f32; 2] = [-0.1, 0.3];
/// Smallest and largest factor of a person.
const PERSON: [f64; 2] = [0.25, 4.0];

/// What a solver is to do in each frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Settings {
    /// How pressure is found.
    pub method: Method,
    /// Whose finger it is.
    pub person: Person,
    /// Whether to find the local stiffness too, of the pressure alone.
    pub stiffness: bool,
    /// Whether things may have friction, with a method that knows compliance.
    pub friction: bool,
}

/// When the linearisations of a frame's step end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Until {
    /// Change of displacement, reference mm.
    pub(crate) settled_mm: f32,
    pub(crate) iterations_max: u32,
}

impl Until {
    /// Of an answer.
    pub(crate) const SETTLED: Self =
        Self { settled_mm: SETTLED_MM, iterations_max: ITERATIONS_MAX };
    /// Of a step on the way.
    const ON_THE_WAY: Self = Self { settled_mm: SETTLED_MM, iterations_max: ITERATIONS_ON_THE_WAY };

    /// The same with displacements that may still change by so much.
    pub(crate) const fn within(settled_mm: f32) -> Self {
        Self { settled_mm, ..Self::SETTLED }
    }
}

/// Where a net force was met; the next frame starts there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reached {
    pub(crate) travel_mm: f64,
    pub(crate) slope_n_per_mm: f64,
}

/// Contact of one finger. All memory is taken at construction.
#[derive(Debug)]
pub struct Solver {
    pub(crate) model: Arc<ContactModel>,
    settings: Settings,
    patch: Patch,
    bounded: BoundedSolver,
    amplitudes: Option<Amplitudes>,
    /// Compliance along normals, rows as in the patch, and the normals that it was made for.
    matrix: Vec<f32>,
    /// Bound of its eigenvalues.
    norm: f32,
    made_for: [Vec<f32>; 3],
    /// Compliance of the objects that it was made with.
    made_with: Vec<f32>,
    made: usize,
    rest: Vec<f32>,
    wanted: Vec<bool>,
    /// Distance from the objects at rest and vertex.
    candidates: Vec<(f64, u32)>,
    overflow: bool,
    /// Gaps of this frame.
    field: Field,
    friction: Option<Friction>,
    /// From which side each object came.
    pub(crate) sides: Sides,
    /// Where the last frame under a net force ended.
    pub(crate) reached: Option<Reached>,
}

impl Solver {
    /// A solver of a finger that nothing touches yet.
    ///
    /// # Errors
    /// [`ContactError::Value`] for factors of a person out of range, [`ContactError::Friction`] for
    /// springs that are to have friction.
    pub fn new(model: Arc<ContactModel>, settings: Settings) -> Result<Self, ContactError> {
        let Person { width, stiffness } = settings.person;
        for (member, value) in [("person.width", width), ("person.stiffness", stiffness)] {
            if !(PERSON[0]..=PERSON[1]).contains(&value) {
                return Err(ContactError::Value { member, value, rule: "has to be 0.25 to 4" });
            }
        }
        if settings.friction && settings.method == Method::Springs {
            return Err(ContactError::Friction("springs have no compliance along the skin"));
        }
        let patch = Patch::new(model.vertices());
        let [slots, row] = patch.room();
        let second_order =
            model.second_order.as_ref().filter(|_| settings.method.has_second_order());
        Ok(Self {
            bounded: BoundedSolver::new(slots),
            amplitudes: second_order.map(|s| s.amplitudes()),
            matrix: vec![0.0; slots * row],
            norm: 0.0,
            made_for: std::array::from_fn(|_| vec![0.0; slots]),
            made_with: vec![0.0; slots],
            made: 0,
            rest: vec![0.0; slots],
            wanted: vec![false; model.vertices()],
            candidates: Vec::with_capacity(model.vertices()),
            overflow: false,
            field: Field::with_capacity(model.vertices()),
            sides: Sides::new(settings.method == Method::Springs),
            reached: None,
            friction: settings.friction.then(|| Friction::new(model.vertices(), [slots, row])),
            patch,
            model,
            settings,
        })
    }

    /// Forgets the frames before.
    pub fn reset(&mut self) {
        self.forget_start();
        self.sides.forget();
    }

    /// Forgets the last frame, but not from which side objects came.
    fn forget_start(&mut self) {
        self.patch.clear();
        self.made = 0;
        self.reached = None;
        if let Some(friction) = &mut self.friction {
            friction.forget();
        }
    }

    /// The model that it solves with.
    #[must_use]
    pub fn model(&self) -> &ContactModel {
        &self.model
    }

    /// Forces on the skin's vertices after the last frame, N.
    pub(crate) fn forces(&self, force_n: &mut [Vec<f32>; 3]) {
        let Slots { found, size, .. } = &self.patch.values;
        for (force, found) in force_n.iter_mut().zip(found) {
            force.fill(0.0);
            for slot in (0..self.patch.near()).filter(|slot| size[*slot] > 0.0) {
                force[self.patch.vertices()[slot] as usize] = found[slot];
            }
        }
    }

    /// Forces of objects along their normals on the skin's vertices after the last frame, N.
    pub(crate) fn normal_forces(&self, force_n: &mut [Vec<f32>; 3]) {
        self.forces(force_n);
        self.each_rubbed(|vertex, _, shear| {
            for (force, shear) in force_n.iter_mut().zip(shear) {
                force[vertex] -= shear;
            }
        });
    }

    /// Calls `note` with each vertex under force, the size of its normal force and its force along the skin,
    /// N, after a frame in which something has friction; false after any other frame.
    pub(crate) fn each_rubbed(&self, mut note: impl FnMut(usize, f32, [f32; 3])) -> bool {
        let Some(friction) = self.friction.as_ref().filter(|f| f.is_rough) else { return false };
        let size = &self.patch.values.size;
        for slot in (0..self.patch.near()).filter(|slot| size[*slot] > 0.0) {
            note(self.patch.vertices()[slot] as usize, size[slot], friction.shear_n(slot));
        }
        true
    }

    /// Whether the last frame's forces along the skin are settled.
    pub(crate) fn is_slip_settled(&self) -> bool {
        let friction = self.friction.as_ref().filter(|f| f.is_rough);
        friction.is_none_or(|f| f.violation_mm <= UNSETTLED_MM)
    }

    /// Free distances (reference mm) and vertices that things were near in the last frame.
    pub(crate) fn near(&self) -> &[(f64, u32)] {
        &self.candidates
    }

    pub(crate) fn has_second_order(&self) -> bool {
        self.amplitudes.is_some()
    }

    /// Whose finger it is.
    pub(crate) fn person(&self) -> Person {
        self.settings.person
    }

    /// Finds what presses on the finger in a scene: objects in the finger's frame, in mm of this
    /// person, or gaps.
    ///
    /// # Errors
    /// [`ContactError`] for what cannot be placed, with the last frame kept, or
    /// [`ContactError::Diverged`].
    pub fn solve<'a>(
        &mut self,
        scene: impl Into<Scene<'a>>,
        out: &mut Contact,
    ) -> Result<(), ContactError> {
        self.within(scene.into(), KEPT_MM as f32, |solver, view| {
            (solver.sides.toward, solver.sides.fine) = (None, false);
            solver.frame(view, out)?;
            solver.end_frame(view, !out.touched().is_empty(), out);
            Ok(())
        })
    }

    /// What the force of the trusted depth was multiplied by in the last frame, and its slope over
    /// that force, 1 / (reference mm).
    pub(crate) fn strength(&self) -> Option<(f64, f64)> {
        self.sides.strength(&self.model)
    }

    /// The view in which the last frame was solved: what is held stands where it is held.
    pub(crate) fn held<'a>(&'a self, view: View<'a>) -> View<'a> {
        self.sides.view(view)
    }

    /// Ends a frame of things in given places: force that has fallen on a straight way in is told, and
    /// so are bodies that lie in the finger although none is met.
    pub(crate) fn end_frame(&mut self, view: View<'_>, is_met: bool, out: &mut Contact) {
        self.tell_missed(view, is_met, out);
        if let Things::Objects([Object { placement, .. }]) = view.things {
            let (turned, settled) = (placement.rotation, out.quality.settled);
            out.quality.has_faded = self.sides.has_faded(turned, out.force_n, settled);
        }
        out.quality.settled &= !out.quality.has_faded;
        self.follow_slip(view);
    }

    /// Runs `work` on a view of the scene, of which gaps are told up to `reach_mm`.
    pub(crate) fn within<T>(
        &mut self,
        scene: Scene<'_>,
        reach_mm: f32,
        work: impl FnOnce(&mut Self, View<'_>) -> Result<T, ContactError>,
    ) -> Result<T, ContactError> {
        let length = self.settings.person.width;
        match scene {
            Scene::Objects(objects) => {
                validate(objects)?;
                let view = View::of(Things::Objects(objects), length);
                self.expect_friction(view)?;
                work(self, view)
            }
            Scene::Gaps(gaps) => {
                let mut field = std::mem::take(&mut self.field);
                let read = field.read(&self.model, gaps, length, reach_mm);
                let result = read.and_then(|()| {
                    let view = View::of(Things::Field(&field), length);
                    self.expect_friction(view)?;
                    if let Some(friction) = &mut self.friction {
                        friction.carry(|vertex| field.moved_mm(vertex));
                    }
                    work(self, view)
                });
                self.field = field;
                result
            }
        }
    }

    /// Takes note of whether anything has friction.
    fn expect_friction(&mut self, view: View<'_>) -> Result<(), ContactError> {
        match &mut self.friction {
            Some(friction) => friction.expect(view.is_rough()),
            None if view.is_rough() => {
                return Err(ContactError::Friction("the solver was made without it"));
            }
            None => {}
        }
        Ok(())
    }

    /// Finds what presses on the finger in `view`. A warm frame that runs away is tried once more
    /// from nothing.
    pub(crate) fn frame(&mut self, view: View<'_>, out: &mut Contact) -> Result<(), ContactError> {
        self.frame_until(Until::SETTLED, view, out)
    }

    /// The same, until displacements change by so little, or so often.
    pub(crate) fn frame_until(
        &mut self,
        until: Until,
        view: View<'_>,
        out: &mut Contact,
    ) -> Result<(), ContactError> {
        let mut sides = std::mem::take(&mut self.sides);
        let mut is_found = self.attempt(until, view, &mut sides, out);
        if !is_found {
            self.forget_start();
            let first = out.effort;
            is_found = self.attempt(until, view.after(&first), &mut sides, out);
            out.effort = first.plus(out.effort);
        }
        self.sides = sides;
        if is_found {
            return Ok(());
        }
        self.forget_start();
        out.clear();
        Err(ContactError::Diverged)
    }

    /// Presses on the undeformed skin, which always has one answer: what is left where
    /// linearisations lead nowhere.
    fn press_undeformed(&mut self, view: View<'_>, effort: &mut Effort) {
        let Slots { force, found, change, .. } = &mut self.patch.values;
        for vector in [force, found, change].into_iter().flatten() {
            vector.fill(0.0);
        }
        self.displace(self.patch.vertices().len());
        self.measure_all(view, effort);
        self.choose_near();
        self.remake_matrix();
        self.find_forces(view, 1.0, PRODUCTS_MAX, effort);
        effort.work += self.patch.take_work();
    }

    /// Whether what came out is finite.
    fn attempt(
        &mut self,
        until: Until,
        view: View<'_>,
        sides: &mut Sides,
        out: &mut Contact,
    ) -> bool {
        out.pressure_pa.resize(self.model.vertices(), 0.0);
        if self.settings.friction {
            out.shear_pa.resize(self.model.vertices(), [0.0; 3]);
        }
        out.clear();
        // What was done between frames is no part of this one.
        self.patch.take_work();
        let is_far = self.find_candidates(view, &mut out.effort);
        let seen = Seen { candidates: &self.candidates, is_far };
        sides.judge(&self.model, view, seen, &mut out.effort);
        if !sides.any_held() {
            let is_finite = self.press(until, view, false, out);
            out.quality.out_of_range |= sides.is_beyond();
            return is_finite;
        }
        let view = sides.view(view);
        self.find_candidates(view, &mut out.effort);
        let is_finite = self.press(until, view, true, out);
        out.quality.is_held = true;
        out.quality.out_of_range |= sides.is_beyond();
        if !(out.force_n.iter().any(|f| *f != 0.0)) {
            // A body in the finger presses, but nothing was found by which.
            out.quality.out_of_range = true;
        }
        if let Some((strength, slope)) = sides.strength(&self.model) {
            out.strengthen(strength, slope / self.settings.person.width);
        }
        is_finite && out.is_finite()
    }

    /// Presses the candidates; returns whether what came out is finite.
    fn press(&mut self, until: Until, view: View<'_>, is_held: bool, out: &mut Contact) -> bool {
        // Where no undeformed vertex lies in a thing, no force is an answer; a warm start could find
        // another one, on the far side of something thin.
        if self.candidates.iter().all(|(free, _)| *free > 0.0) {
            self.patch.clear();
            out.effort.work += self.patch.take_work();
            self.made = 0;
            return true;
        }
        if self.settings.method == Method::Springs {
            springs::press(&self.model, view, self.settings.person, &self.candidates, out);
            return true;
        }
        self.keep_candidates();
        self.displace(self.patch.vertices().len());
        out.effort.work += self.patch.take_work();
        self.approach(view, &mut out.effort);
        let change = self.iterate(view, until, &mut out.effort);
        if !change.is_finite() {
            return false;
        }
        if change > UNSETTLED_MM {
            // Skin slips off what is narrow and deep: of that the undeformed skin tells more.
            if is_held {
                self.press_undeformed(view, &mut out.effort);
            } else {
                self.take_mean();
            }
        }
        if !self.patch.values.size[..self.patch.near()].iter().any(|s| *s > 0.0) {
            self.press_undeformed(view, &mut out.effort);
        }
        self.answer(view, change, out);
        out.quality.settled &= !view.is_spent(&out.effort);
        out.is_finite()
    }

    /// Displaces the first `rows` slots under the near slots' forces.
    fn displace(&mut self, rows: usize) {
        self.patch.displace(rows);
        let m = self.patch.near();
        if let (Some(a), Some(s)) = (&mut self.amplitudes, &self.model.second_order) {
            self.patch.count(s.work(m, rows));
            let [x, y, z] = &self.patch.values.force;
            s.evaluate(&self.patch.vertices()[..m], [&x[..m], &y[..m], &z[..m]], a);
        }
        self.move_slots(rows);
    }

    fn move_slots(&mut self, rows: usize) {
        if let (Some(a), Some(s)) = (&self.amplitudes, &self.model.second_order) {
            self.patch.move_by(rows, |ids, first, moved| s.displace(a, ids, first, moved));
        } else {
            let Slots { linear, moved, .. } = &mut self.patch.values;
            for (moved, linear) in moved.iter_mut().zip(linear) {
                moved[..rows].copy_from_slice(&linear[..rows]);
            }
        }
    }

    /// Distances of all displaced slots.
    fn measure_all(&mut self, view: View<'_>, effort: &mut Effort) {
        self.measure_first(view, self.patch.vertices().len(), effort);
    }

    /// Distances of the displaced near slots.
    fn measure(&mut self, view: View<'_>, effort: &mut Effort) {
        self.measure_first(view, self.patch.near(), effort);
    }

    fn measure_first(&mut self, view: View<'_>, slots: usize, effort: &mut Effort) {
        let Self { patch, model, settings, friction, .. } = self;
        let Person { width, stiffness } = settings.person;
        view.count(slots as u32, effort);
        for slot in 0..slots {
            let vertex = patch.vertices()[slot] as usize;
            let v = &mut patch.values;
            let moved = [0, 1, 2].map(|i| f64::from(v.moved[i][slot]));
            let nearest = view.nearest(model, vertex, moved);
            view.count_more(nearest.asked, effort);
            for i in 0..3 {
                v.normal[i][slot] = nearest.normal[i] as f32;
            }
            // In the units of the reference finger: pressure over stiffness, length over width.
            let give = stiffness / (nearest.stiffness_mpa_per_mm * width);
            v.object[slot] = (give / f64::from(model.areas_mm2[vertex])) as f32;
            v.gap[slot] = nearest.gap_mm.min(1e3) as f32 + v.object[slot] * v.size[slot];
            if let Some(friction) = friction {
                friction.meet(vertex, nearest.object, nearest.friction);
            }
        }
    }

    fn answer(&mut self, view: View<'_>, change: f32, out: &mut Contact) {
        let Header { share_max, depth_max_mm, .. } = *self.model.header();
        let deepest = self.candidates.iter().map(|(free, _)| -free).fold(0.0, f64::max);
        let is_deep = depth_max_mm > 0.0 && deepest > f64::from(depth_max_mm);
        let v = &self.patch.values;
        let slots = self.patch.vertices().len();
        let least = v.gap[..slots].iter().copied().fold(0.0, f32::min);
        for slot in 0..slots {
            let deep = f64::from(v.object[slot] * v.size[slot] - v.gap[slot]);
            out.penetration_mm = out.penetration_mm.max(deep);
        }
        out.quality.share = self.amplitudes.as_ref().map_or(0.0, |a| a.share);
        out.quality.out_of_range = self.overflow || is_deep || !(out.quality.share <= share_max);
        out.quality.settled = change <= UNSETTLED_MM && least >= -INSIDE_MAX_MM;
        out.quality.settled &= self.is_slip_settled();
        let friction = self.friction.as_ref().filter(|f| f.is_rough);
        let shear_n = |slot: usize| friction.map_or([0.0; 3], |f| f.shear_n(slot));
        collect(&self.model, &self.patch, self.settings.person, shear_n, out);
        if self.settings.stiffness {
            out.stiffness_n_per_mm = self.stiffness(view, out);
        }
    }

    /// Change of force for a small travel of the objects along it: forces of the points in contact
    /// that move all of them by the part of the travel along their normals.
    fn stiffness(&mut self, view: View<'_>, out: &mut Contact) -> Option<f64> {
        let size = norm(out.force_n);
        if !(size > 0.0) {
            return None;
        }
        let along = out.force_n.map(|f| (f / size) as f32);
        let scale = 1.0 - 2.0 * self.share_taken();
        self.remake_matrix();
        out.effort.work += self.patch.take_work();
        let entries = self.entries();
        let most = view.most(PRODUCTS_MAX, entries, &out.effort).max(PRODUCTS_MIN);
        let Self { patch, matrix, norm, rest, bounded, .. } = self;
        let m = patch.near();
        let v = &patch.values;
        for slot in 0..m {
            let part: f32 = (0..3).map(|i| along[i] * v.normal[i][slot]).sum();
            rest[slot] = if v.size[slot] > 0.0 { part } else { 0.0 };
        }
        let symmetric = Symmetric { values: matrix, stride: patch.stride(), norm: *norm };
        let (force, products) = bounded.work_of_travel(symmetric, &rest[..m], most);
        out.effort.work += u64::from(products) * entries;
        let Person { width, stiffness } = self.settings.person;
        let found = f64::from(force / scale) * stiffness * width;
        Some(found).filter(|s| s.is_finite() && *s >= 0.0)
    }
}
