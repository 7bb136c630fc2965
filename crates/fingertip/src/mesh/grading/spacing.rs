//! How closely the skin has to be meshed under an indenter.
//!
//! A plane section pressed by a plate, bars, a punch and an edge (studies/reports/section-study.md)
//! needs a node spacing of some `0.14 sqrt(R)` mm, `R` the indenter's radius of curvature in mm,
//! for SED within 5 % at the interface. Away from what is touched spacing may grow.

use super::contact::{Contact, facing};
use crate::geometry::fingertip::FingertipShape;
use papilla_sdf::Placement;
use papilla_vector::norm;

/// How close nodes are, at one density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closeness {
    /// Spacing under a radius of 1 mm, mm; it goes with the square root of the radius.
    pub of_radius_mm: f64,
    /// Spacing under what is flat, mm.
    pub flat_mm: f64,
    /// Spacing across the edge of a contact, mm: about as close as the interface is deep, for SED
    /// peaks there in a ring.
    pub edge_mm: f64,
    /// Change of the spacing over the distance from what is touched.
    pub growth: f64,
}

/// Radius of the ball whose pressure changes as fast as a given one away from its edges, mm.
const BALL_MM: f64 = 5.0;

/// Spacing that an indentation wants on the undeformed skin.
#[derive(Clone, Debug)]
pub struct Spacing {
    touched: Vec<Touched>,
    closeness: Closeness,
}

/// A point of the skin that the indenter is going to touch.
#[derive(Clone, Copy, Debug)]
struct Touched {
    /// Undeformed, mm.
    at: [f64; 3],
    /// Second derivatives of the indenter's signed distance, 1/mm.
    hessian: [[f64; 3]; 3],
    /// Unit vector along the skin across the contact's edge, if it passes here at a stored depth.
    across_edge: Option<[f64; 3]>,
}

/// Where a contact's edge is at some depth: the undeformed skin touches after this part of it.
/// Under a ball on a thick elastic body it is a half (Hertz: `a^2 = R d`, travel `a^2 / 2R`); the
/// finger's bone and layers drive it outward.
const EDGE_TRAVEL: std::ops::Range<f64> = 0.42..0.7;

impl Spacing {
    /// For the skin that an indenter would touch on its way if nothing deformed.
    #[must_use]
    pub fn new(shape: &FingertipShape, contact: &Contact, closeness: Closeness) -> Self {
        let touched = contact.straight().flat_map(|straight| touched(shape, &straight)).collect();
        Self { touched, closeness }
    }

    /// For the skin that a given pressure presses: `pressed` says of a point of it whether the
    /// pressure's edge passes there, or `None`. Nodes are as close as at a contact's edge there, in both
    /// directions, and elsewhere as under a ball.
    #[must_use]
    pub fn of_pressure(
        shape: &FingertipShape,
        pressed: &dyn Fn([f64; 3]) -> Option<bool>,
        closeness: Closeness,
    ) -> Self {
        let Closeness { of_radius_mm, edge_mm, .. } = closeness;
        let of_edge = (of_radius_mm / edge_mm).powi(2);
        let touch = |at| {
            let curvature = if pressed(at)? { of_edge } else { 1.0 / BALL_MM };
            let hessian = std::array::from_fn(|i| {
                std::array::from_fn(|j| if i == j { curvature } else { 0.0 })
            });
            Some(Touched { at, hessian, across_edge: None })
        };
        // From below, and what the atlas shows of the sides beyond.
        let sides = [[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]];
        let is_side = |at: &[f64; 3]| shape.skin_normal(*at)[2] > 0.05;
        let beside = sides.into_iter().flat_map(|way| facing(shape, way)).filter(is_side);
        let below = facing(shape, [0.0, 0.0, 1.0]);
        Self { touched: below.chain(beside).filter_map(touch).collect(), closeness }
    }

    /// The same contact meshed more or less closely: where it touches is not looked for again.
    pub(in crate::mesh) fn with(&self, closeness: Closeness) -> Self {
        Self { touched: self.touched.clone(), closeness }
    }

    /// Spacing (mm) along a unit vector, anywhere on a cell of which some `points` (mm) are given.
    pub(in crate::mesh) fn wanted_mm(&self, points: &[[f64; 3]; 9], direction: [f64; 3]) -> f64 {
        let Closeness { of_radius_mm, flat_mm, edge_mm, growth } = self.closeness;
        let spacing = |t: &Touched| {
            let curvature: f64 = (0..3)
                .map(|i| direction[i] * (0..3).map(|j| t.hessian[i][j] * direction[j]).sum::<f64>())
                .sum();
            let across: f64 =
                t.across_edge.map_or(0.0, |n| (0..3).map(|i| n[i] * direction[i]).sum());
            let own =
                (of_radius_mm / curvature.abs().sqrt()).min(edge_mm / across.abs()).min(flat_mm);
            let away = |p: &[f64; 3]| norm(std::array::from_fn(|i| p[i] - t.at[i]));
            let distance = points.iter().map(away).fold(f64::INFINITY, f64::min);
            own + growth * distance
        };
        self.touched.iter().map(spacing).fold(f64::INFINITY, f64::min)
    }
}

/// What a straight press touches.
fn touched(shape: &FingertipShape, contact: &Contact) -> Vec<Touched> {
    let deepest_mm = contact.deepest_mm();
    let touch = |at| {
        let travel = contact.travel_mm(at, deepest_mm);
        (travel < deepest_mm).then(|| {
            let moved = Placement {
                origin_mm: std::array::from_fn(|i| {
                    contact.start.origin_mm[i] + travel * contact.direction[i]
                }),
                ..contact.start
            };
            let found = moved.distance(contact.shape.as_ref(), at);
            let is_edge = contact.depths_mm.iter().any(|d| EDGE_TRAVEL.contains(&(travel / d)));
            let across_edge =
                is_edge.then(|| along_skin(found.normal, shape.skin_normal(at))).flatten();
            Touched { at, hessian: found.hessian, across_edge }
        })
    };
    facing(shape, contact.direction).filter_map(touch).collect()
}

/// Unit vector of the part of `v` across the unit vector `normal`; `None` if there is none.
fn along_skin(v: [f64; 3], normal: [f64; 3]) -> Option<[f64; 3]> {
    let out: f64 = (0..3).map(|i| v[i] * normal[i]).sum();
    let along: [f64; 3] = std::array::from_fn(|i| v[i] - out * normal[i]);
    let size = norm(along);
    (size > 0.0).then(|| along.map(|a| a / size))
}
