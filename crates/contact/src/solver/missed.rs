//! Bodies in the finger that nothing was found to press by: narrow ones between vertices or pixels, and
//! all in the finger's back, of which the model has no skin.

use super::Solver;
use crate::answer::{Contact, Effort};
use crate::back::Back;
use crate::object::Object;
use crate::objects::{Things, View};
use papilla_vector::dot;

/// Deeper than this between vertices a body presses, reference mm. A ball of 2 mm lies less deep there
/// when it meets the first vertex.
const BETWEEN_MM: f64 = 0.08;
/// So far beneath a vertex' tangent plane, and nearer to the vertex than candidates are, lies the inside
/// of a finger, reference mm.
const BENEATH_MM: f64 = 0.1;
/// Nearer than this a place is in a body, reference mm.
const ON_MM: f64 = 0.02;
/// Deeper than this in the finger's back a body presses there, reference mm.
const BACK_MM: f64 = 0.5;

impl Solver {
    /// Tells of bodies that lie in the finger where nothing was found to press; `is_met`: something was.
    pub(crate) fn tell_missed(&self, view: View<'_>, is_met: bool, out: &mut Contact) {
        let Things::Objects(objects) = view.things else { return };
        let effort = &mut out.effort;
        let is_missed = (!is_met
            && (out.quality.is_held || self.is_between(view, objects, effort)))
            || objects.iter().any(|object| self.is_in_back(view, object, effort));
        out.quality.is_missed = is_missed;
        out.quality.out_of_range |= is_missed;
    }

    /// Whether a body lies between the vertices that are near it.
    fn is_between(&self, view: View<'_>, objects: &[Object], effort: &mut Effort) -> bool {
        let model = &*self.model;
        let is_in = |at_mm: [f64; 3], most_mm: f64, effort: &mut Effort| {
            view.count(1, effort);
            let seen = view.seen(at_mm);
            let clear = |o: &Object| o.placement.clearance_mm(o.shape.as_ref(), seen);
            objects.iter().any(|o| clear(o) <= view.length * most_mm)
                && view.nearest_at(at_mm).is_some_and(|nearest| nearest.gap_mm <= most_mm)
        };
        self.candidates.iter().any(|(_, vertex)| {
            if view.is_spent(effort) {
                return true;
            }
            let at = model.positions_mm[*vertex as usize];
            let skin = model.normals[*vertex as usize].map(f64::from);
            let nearest = view.nearest(model, *vertex as usize, [0.0; 3]);
            view.count(1, effort);
            let on: [f64; 3] = std::array::from_fn(|i| at[i] - nearest.gap_mm * nearest.normal[i]);
            let beneath_mm = nearest.gap_mm * dot(nearest.normal, skin);
            // Where the body is nearest, but in the finger.
            let to = beneath_mm - 2.0 * BENEATH_MM;
            let there: [f64; 3] = std::array::from_fn(|i| on[i] + to * skin[i]);
            let is_inside = nearest.gap_mm < -BETWEEN_MM || beneath_mm > BENEATH_MM;
            (is_inside && model.is_between_ends(on))
                || (model.is_between_ends(there) && is_in(there, ON_MM, effort))
                || model.beside(*vertex).any(|place| is_in(place, -BETWEEN_MM, effort))
        })
    }

    /// Whether a body lies in the finger's back.
    fn is_in_back(&self, view: View<'_>, object: &Object, effort: &mut Effort) -> bool {
        let shape = object.shape.as_ref();
        let Back { places_mm, clusters } = &self.model.back;
        let clear = |at| object.placement.clearance_mm(shape, view.seen(at)) / view.length;
        let (mut is_in, mut more) = (false, 0);
        let asked = clusters.near(-BACK_MM, clear, |place| {
            if !is_in {
                more += 1;
                let at = view.seen(places_mm[place as usize]);
                is_in = object.placement.distance(shape, at).gap_mm < -BACK_MM * view.length;
            }
        });
        view.only(std::slice::from_ref(object)).count(asked + more, effort);
        is_in
    }
}
