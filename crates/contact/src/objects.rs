//! What can press on a finger, and its distance from a point.

use crate::answer::Effort;
use crate::budget;
use crate::error::ContactError;
use crate::gaps::{Field, Gaps};
use crate::held::Held;
use crate::model::ContactModel;
use crate::nearest::{Nearest, require_friction, require_stiffness};
use crate::object::{Object, local};
use papilla_sdf::{Distance, Placement, beneath, may_be_covered};
use papilla_vector::{cross, dot, norm};

/// What lies round a finger in a frame.
#[derive(Clone, Copy)]
pub enum Scene<'a> {
    /// Objects in their places.
    Objects(&'a [Object]),
    /// How deep the undeformed skin lies in things.
    Gaps(Gaps<'a>),
}

/// Largest deviation of a rotation from orthonormal columns.
const ROTATION_MISS_MAX: f64 = 1e-3;
/// Farthest place of an object, mm.
const PLACE_MAX_MM: f64 = 1e5;

impl<'a> From<&'a [Object]> for Scene<'a> {
    fn from(objects: &'a [Object]) -> Self {
        Self::Objects(objects)
    }
}

impl<'a, const N: usize> From<&'a [Object; N]> for Scene<'a> {
    fn from(objects: &'a [Object; N]) -> Self {
        Self::Objects(objects)
    }
}

impl<'a> From<&'a Vec<Object>> for Scene<'a> {
    fn from(objects: &'a Vec<Object>) -> Self {
        Self::Objects(objects)
    }
}

impl<'a> From<Gaps<'a>> for Scene<'a> {
    fn from(gaps: Gaps<'a>) -> Self {
        Self::Gaps(gaps)
    }
}

/// Refuses what cannot be placed.
pub(crate) fn validate(objects: &[Object]) -> Result<(), ContactError> {
    for (index, object) in objects.iter().enumerate() {
        let Placement { rotation, origin_mm } = object.placement;
        for value in origin_mm {
            if !(value.abs() <= PLACE_MAX_MM) {
                let (member, rule) = ("objects[].origin_mm", "has to be within 100 m");
                return Err(ContactError::Value { member, value, rule });
            }
        }
        let mut miss = 0.0f64;
        for i in 0..3 {
            for j in 0..3 {
                let product: f64 = (0..3).map(|k| rotation[k][i] * rotation[k][j]).sum();
                let off = (product - f64::from(u8::from(i == j))).abs();
                miss = if off <= miss { miss } else { off };
            }
        }
        let [a, b, c] = rotation;
        let volume = dot(a, cross(b, c));
        if !(miss <= ROTATION_MISS_MAX && volume > 0.0) {
            return Err(ContactError::Rotation { object: index, miss });
        }
        require_stiffness("objects[].stiffness_mpa_per_mm", object.stiffness_mpa_per_mm)?;
        require_friction("objects[].friction", object.friction)?;
    }
    Ok(())
}

/// What lies round a finger of reference width.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    pub things: Things<'a>,
    /// Width of the finger over the reference width.
    pub length: f64,
    /// How far the things have moved from their places, reference mm.
    pub shift_mm: [f64; 3],
    /// By object, how it is held; empty where none is.
    pub held: &'a [Held],
    /// How far things that gaps tell of are drawn back along their normals, reference mm.
    pub back_mm: f64,
    /// What a distance from all things costs, in those of a sphere; of gaps nothing.
    pub cost: u64,
    /// Units of work that a frame may take.
    pub work_max: u64,
}

