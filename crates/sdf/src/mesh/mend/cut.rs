//! Triangles in pieces, none of which another triangle crosses.

use super::super::error::MeshError;
use super::super::tree::Tree;
use super::super::work::Work;
use super::super::{TRIANGLES_MAX, normal};
use crate::beneath::SEAM_MM;
use papilla_vector::{cross, dot, minus, norm, scaled_to_one};

/// Most pieces of all triangles.
const PIECES_MAX: usize = 4 * TRIANGLES_MAX;
/// Lengths below this are rounding, mm.
const ROUNDING_MM: f64 = 1e-7;
/// Least cosine between the normals of triangles that lie in each other's plane.
const PARALLEL: f64 = 1.0 - 1e-9;

/// A convex part of a triangle.
pub(super) struct Piece {
    /// The triangle.
    pub(super) of: usize,
    pub(super) corners_mm: Vec<[f64; 3]>,
}

/// All triangles in pieces; one that nothing crosses is a piece of its own.
pub(super) fn pieces(
    places: &[[[f64; 3]; 3]],
    tree: &Tree,
    work: &mut Work<'_>,
) -> Result<Vec<Piece>, MeshError> {
    let mut all = Vec::with_capacity(places.len());
    let mut segments = Vec::new();
    for (of, place) in places.iter().enumerate() {
        let n = scaled_to_one(normal(*place));
        let bound = |pick: fn(f64, f64) -> f64, wider: f64| {
            [0, 1, 2].map(|i| pick(pick(place[0][i], place[1][i]), place[2][i]) + wider)
        };
        let bounds = [bound(f64::min, -SEAM_MM), bound(f64::max, SEAM_MM)];
        segments.clear();
        tree.find(bounds, work, |other| {
            if other != of {
                crossings(place, n, &places[other], &mut segments);
            }
            None::<()>
        })?;
        let first = all.len();
        all.push(Piece { of, corners_mm: place.to_vec() });
        for segment in &segments {
            work.spend((all.len() - first) as u64)?;
            for at in first..all.len() {
                if let Some([one, other]) = cut(&all[at].corners_mm, *segment, n) {
                    all[at].corners_mm = one;
                    all.push(Piece { of, corners_mm: other });
                }
            }
            if all.len() > PIECES_MAX {
                return Err(MeshError::TooTangled { most: PIECES_MAX as u64 });
            }
        }
    }
    Ok(all)
}

/// Where another triangle meets the plane of one: a segment, or its edges if it lies in the plane.
fn crossings(
    place: &[[f64; 3]; 3],
    n: [f64; 3],
    other: &[[f64; 3]; 3],
    segments: &mut Vec<[[f64; 3]; 2]>,
) {
    let above = other.map(|p| dot(minus(p, place[0]), n));
    let along = dot(n, scaled_to_one(normal(*other)));
    if along.abs() > PARALLEL {
        if above.iter().all(|d| d.abs() < SEAM_MM) {
            segments.extend((0..3).map(|k| [other[k], other[(k + 1) % 3]]));
        }
        return;
    }
    let mut ends: [[f64; 3]; 3] = [[0.0; 3]; 3];
    let mut count = 0;
    for k in 0..3 {
        let [(p, d), (q, e)] = [k, (k + 1) % 3].map(|i| (other[i], above[i]));
        let found = if d.abs() <= ROUNDING_MM {
            p
        } else if e.abs() > ROUNDING_MM && (d > 0.0) != (e > 0.0) {
            std::array::from_fn(|i| p[i] + d / (d - e) * (q[i] - p[i]))
        } else {
            continue;
        };
        ends[count] = found;
        count += 1;
    }
    if count == 2 {
        segments.push([ends[0], ends[1]]);
    }
}

/// A convex polygon in two by the line of a segment, if that passes through its inside.
fn cut(polygon: &[[f64; 3]], [from, to]: [[f64; 3]; 2], n: [f64; 3]) -> Option<[Vec<[f64; 3]>; 2]> {
    let way = minus(to, from);
    let length = norm(way);
    if !(length > ROUNDING_MM) {
        return None;
    }
    let across = scaled_to_one(cross(n, way));
    let sides: Vec<f64> = polygon.iter().map(|p| dot(minus(*p, from), across)).collect();
    let (low, high) = sides.iter().fold((0.0f64, 0.0f64), |(l, h), s| (l.min(*s), h.max(*s)));
    let straddles = low < -ROUNDING_MM && high > ROUNDING_MM;
    if !straddles || !passes(polygon, from, way, n) {
        return None;
    }
    let part = |sign: f64| {
        let mut corners = Vec::with_capacity(polygon.len() + 1);
        for k in 0..polygon.len() {
            let next = (k + 1) % polygon.len();
            let [s, t] = [sign * sides[k], sign * sides[next]];
            if s >= -ROUNDING_MM {
                corners.push(polygon[k]);
            }
            if s.abs() > ROUNDING_MM && t.abs() > ROUNDING_MM && (s > 0.0) != (t > 0.0) {
                // From the same end on both sides, so that both have the same corner.
                let [(p, d), (q, e)] = if sign * s > 0.0 {
                    [(polygon[k], s), (polygon[next], t)]
                } else {
                    [(polygon[next], t), (polygon[k], s)]
                };
                corners.push(std::array::from_fn(|i| p[i] + d / (d - e) * (q[i] - p[i])));
            }
        }
        corners
    };
    Some([part(1.0), part(-1.0)])
}

/// Whether a segment in the plane of a convex polygon lies inside of it for some length.
fn passes(polygon: &[[f64; 3]], from: [f64; 3], way: [f64; 3], n: [f64; 3]) -> bool {
    let (mut low, mut high) = (0.0f64, 1.0f64);
    for (k, p) in polygon.iter().enumerate() {
        let inward = scaled_to_one(cross(n, minus(polygon[(k + 1) % polygon.len()], *p)));
        let (start, slope) = (dot(minus(from, *p), inward), dot(way, inward));
        if slope.abs() <= 1e-15 {
            if start <= 0.0 {
                return false;
            }
        } else if slope > 0.0 {
            low = low.max(-start / slope);
        } else {
            high = high.min(-start / slope);
        }
    }
    (high - low) * norm(way) > ROUNDING_MM
}
