//! Where an indenter first touches.

use super::{Placement, SignedDistance};

/// Least step of the search, mm: what is thinner along the way may be missed.
const STEP_MIN_MM: f64 = 1e-4;
/// Farthest that is looked, mm beyond the points.
const LOOK_MAX_MM: f64 = 1000.0;
/// Part of the size of things that counts as rounding.
const ROUNDING: f64 = 1e-13;
/// Part of the size of things that counts as inside.
const INSIDE: f64 = 1e-10;

/// Why an indenter does not come to a first touch.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TouchError {
    /// It goes by.
    #[error("the indenter never meets the points on its way")]
    NeverTouches,
    /// It has a point inside before it moves.
    #[error("the indenter starts with a point {by_mm:.3e} mm inside")]
    StartsInside {
        /// How deep, mm.
        by_mm: f64,
    },
}

/// How far an indenter can travel from `placement` along the unit vector `direction` until it
/// touches the first of `points`, mm. Exactly 0 for a touch to rounding.
///
/// Each point is traced through the shape in steps as long as its clearance
/// (sphere tracing), which cannot step over anything, until it is within rounding; where
/// clearance gets small without a touch, or the step crosses the surface, the least
/// step and bisection take over. The shape need not be convex.
///
/// # Errors
/// [`TouchError::StartsInside`] if a point is in the shape already,
/// [`TouchError::NeverTouches`] if it passes all of them.
pub fn first_touch_travel(
    shape: &dyn SignedDistance,
    placement: &Placement,
    direction: [f64; 3],
    points: &[[f64; 3]],
) -> Result<f64, TouchError> {
    let along = |p: &[f64; 3]| (0..3).map(|i| p[i] * direction[i]).sum::<f64>();
    let size =
        |p: &[f64; 3]| (0..3).map(|i| (p[i] - placement.origin_mm[i]).powi(2)).sum::<f64>().sqrt();
    let scale = points.iter().map(size).fold(0.0, f64::max);
    let hind = placement.reach_mm(shape, direction.map(|v| -v));
    let look = scale + LOOK_MAX_MM;
    let mut first = f64::INFINITY;
    let mut inside = 0.0f64;
    for p in points {
        let clearance = |travel: f64| {
            placement.clearance_mm(shape, std::array::from_fn(|i| p[i] - travel * direction[i]))
        };
        inside = inside.max(-clearance(0.0));
        // Beyond this travel the whole shape is past the point.
        let end = (along(p) + hind).min(look).min(first);
        if let Some(travel) = touch(&clearance, end, ROUNDING * scale) {
            first = first.min(travel);
        }
    }
    if inside > INSIDE * scale {
        return Err(TouchError::StartsInside { by_mm: inside });
    }
    if first.is_finite() { Ok(first) } else { Err(TouchError::NeverTouches) }
}

/// Smallest travel up to `end` at which there is no clearance, to `rounding`.
fn touch(clearance: &dyn Fn(f64) -> f64, end: f64, rounding: f64) -> Option<f64> {
    let mut travel = 0.0;
    let mut free = clearance(travel);
    while free > rounding {
        let next = travel + free.max(STEP_MIN_MM);
        let then = clearance(next);
        if then < 0.0 {
            return Some(bisect(clearance, travel, next)).filter(|t| *t <= end);
        }
        if next > end {
            return None;
        }
        (travel, free) = (next, then);
    }
    Some(travel).filter(|t| *t <= end)
}

