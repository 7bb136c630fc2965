//! Corner angles of triangles in space.

use super::FlattenError;
use papilla_vector::{cross, dot, minus, norm};

/// Smallest angle that still counts as a triangle, rad.
const ANGLE_RAD_MIN: f64 = 1e-4;

/// The three corner angles of each triangle, rad, in the order of its vertices.
pub(super) fn corner_angles(
    positions: &[[f64; 3]],
    triangles: &[[usize; 3]],
) -> Result<Vec<[f64; 3]>, FlattenError> {
    let mut angles = Vec::with_capacity(triangles.len());
    for (triangle, corners) in triangles.iter().enumerate() {
        let p = corners.map(|vertex| positions[vertex]);
        let corner = |k: usize| angle(p[k], p[(k + 1) % 3], p[(k + 2) % 3]);
        let three = [corner(0), corner(1), corner(2)];
        let angle_rad = three.iter().copied().fold(f64::INFINITY, f64::min);
        if angle_rad < ANGLE_RAD_MIN || three.iter().any(|angle| !angle.is_finite()) {
            return Err(FlattenError::Degenerate { triangle, angle_rad });
        }
        angles.push(three);
    }
    Ok(angles)
}

fn angle(at: [f64; 3], to: [f64; 3], other: [f64; 3]) -> f64 {
    let (a, b) = (minus(to, at), minus(other, at));
    norm(cross(a, b)).atan2(dot(a, b))
}

/// Area of a triangle in space.
pub(super) fn area(p: [[f64; 3]; 3]) -> f64 {
    0.5 * norm(doubled_area_vector(p))
}

/// Normal of a triangle in space, as long as twice its area.
pub(super) fn doubled_area_vector(p: [[f64; 3]; 3]) -> [f64; 3] {
    cross(minus(p[1], p[0]), minus(p[2], p[0]))
}

/// Signed area of a triangle in the plane, positive counter-clockwise.
pub(super) fn plane_area([a, b, c]: [[f64; 2]; 3]) -> f64 {
    0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
}
