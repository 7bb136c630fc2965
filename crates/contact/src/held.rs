//! Bodies that are held on the side from which they came.
//!
//! The nearest surface of a body is the one that presses only as long as the body is thick and not
//! deep. For a held body, the solver looks from a point of the skin along the way in of the body.
//! The last surface of the body on this line is its front, and only the front presses. So no force
//! pulls the skin outwards. A body that is deeper than the training data is moved back to their
//! depth.

use crate::object::{Object, local};
use papilla_sdf::{Distance, Placement, SignedDistance};
use papilla_vector::{dot, norm};

/// Distance from a surface that counts as on it, mm.
const ON_MM: f64 = 1e-3;
/// Farthest that a front is looked for, mm.
const FAR_MM: f64 = 60.0;
/// Most steps of a look.
const STEPS_MAX: u32 = 40;
/// Cosine between the way in and a surface's normal from which on the nearest surface is the front.
const FRONT: f64 = 0.7;
/// The least that counts of a front that is met at a slant.
const ALONG_MIN: f64 = 0.1;

/// How one object is held.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Held {
    /// Whether it is.
    pub is_on: bool,
    /// Unit vector, the way out.
    pub way: [f64; 3],
    /// How far it is drawn back along it, mm of the person.
    pub back_mm: f64,
    /// How much wider it is taken on all sides, mm of the person.
    pub widen_mm: f64,
}

/// What one meets on the way in.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Front {
    /// The front, so far ahead, with the cosine between the way in and its normal.
    Met { ahead_mm: f64, along: f64, normal: [f64; 3] },
    /// None: the body is passed at this distance.
    Missed { clear_mm: f64 },
}

impl Held {
    /// Distance of a place, mm of the person, from the places of an object on its way in; the normal
    /// is in the object's frame.
    pub(crate) fn distance(&self, object: &Object, p: [f64; 3]) -> Distance {
        let (p, way) = self.seen(object, p);
        let shape = object.shape.as_ref();
        let found = shape.distance(p);
        let gap_mm = found.gap_mm - self.widen_mm;
        let found = Distance { gap_mm, ..found };
        let size = norm(found.normal);
        let along = if size > 0.0 { -dot(found.normal, way) / size } else { 0.0 };
        if (gap_mm >= 0.0 && along >= 0.0) || (gap_mm < 0.0 && along > FRONT) {
            return found;
        }
        match look(shape, p, way, self.widen_mm) {
            Front::Met { ahead_mm, along, normal } => {
                Distance { gap_mm: -ahead_mm * along, normal, ..found }
            }
            // Beside the way: what is nearest there lies across it.
            Front::Missed { clear_mm } if gap_mm >= 0.0 => {
                let up = dot(found.normal, way);
                let flat: [f64; 3] = std::array::from_fn(|i| found.normal[i] - up * way[i]);
                let normal = if dot(flat, flat) > 1e-6 { flat } else { way.map(|w| -w) };
                Distance { gap_mm: clear_mm, normal, ..found }
            }
            Front::Missed { .. } => found,
        }
    }

    /// A distance that is certainly free round a place; negative on the way.
    pub(crate) fn clearance_mm(&self, object: &Object, p: [f64; 3]) -> f64 {
        match self.front(object, p) {
            Front::Met { ahead_mm, along, .. } => -ahead_mm * along,
            Front::Missed { clear_mm } => clear_mm,
        }
    }

    /// What one meets from a place of the person on the way in; the normal is in the object's frame.
    pub(crate) fn front(&self, object: &Object, p: [f64; 3]) -> Front {
        let (p, way) = self.seen(object, p);
        look(object.shape.as_ref(), p, way, self.widen_mm)
    }

    /// A place and the way out in the object's own frame.
    fn seen(&self, object: &Object, p: [f64; 3]) -> ([f64; 3], [f64; 3]) {
        let Placement { rotation: r, .. } = object.placement;
        let from = std::array::from_fn(|i| p[i] - self.back_mm * self.way[i]);
        let way = self.way;
        let turned = [0, 1, 2].map(|i| r[0][i] * way[0] + r[1][i] * way[1] + r[2][i] * way[2]);
        (local(&object.placement, from), turned)
    }
}

/// Looks from `p` against the way out: comes towards it from beyond all of the shape, by what is
/// certainly free.
fn look(shape: &dyn SignedDistance, p: [f64; 3], way: [f64; 3], widen_mm: f64) -> Front {
    let most = shape.reach_mm(way.map(|w| -w)) + dot(p, way) + widen_mm;
    let mut ahead_mm = if most < FAR_MM { most + 2.0 * ON_MM } else { FAR_MM };
    let mut clear_mm = f64::INFINITY;
    for step in 0..STEPS_MAX {
        let at = if ahead_mm > 0.0 { ahead_mm } else { 0.0 };
        let q = std::array::from_fn(|i| p[i] - at * way[i]);
        let free = shape.clearance_mm(q) - widen_mm;
        clear_mm = clear_mm.min(free);
        let is_met = free <= ON_MM || (step + 1 == STEPS_MAX && free < 10.0 * ON_MM);
        if is_met && at > 0.0 {
            let found = shape.distance(q).normal;
            let size = norm(found);
            let along = if size > 0.0 { -dot(found, way) / size } else { 1.0 };
            let is_facing = along > 0.0;
            let normal = if is_facing { found } else { way.map(|w| -w) };
            let along = if is_facing { along.max(ALONG_MIN) } else { 1.0 };
            return Front::Met { ahead_mm: at - free, along, normal };
        }
        if at == 0.0 {
            break;
        }
        ahead_mm = at - free.max(ON_MM);
    }
    Front::Missed { clear_mm }
}