/// A scene, ready to be asked.
#[derive(Clone, Copy)]
pub(crate) enum Things<'a> {
    Objects(&'a [Object]),
    Field(&'a Field),
}

impl<'a> View<'a> {
    /// Of things in their places.
    pub(crate) fn of(things: Things<'a>, length: f64) -> Self {
        let cost = cost(things);
        let work_max = budget::WORK_MAX;
        Self { things, length, shift_mm: [0.0; 3], held: &[], back_mm: 0.0, cost, work_max }
    }

    /// The same view of some objects.
    pub(crate) fn only(self, objects: &'a [Object]) -> Self {
        let things = Things::Objects(objects);
        Self { things, cost: cost(things), ..self }
    }

    fn held(&self, object: u32) -> Option<&'a Held> {
        self.held.get(object as usize).filter(|held| held.is_on)
    }

    fn field_at(&self, field: &Field, vertex: usize, moved: [f64; 3]) -> Nearest {
        let nearest = field.at(vertex, moved);
        if self.back_mm > 0.0 {
            return Nearest { gap_mm: nearest.gap_mm + self.back_mm, ..nearest };
        }
        nearest
    }

    /// The nearest thing of a vertex that has moved by `moved` (reference mm).
    pub(crate) fn nearest(&self, model: &ContactModel, vertex: usize, moved: [f64; 3]) -> Nearest {
        match self.things {
            Things::Objects(objects) => {
                let at = std::array::from_fn(|i| model.positions_mm[vertex][i] + moved[i]);
                self.nearest_object(objects, self.seen(at))
            }
            Things::Field(field) => {
                let moved = std::array::from_fn(|i| moved[i] - self.shift_mm[i]);
                self.field_at(field, vertex, moved)
            }
        }
    }

    /// The nearest object of a place, reference mm; none of a scene that is told by gaps.
    pub(crate) fn nearest_at(&self, at_mm: [f64; 3]) -> Option<Nearest> {
        match self.things {
            Things::Objects(objects) => Some(self.nearest_object(objects, self.seen(at_mm))),
            Things::Field(_) => None,
        }
    }

    fn nearest_object(&self, objects: &[Object], p: [f64; 3]) -> Nearest {
        let mut nearest = Nearest {
            gap_mm: f64::INFINITY,
            normal: [0.0, 0.0, 1.0],
            stiffness_mpa_per_mm: f64::INFINITY,
            friction: 0.0,
            object: 0,
            asked: 0,
        };
        let mut second_mm = f64::INFINITY;
        for (object, o) in (0..).zip(objects) {
            let r = &o.placement.rotation;
            let found = match self.held(object) {
                None => o.shape.distance(local(&o.placement, p)),
                Some(held) => held.distance(o, p),
            };
            let gap_mm = found.gap_mm / self.length;
            second_mm = second_mm.min(gap_mm.max(nearest.gap_mm));
            if gap_mm < nearest.gap_mm {
                let n = found.normal;
                let size = norm(n);
                let turned = r.map(|row| (row[0] * n[0] + row[1] * n[1] + row[2] * n[2]) / size);
                let normal = if size > 1e-6 { turned } else { nearest.normal };
                let (stiffness_mpa_per_mm, friction) = (o.stiffness_mpa_per_mm, o.friction);
                nearest =
                    Nearest { gap_mm, normal, stiffness_mpa_per_mm, friction, object, asked: 0 };
            }
        }
        // Of what is held only the front counts, which all objects that touch it share.
        let (gap_mm, second_mm) = (self.length * nearest.gap_mm, self.length * second_mm);
        if may_be_covered(gap_mm, second_mm) && self.held(nearest.object).is_none() {
            self.uncovered(objects, p, nearest)
        } else {
            nearest
        }
    }

    /// The nearest surface that no other object covers, where that of the nearest object may be.
    fn uncovered(&self, objects: &[Object], p: [f64; 3], nearest: Nearest) -> Nearest {
        let Nearest { gap_mm, normal, object, .. } = nearest;
        let found = Distance { gap_mm: self.length * gap_mm, normal, hessian: [[0.0; 3]; 3] };
        let mut asked = 0;
        let outer = beneath(objects, p, object as usize, &found, &mut asked);
        outer.map_or(Nearest { asked, ..nearest }, |(index, outer)| Nearest {
            gap_mm: outer.gap_mm / self.length,
            normal: outer.normal,
            stiffness_mpa_per_mm: objects[index].stiffness_mpa_per_mm,
            friction: objects[index].friction,
            object: index as u32,
            asked,
        })
    }

    /// Calls `each` with every vertex that is at most `margin_mm` (reference mm) from a thing, and
    /// with a distance that is certainly free there; returns how often objects were asked.
    pub(crate) fn near(
        &self,
        model: &ContactModel,
        margin_mm: f64,
        mut each: impl FnMut(u32, f64),
    ) -> u32 {
        match self.things {
            Things::Objects(objects) => {
                let mut asked = 0;
                let clearance = |p| self.clearance_mm(objects, p);
                let balls = model.clusters.near(margin_mm, clearance, |vertex| {
                    asked += 1;
                    each(vertex, clearance(model.positions_mm[vertex as usize]));
                });
                balls + asked
            }
            Things::Field(field) => {
                for vertex in 0..model.vertices() {
                    let away = self.shift_mm.map(|s| -s);
                    let gap_mm = self.field_at(field, vertex, away).gap_mm;
                    if gap_mm <= margin_mm {
                        each(vertex as u32, gap_mm);
                    }
                }
                0
            }
        }
    }

    /// A distance that all things are certainly away from the finger at rest, mm.
    pub(crate) fn free_mm(&self, model: &ContactModel, effort: &mut Effort) -> f64 {
        self.count(model.vertices() as u32, effort);
        let free = |vertex: usize| match self.things {
            Things::Objects(objects) => self.clearance_mm(objects, model.positions_mm[vertex]),
            Things::Field(field) => field.at(vertex, self.shift_mm.map(|s| -s)).gap_mm,
        };
        self.length * (0..model.vertices()).map(free).fold(f64::INFINITY, f64::min)
    }

    /// A distance that is certainly free round a place, reference mm.
    fn clearance_mm(&self, objects: &[Object], at_mm: [f64; 3]) -> f64 {
        let p = self.seen(at_mm);
        let free = |(i, o): (u32, &Object)| match self.held(i) {
            None => o.placement.clearance_mm(o.shape.as_ref(), p),
            Some(held) => held.clearance_mm(o, p),
        };
        (0..).zip(objects).map(free).fold(f64::INFINITY, f64::min) / self.length
    }

    /// Whether anything has friction.
    pub(crate) fn is_rough(&self) -> bool {
        match self.things {
            Things::Objects(objects) => objects.iter().any(|o| o.friction > 0.0),
            Things::Field(field) => field.friction() > 0.0,
        }
    }

    /// A place (reference mm) in an object's own frame, mm. What gaps tell of has the finger's, in
    /// which its places move.
    pub(crate) fn on_object(&self, object: u32, at_mm: [f64; 3]) -> Option<[f64; 3]> {
        let seen = self.seen(at_mm);
        match self.things {
            Things::Objects(objects) => {
                let at = self.drawn_back(object, seen, -1.0);
                objects.get(object as usize).map(|o| local(&o.placement, at))
            }
            Things::Field(_) => Some(seen),
        }
    }

    /// Where a place in an object's own frame (mm) is now, reference mm.
    pub(crate) fn off_object(&self, object: u32, place_mm: [f64; 3]) -> Option<[f64; 3]> {
        let there: [f64; 3] = match self.things {
            Things::Objects(objects) => {
                let Placement { rotation, origin_mm } = &objects.get(object as usize)?.placement;
                let turned = |i: usize| (0..3).map(|k| rotation[i][k] * place_mm[k]).sum::<f64>();
                let there = std::array::from_fn(|i| turned(i) + origin_mm[i]);
                self.drawn_back(object, there, 1.0)
            }
            Things::Field(_) => place_mm,
        };
        Some(std::array::from_fn(|i| there[i] / self.length + self.shift_mm[i]))
    }

    /// A place moved with an object that is held, so many times.
    fn drawn_back(&self, object: u32, at: [f64; 3], times: f64) -> [f64; 3] {
        self.held(object)
            .map_or(at, |held| std::array::from_fn(|i| at[i] + times * held.back_mm * held.way[i]))
    }

    /// A place of the reference finger as objects that have not moved see it, mm of the person.
    pub(crate) fn seen(&self, at_mm: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| self.length * (at_mm[i] - self.shift_mm[i]))
    }
}

/// What a distance from all things costs, in those of a sphere.
fn cost(things: Things<'_>) -> u64 {
    match things {
        Things::Objects(objects) => objects.iter().map(|o| o.shape.cost().ceil() as u64).sum(),
        Things::Field(_) => 0,
    }
}
