//! Which objects of a frame are one body.
//!
//! Objects that touch or overlap near the skin press as one, and no skin gets in between. By itself
//! a part of them may look narrow, or as if it had passed the skin, where the whole is wide. So they
//! are judged together. Which of them touch is asked only about those for which it matters: where
//! one covers the surface of another at a vertex, or is held.

use super::{Frame, OBJECTS, Side};
use crate::answer::Effort;
use crate::object::Object;
use papilla_vector::dot;

/// Objects closer than this are one, mm.
const TOUCH_MM: f64 = 1e-3;
/// Farther from the vertex that it is looked for from, they do not touch near it, mm.
const NEAR_MM: f64 = 1.5;
/// Most steps to and fro between two objects.
const STEPS_MAX: usize = 16;
/// Part of the last step's length from which on a step gets no nearer.
const SLOW: f64 = 0.9;
/// Cosine between the ways of two objects above which they can be one.
const ALIKE: f64 = 0.5;

/// The bodies that objects make up.
#[derive(Default)]
pub(super) struct Joined {
    /// By object, the first one of its body.
    first: Vec<usize>,
    /// By object, whether those that touch it have been looked for.
    is_spread: Vec<bool>,
    /// Those for which it is still to be done.
    open: Vec<usize>,
    /// By object, whether it touches one that came from another side.
    is_at_odds: Vec<bool>,
    /// The objects of a body.
    parts: Vec<Object>,
}

impl std::fmt::Debug for Joined {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Joined").field("first", &self.first).finish_non_exhaustive()
    }
}

impl Joined {
    pub(super) fn new() -> Self {
        Self {
            first: Vec::with_capacity(OBJECTS),
            is_spread: Vec::with_capacity(OBJECTS),
            open: Vec::with_capacity(2 * OBJECTS),
            is_at_odds: Vec::with_capacity(OBJECTS),
            parts: Vec::with_capacity(OBJECTS),
        }
    }

    /// So many objects, each by itself.
    pub(super) fn begin(&mut self, objects: usize) {
        self.first.clear();
        self.first.extend(0..objects);
        for of_object in [&mut self.is_spread, &mut self.is_at_odds] {
            of_object.clear();
            of_object.resize(objects, false);
        }
    }

    /// Joins to the objects that `is_asked` those that touch them, and so on; whether there are any.
    /// `side` tells their ways: what came from different sides stays apart.
    pub(super) fn spread(
        &mut self,
        frame: Frame<'_>,
        is_asked: impl Fn(usize) -> bool,
        side: impl Fn(usize) -> Side,
        effort: &mut Effort,
    ) -> bool {
        let Self { first, is_spread, open, is_at_odds, .. } = self;
        if first.len() < 2 {
            return false;
        }
        let mut is_any = false;
        open.clear();
        open.extend((0..first.len()).filter(|i| is_asked(*i)));
        while let Some(one) = open.pop() {
            if std::mem::replace(&mut is_spread[one], true) {
                continue;
            }
            for other in 0..first.len() {
                let is_joined = first[one] == first[other];
                if is_joined || frame.view.is_spent(effort) || !touch(frame, [one, other], effort) {
                    continue;
                }
                if !are_alike([one, other].map(&side)) {
                    (is_at_odds[one], is_at_odds[other]) = (true, true);
                    continue;
                }
                let (low, high) = (first[one].min(first[other]), first[one].max(first[other]));
                first.iter_mut().filter(|first| **first == high).for_each(|first| *first = low);
                open.push(other);
                is_any = true;
            }
        }
        is_any
    }

    /// Whether an object was found to touch one that came from another side.
    pub(super) fn is_at_odds(&self, object: usize) -> bool {
        self.is_at_odds[object]
    }

    /// Whether an object is the first one of its body.
    pub(super) fn is_first(&self, object: usize) -> bool {
        self.first[object] == object
    }

    /// The objects of the body of which `first` is the first, in their order.
    pub(super) fn members(&self, first: usize) -> impl Iterator<Item = usize> + '_ {
        (0..self.first.len()).filter(move |i| self.first[*i] == first)
    }

    /// The same objects of a frame.
    pub(super) fn body<'a>(&'a mut self, first: usize, objects: &'a [Object]) -> &'a [Object] {
        let Self { first: of, parts, .. } = self;
        parts.clear();
        if of.iter().filter(|of| **of == first).count() == 1 {
            return &objects[first..=first];
        }
        parts
            .extend(objects.iter().zip(of).filter(|(_, of)| **of == first).map(|(o, _)| o.clone()));
        parts
    }

    /// Holds no object any more.
    pub(super) fn let_go(&mut self) {
        self.parts.clear();
    }
}

/// Whether two objects can have come from the same side, as far as that is known.
fn are_alike(sides: [Side; 2]) -> bool {
    match sides.map(|side| side.way.filter(|_| !side.is_guess)) {
        [Some(one), Some(other)] => dot(one, other) > ALIKE,
        _ => true,
    }
}

