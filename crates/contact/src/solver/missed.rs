//! Bodies in the finger that nothing was found to press by: narrow ones between vertices or pixels, and
//! all in the finger's back, of which the model has no skin; and bodies of which much lies between vertices.

use super::Solver;
use crate::answer::{Contact, Effort};
use crate::back::Back;
use crate::ladder::Method;
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
/// Most of a dent that things may take up between vertices. Where it is a tenth, forces are 20 % too small,
/// where it is twice as much 40 % (training simulations of `heldout`, `broad` and `more`).
const LEFT_MAX: f64 = 0.15;

impl Solver {
    /// Tells of bodies that lie in the finger where nothing was found to press; `is_met`: something was.
    pub(crate) fn tell_missed(&self, view: View<'_>, is_met: bool, out: &mut Contact) {
        let Things::Objects(objects) = view.things else { return };
        let effort = &mut out.effort;
        let is_missed = (!is_met
            && (out.quality.is_held || self.is_between(view, objects, effort)))
            || objects.iter().any(|object| self.is_in_back(view, object, effort));
        out.quality.is_missed = is_missed;
        let is_dented = is_met && !self.sides.fine && self.settings.method != Method::Springs;
        let is_fine = is_dented && self.left_between(self.held(view), effort) > LEFT_MAX;
        out.quality.out_of_range |= is_missed || is_fine;
    }

    /// By how much things lie in the skin between its vertices, as a part of how far that moved: by area, at
    /// the middles of triangles of which a corner can carry force.
    fn left_between(&self, view: View<'_>, effort: &mut Effort) -> f64 {
        let Self { model, patch, .. } = self;
        let (mut left, mut dent, mut asked) = (0.0, 0.0, 0);
        for slot in 0..patch.near() {
            for &triangle in &model.around[patch.vertices()[slot] as usize] {
                let corners = model.triangles[triangle as usize];
                let [Some(a), Some(b), Some(c)] = corners.map(|corner| patch.slot(corner)) else {
                    continue;
                };
                // At the first of its corners.
                if a.min(b).min(c) < slot {
                    continue;
                }
                let rest = corners.map(|corner| model.positions_mm[corner as usize]);
                let moved = patch.values.moved.each_ref().map(|m| f64::from(m[a] + m[b] + m[c]));
                let middle = |i: usize| (rest[0][i] + rest[1][i] + rest[2][i] + moved[i]) / 3.0;
                let Some(nearest) = view.nearest_at([0, 1, 2].map(middle)) else { return 0.0 };
                asked += 1;
                let area = f64::from(model.slopes[triangle as usize].area_mm2);
                left += area * (-nearest.gap_mm).max(0.0);
                dent += area * dot(moved, moved).sqrt() / 3.0;
            }
        }
        view.count(asked, effort);
        if dent > 0.0 { left / dent } else { 0.0 }
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
