//! One body of a frame: where the skin lies on its way, and what is nearest there.

use super::Side;
use crate::answer::Effort;
use crate::held::{Front, Held};
use crate::model::ContactModel;
use crate::object::Object;
use crate::objects::View;
use papilla_vector::dot;

/// Cosine between the way in and a front's normal above which depth is taken along the normal.
pub(super) const SLANT: f64 = 0.7;
/// Beyond what a ray has to lie before a vertex counts as passed, mm.
const BESIDE_MM: f64 = 0.02;
/// Cosine between the way out and the normals of the skin that a body can have come through.
pub(super) const THROUGH: f64 = 0.1;
/// Cosine between the skin's and a body's outward normals above which the body has passed the skin.
pub(super) const PASSED: f64 = 0.3;

/// One body of a frame.
pub(super) struct Asked<'a> {
    pub(super) model: &'a ContactModel,
    pub(super) view: View<'a>,
    /// The objects that it is made up of.
    pub(super) body: &'a [Object],
    pub(super) past: Side,
    /// The origin of the object that this is the past of, reference mm.
    pub(super) place: [f64; 3],
    pub(super) toward: Option<[f64; 3]>,
    pub(super) fine: bool,
    pub(super) at_rest: bool,
    /// Of the only body; none of several.
    pub(super) candidates: &'a [(f64, u32)],
}

/// How deep the skin lies on a body's way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sweep {
    pub(super) depth_mm: f64,
    pub(super) along: f64,
    pub(super) any_met: bool,
    pub(super) any_passed: bool,
    pub(super) closest_mm: f64,
}

impl Asked<'_> {
    /// How deep the skin that faces a way out lies on it.
    pub(super) fn sweep(&self, way: [f64; 3], widen_mm: f64, effort: &mut Effort) -> Sweep {
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
            match front_of(self.body, held, self.view.seen(at)) {
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

    /// What a vertex meets on the way in.
    pub(super) fn front(&self, vertex: u32, way: [f64; 3], widen_mm: f64) -> Front {
        let held = Held { is_on: true, way, back_mm: 0.0, widen_mm };
        let at = self.view.seen(self.model.positions_mm[vertex as usize]);
        match front_of(self.body, held, at) {
            Front::Met { ahead_mm, along, normal } => {
                Front::Met { ahead_mm: ahead_mm / self.view.length, along, normal }
            }
            missed @ Front::Missed { .. } => missed,
        }
    }

    /// The vertex farthest out along the way, of those that lie in the only body.
    pub(super) fn outermost(&self, vertex: u32, way: [f64; 3]) -> u32 {
        let out = |vertex: u32| dot(self.model.positions_mm[vertex as usize], way);
        let inside = self.candidates.iter().filter(|(free, _)| *free < 0.0);
        inside.fold(vertex, |most, (_, v)| if out(*v) > out(most) { *v } else { most })
    }

    /// How far a body goes on behind the skin at a vertex, reference mm.
    pub(super) fn behind(&self, vertex: u32) -> f64 {
        let inward = self.normal(vertex).map(|n| -n);
        self.reach(inward) - dot(self.model.positions_mm[vertex as usize], inward)
    }

    /// How far a body goes along a direction, reference mm from the finger's origin.
    pub(super) fn reach(&self, direction: [f64; 3]) -> f64 {
        let of = |object: &Object| object.placement.reach_mm(object.shape.as_ref(), direction);
        let reach = self.body.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
        reach / self.view.length + dot(self.view.shift_mm, direction)
    }

    /// Free distance of a place, reference mm.
    pub(super) fn clear(&self, at_mm: [f64; 3]) -> f64 {
        let at = self.view.seen(at_mm);
        let of = |object: &Object| object.placement.clearance_mm(object.shape.as_ref(), at);
        self.body.iter().map(of).fold(f64::INFINITY, f64::min) / self.view.length
    }

    /// Gap (reference mm) of a vertex at rest, and the body's normal there.
    pub(super) fn nearest(&self, vertex: u32, effort: &mut Effort) -> (f64, [f64; 3]) {
        let view = self.alone();
        view.count(1, effort);
        let nearest = view.nearest(self.model, vertex as usize, [0.0; 3]);
        view.count_more(nearest.asked, effort);
        (nearest.gap_mm, nearest.normal)
    }

    /// The skin's normal.
    pub(super) fn normal(&self, vertex: u32) -> [f64; 3] {
        self.model.normals[vertex as usize].map(f64::from)
    }

    /// The view of the body alone.
    pub(super) fn alone(&self) -> View<'_> {
        self.view.only(self.body)
    }
}

/// What one meets of a body from a place of the person on the way in: the last front of its objects.
fn front_of(body: &[Object], held: Held, p: [f64; 3]) -> Front {
    let mut last = Front::Missed { clear_mm: f64::INFINITY };
    for object in body {
        let found = held.front(object, p);
        last = match (last, found) {
            (Front::Met { ahead_mm: a, .. }, Front::Met { ahead_mm: b, .. }) if b > a => found,
            (Front::Missed { .. }, Front::Met { .. }) => found,
            (Front::Missed { clear_mm: a }, Front::Missed { clear_mm: b }) if b < a => found,
            _ => last,
        };
    }
    last
}