/// Whether two objects touch near a vertex that things are near.
fn touch(frame: Frame<'_>, pair: [usize; 2], effort: &mut Effort) -> bool {
    let Frame { model, view, objects, seen } = frame;
    let pair = pair.map(|i| &objects[i]);
    if are_apart(pair) {
        return false;
    }
    let mut asked = 0;
    let from = |vertex: u32| view.seen(model.positions_mm[vertex as usize]);
    let found = seen.candidates.iter().any(|(_, vertex)| meet(pair, from(*vertex), &mut asked));
    view.count_more(asked, effort);
    found
}

/// Whether the boxes round two objects leave room between them.
fn are_apart([one, other]: [&Object; 2]) -> bool {
    let reach = |object: &Object, i: usize, sign: f64| {
        let direction = std::array::from_fn(|k| if k == i { sign } else { 0.0 });
        object.placement.reach_mm(object.shape.as_ref(), direction)
    };
    (0..3).any(|i| {
        reach(one, i, 1.0) + reach(other, i, -1.0) < -TOUCH_MM
            || reach(other, i, 1.0) + reach(one, i, -1.0) < -TOUCH_MM
    })
}

/// Whether a walk to and fro between two objects, always to the nearest point of the other one, ends
/// where they touch.
fn meet(pair: [&Object; 2], from: [f64; 3], asked: &mut u32) -> bool {
    let (mut at, mut last_mm) = (from, f64::INFINITY);
    for step in 0..STEPS_MAX {
        let object = pair[step % 2];
        *asked += object.shape.cost().ceil() as u32;
        let found = object.placement.distance(object.shape.as_ref(), at);
        if step > 0 && found.gap_mm <= TOUCH_MM {
            return true;
        }
        if found.gap_mm > 0.0 {
            let size = dot(found.normal, found.normal).sqrt();
            let is_slow = step > 1 && found.gap_mm > SLOW * last_mm;
            if !(size > 1e-6) || is_slow {
                return false;
            }
            last_mm = found.gap_mm;
            at = std::array::from_fn(|i| at[i] - found.gap_mm * found.normal[i] / size);
            let by: [f64; 3] = std::array::from_fn(|i| at[i] - from[i]);
            if !(dot(by, by) < NEAR_MM * NEAR_MM) {
                return false;
            }
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use papilla_sdf::{Placement, RoundedPlate, Sphere};
    use std::sync::Arc;

    fn plate(half_mm: [f64; 3], origin_mm: [f64; 3], tilt_deg: f64) -> Object {
        let shape = Arc::new(RoundedPlate { half_mm, edge_radius_mm: 0.0 });
        Object::rigid(shape, Placement::turned(tilt_deg, 0.0, 0.0, origin_mm))
    }

    fn ball(origin_mm: [f64; 3]) -> Object {
        let shape = Arc::new(Sphere { radius_mm: 1.0 });
        Object::rigid(shape, Placement::turned(0.0, 0.0, 0.0, origin_mm))
    }

    fn is_met(one: &Object, other: &Object, from: [f64; 3]) -> [bool; 2] {
        [[one, other], [other, one]].map(|pair| !are_apart(pair) && meet(pair, from, &mut 0))
    }

    #[test]
    fn what_touches_or_overlaps_is_met_from_all_sides_and_nothing_else() {
        let half = [0.5, 2.0, 0.5];
        let one = plate(half, [-0.5, 0.0, 0.0], 0.0);
        // Side by side, one upon the other, and one in the other.
        for at in [[0.5, 0.3, 0.1], [-0.3, 0.0, 1.0], [0.2, 0.1, 0.0]] {
            let other = plate(half, at, 0.0);
            for from in [[0.2, 0.1, 0.8], [-0.3, 0.4, 0.2], [0.1, -0.5, -0.3], [-0.7, 0.0, 0.6]] {
                assert_eq!(is_met(&one, &other, from), [true; 2], "{at:?} from {from:?}");
            }
        }
        for apart in [[0.52, 0.0, 0.0], [-0.5, 0.0, 1.02], [0.6, 0.0, 1.1]] {
            let other = plate(half, apart, 0.0);
            assert_eq!(is_met(&one, &other, [0.0; 3]), [false; 2], "{apart:?}");
        }
        // Their boxes overlap, and they do not.
        assert_eq!(is_met(&ball([0.0; 3]), &ball([1.5, 1.5, 0.0]), [0.7, 0.7, 0.2]), [false; 2]);
        assert_eq!(is_met(&ball([0.0; 3]), &ball([1.2, 1.2, 0.0]), [0.7, 0.7, 0.4]), [true; 2]);
        // A face leans on an edge.
        let leaning = plate([0.5, 2.0, 0.5], [0.5f64.sqrt(), 0.0, 0.2], 45.0);
        assert_eq!(is_met(&one, &leaning, [0.02, 0.2, 0.35]), [true; 2]);
        // They touch, but far from there.
        assert_eq!(is_met(&one, &plate(half, [0.5, 0.0, 0.0], 0.0), [0.0, 0.0, 4.0]), [false; 2]);
    }
}
