//! The points at which every mesh is read.

use super::{Case, ConvergenceError};
use papilla_fingertip::geometry::fingertip::FingertipShape;
use papilla_fingertip::mesh::grading::Contact;
use papilla_fingertip::simulation::drive::{Approach, Drive};
use papilla_sdf::IndenterSpec;
use papilla_vector::norm;

/// Half of the side of the square around the first touch that is read, mm.
const HALF_MM: f64 = 7.0;
/// Distance of the points, mm.
const SPACING_MM: f64 = 0.1;

/// Undeformed points of the default finger around a case's first touch.
pub(super) struct Target {
    pub finger: FingertipShape,
    pub indenter: IndenterSpec,
    pub contact: Contact,
    /// Place of each along the indenter's x and y from the first touch, mm.
    pub place_mm: Vec<[f64; 2]>,
    /// On the skin, mm.
    pub skin: Vec<[f64; 3]>,
    /// On the dermis-epidermis interface below each, mm.
    pub interface: Vec<[f64; 3]>,
}

impl Target {
    pub(super) fn new(case: &Case) -> Result<Self, ConvergenceError> {
        let finger = FingertipShape::default();
        let describe = |why: String| ConvergenceError::Description { case: case.name, why };
        let indenter = case.indenter().map_err(|e| describe(e.to_string()))?;
        let motion = case.motion(1);
        let approach = Approach::straight(&indenter, motion.pose())
            .map_err(|source| ConvergenceError::Indenter { case: case.name, source })?;
        let depths = Drive::Depths(motion.depth_mm.into_iter().collect());
        let contact = approach
            .contact_with(&finger, &depths)
            .ok_or_else(|| describe("the indenter passes the finger".into()))?;
        let (place_mm, skin, interface) = points(&finger, &contact).map_err(|source| {
            ConvergenceError::Case { case: case.name, source: Box::new(source.into()) }
        })?;
        Ok(Self { finger, indenter, contact, place_mm, skin, interface })
    }
}

type Points = (Vec<[f64; 2]>, Vec<[f64; 3]>, Vec<[f64; 3]>);

/// A square grid across the indenter's axes, projected onto the skin; and the interface below.
fn points(
    finger: &FingertipShape,
    contact: &Contact,
) -> Result<Points, papilla_fingertip::geometry::fingertip::FingertipShapeError> {
    let r = contact.start.rotation;
    let axis = |k: usize| [r[0][k], r[1][k], r[2][k]];
    let (x, y) = (axis(0), axis(1));
    let count = (HALF_MM / SPACING_MM).round() as i32;
    let (mut place, mut skin, mut interface) = (Vec::new(), Vec::new(), Vec::new());
    for i in -count..=count {
        for j in -count..=count {
            let (a, b) = (SPACING_MM * f64::from(i), SPACING_MM * f64::from(j));
            let p = std::array::from_fn(|k| contact.first[k] + a * x[k] + b * y[k]);
            let parameter = finger.parameter_of(p);
            let on = finger.skin(parameter);
            // Neither past the end of the finger nor round its sides.
            let moved: [f64; 3] = std::array::from_fn(|k| on[k] - p[k]);
            if on[0] < finger.length_mm - 1.0 && norm(moved) < 3.0 {
                place.push([a, b]);
                skin.push(on);
                interface.push(finger.layers(parameter)?[1]);
            }
        }
    }
    Ok((place, skin, interface))
}