/// The change of sign between a travel that is free and one that is not.
fn bisect(clearance: &dyn Fn(f64) -> f64, mut free: f64, mut taken: f64) -> f64 {
    loop {
        let middle = 0.5 * (free + taken);
        if middle <= free || middle >= taken {
            return free;
        }
        if clearance(middle) < 0.0 { taken = middle } else { free = middle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Cylinder, Dots, Grating, IndenterSpec, Ring, RoundedPlate, Sphere};

    const UP: [f64; 3] = [0.0, 0.0, 1.0];

    fn below(depth: f64) -> Placement {
        Placement::turned(0.0, 0.0, 0.0, [0.0, 0.0, -depth])
    }

    #[test]
    fn a_sphere_meets_an_offset_point_on_its_flank() {
        let sphere = Sphere { radius_mm: 5.0 };
        // Point 3 aside: the sphere's surface is 4 above its centre there.
        let travel =
            first_touch_travel(&sphere, &below(10.0), UP, &[[3.0, 0.0, 0.0], [0.0, 4.9, 3.0]]);
        assert!((travel.unwrap() - 6.0).abs() < 1e-12);
    }

    #[test]
    fn a_shape_with_a_hole_lets_a_point_pass() {
        // A thin ring seen from its end: the axis is free for good.
        let ring = Ring { height_mm: 2.0, ..Ring::default() };
        let error = first_touch_travel(&ring, &below(3.0), UP, &[[0.0, 0.0, 0.0]]).unwrap_err();
        assert_eq!(error, TouchError::NeverTouches);
        let travel =
            first_touch_travel(&ring, &below(3.0), UP, &[[0.0, 0.0, 0.0], [3.5, 0.0, 1.0]]);
        assert!((travel.unwrap() - 4.0).abs() < 1e-12);
        let far = first_touch_travel(&ring, &below(3.0), UP, &[[50.0, 0.0, 0.0]]).unwrap_err();
        assert_eq!(far, TouchError::NeverTouches);
    }

    #[test]
    fn grooves_are_entered() {
        let grating = Grating::default();
        // A point over a groove goes down to its floor, one over a ridge to its top.
        let over =
            |x: f64| first_touch_travel(&grating, &below(1.0), UP, &[[x, 0.0, 0.0]]).unwrap();
        assert!((over(1.5) - 2.5).abs() < 1e-12);
        assert!((over(3.0) - 1.0).abs() < 1e-12);
        let dot = first_touch_travel(&Dots::default(), &below(1.0), UP, &[[0.0, 1.17, 0.0]]);
        assert!((dot.unwrap() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn grazing_is_no_endless_loop_and_no_touch() {
        // A point that slides past the cylinder's side a hair's breadth away.
        let cylinder = Cylinder { radius_mm: 3.0, length_mm: 400.0, end_radius_mm: 1.0 };
        let along_y = [0.0, 1.0, 0.0];
        let start = Placement::turned(0.0, 0.0, 0.0, [0.0, -300.0, 0.0]);
        let hair = [0.0, 0.0, 3.0 + 1e-7];
        assert!(first_touch_travel(&cylinder, &start, along_y, &[hair]).is_err());
        let touching = first_touch_travel(&cylinder, &start, along_y, &[[0.0, 0.0, 2.99]]).unwrap();
        assert!((99.0..101.0).contains(&touching), "{touching}");
    }

    #[test]
    fn a_touch_to_rounding_is_none_at_all() {
        let plate = RoundedPlate { half_mm: [10.0, 10.0, 3.0], edge_radius_mm: 1.0 };
        for turn in [0.0, 13.7, 31.1] {
            let place = Placement::turned(turn, 0.5 * turn, 0.0, [0.3, 0.7, 0.1]);
            let r = place.rotation;
            let normal = [r[0][2], r[1][2], r[2][2]];
            let face: [f64; 3] =
                std::array::from_fn(|i| place.origin_mm[i] + 3.0 * normal[i] + 0.7 * r[i][0]);
            let travel = first_touch_travel(&plate, &place, normal, &[face]).unwrap();
            assert_eq!(travel.to_bits(), 0f64.to_bits());
        }
    }

    #[test]
    fn starting_inside_is_an_error() {
        let shape = IndenterSpec::default().build(std::path::Path::new("")).unwrap();
        let error =
            first_touch_travel(shape.as_ref(), &below(1.0), UP, &[[0.0, 0.0, 1.5]]).unwrap_err();
        assert!(matches!(error, TouchError::StartsInside { by_mm } if (by_mm - 0.5).abs() < 1e-9));
    }
}
