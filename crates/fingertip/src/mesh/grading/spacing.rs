//! How densely the skin has to be meshed under an indenter.
//!
//! A plane section pressed by a plate, bars, a punch and an edge (docs/concepts/accuracy.md) needs
//! a node spacing of some `0.14 sqrt(R)` mm, `R` the indenter's radius of curvature in mm, for SED within 5 % at the
//! interface, and no more than some .35 mm under what is flat.

use super::REACH_MM;
use super::contact::{Contact, facing};
use crate::geometry::fingertip::FingertipShape;
use papilla_sdf::Placement;

/// Spacing under a radius of 1 mm, mm; it goes with the square root of the radius.
const SPACING_OF_RADIUS: f64 = 0.14;
/// Spacing under what is flat, mm.
const SPACING_FLAT_MM: f64 = 0.36;
/// Spacing far from the contact, mm.
const SPACING_FAR_MM: f64 = 1.6;
/// Change of the spacing over the distance along the skin.
const GROWTH: f64 = 0.3;
/// Cell of a line on which spacing is tabulated, mm.
const CELL_MM: f64 = 0.04;

/// A point of the skin that the indenter is going to touch.
pub(super) struct Touched {
    /// Undeformed, mm.
    pub at: [f64; 3],
    /// Wanted spacing along the indenter's x and y, mm.
    pub spacing_mm: [f64; 2],
}

/// The skin that the indenter touches on its way if nothing deforms; `axes` are the indenter's x
/// and y.
pub(super) fn touched(
    shape: &FingertipShape,
    contact: &Contact,
    axes: [[f64; 3]; 2],
) -> Vec<Touched> {
    facing(shape, contact.direction)
        .filter_map(|at| {
            let t = contact.travel_mm(at, contact.depth_mm);
            (t < contact.depth_mm).then(|| {
                let moved = Placement {
                    origin_mm: std::array::from_fn(|i| {
                        contact.start.origin_mm[i] + t * contact.direction[i]
                    }),
                    ..contact.start
                };
                let hessian = moved.distance(contact.shape.as_ref(), at).hessian;
                let spacing_mm = axes.map(|a| {
                    let curvature: f64 = (0..3)
                        .map(|i| a[i] * (0..3).map(|j| hessian[i][j] * a[j]).sum::<f64>())
                        .sum();
                    let radius = 1.0 / curvature.abs().max(1e-9);
                    (SPACING_OF_RADIUS * radius.sqrt()).min(SPACING_FLAT_MM)
                });
                Touched { at, spacing_mm }
            })
        })
        .collect()
}

/// Spacing on the line `[-reach, reach]` from that of points on it: the least around each place,
/// growing from there.
pub(super) fn along(points: impl Iterator<Item = (f64, f64)>) -> Vec<f64> {
    let count = (2.0 * REACH_MM / CELL_MM).round() as usize;
    let cell = 2.0 * REACH_MM / count as f64;
    let mut spacing = vec![SPACING_FAR_MM; count];
    for (x, h) in points {
        let k = (x + REACH_MM) / cell;
        if k >= 0.0 && k < count as f64 {
            let k = k as usize;
            spacing[k] = spacing[k].min(h);
        }
    }
    super::line::limit_growth(&mut spacing, cell, GROWTH);
    spacing
}
