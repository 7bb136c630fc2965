//! Closed surfaces of one mesh that touch, or lie inside each other: skin inside would see faces
//! that are covered.

use super::error::MeshError;
use super::normal;
use super::tree::Tree;
use super::work::Work;
use crate::beneath::SEAM_MM;
use papilla_vector::{cross, dot, minus, scaled_to_one};

/// Least cosine between normals of faces that lie upon each other.
const PARALLEL: f64 = 1.0 - 1e-9;
/// How far faces may lie in each other and still only touch, mm.
const ROUNDING_MM: f64 = 1e-5;
/// Least overlap of faces that lie upon each other, mm.
const OVERLAP_MM: f64 = 1e-6;
/// Triangles of a body that are asked whether it lies in another: none has fewer than four.
const VOTES: i32 = 3;

/// Two triangles that lie upon each other, face to face or twice at the same place.
pub(super) fn lying_upon(
    places: &[[[f64; 3]; 3]],
    tree: &Tree,
    work: &mut Work<'_>,
) -> Result<Option<[usize; 2]>, MeshError> {
    let normals: Vec<_> = places.iter().map(|place| scaled_to_one(normal(*place))).collect();
    for (own, place) in places.iter().enumerate() {
        let bound = |pick: fn(f64, f64) -> f64, wider: f64| {
            [0, 1, 2].map(|i| pick(pick(place[0][i], place[1][i]), place[2][i]) + wider)
        };
        let bounds = [bound(f64::min, -SEAM_MM), bound(f64::max, SEAM_MM)];
        let found = tree.find(bounds, work, |other| {
            if other <= own {
                return None;
            }
            let along = dot(normals[own], normals[other]);
            let above = dot(minus(places[other][0], place[0]), normals[own]);
            let faces = along < -PARALLEL && (-ROUNDING_MM..SEAM_MM).contains(&above);
            let doubled = along > PARALLEL && above.abs() < ROUNDING_MM;
            let upon = (faces || doubled) && overlap(place, &places[other], normals[own]);
            upon.then_some([own, other])
        })?;
        if found.is_some() {
            return Ok(found);
        }
    }
    Ok(None)
}

/// Whether two triangles, seen along a normal of both, have some area in common: no edge of
/// either has the other on its far side.
fn overlap(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3], n: [f64; 3]) -> bool {
    let separates = |of: &[[f64; 3]; 3]| {
        (0..3).any(|k| {
            let axis = scaled_to_one(cross(minus(of[(k + 1) % 3], of[k]), n));
            let ends = |t: &[[f64; 3]; 3]| {
                let at = t.map(|p| dot(minus(p, of[k]), axis));
                (at[0].min(at[1]).min(at[2]), at[0].max(at[1]).max(at[2]))
            };
            let (of_a, of_b) = (ends(a), ends(b));
            of_a.1.min(of_b.1) - of_a.0.max(of_b.0) < OVERLAP_MM
        })
    };
    !separates(a) && !separates(b)
}

/// A triangle of a closed surface that lies inside of another body, or of a cavity that lies in
/// none.
///
/// Each body is asked at three of its triangles, since they do not cross: a ray along x counts the
/// other surfaces that it leaves less those that it enters. A ray that meets an edge may miscount.
pub(super) fn covered(
    beside: &[[usize; 3]],
    places: &[[[f64; 3]; 3]],
    tree: &Tree,
    work: &mut Work<'_>,
) -> Result<Option<usize>, MeshError> {
    let (shell, count) = shells(beside);
    if count == 1 {
        return Ok(None);
    }
    let mut volume = vec![0.0; count];
    for (place, of) in places.iter().zip(&shell) {
        volume[*of] += dot(place[0], cross(place[1], place[2]));
    }
    let far = places.iter().flatten().map(|p| p[0]).fold(f64::NEG_INFINITY, f64::max);
    let (mut asked, mut wrong) = (vec![0; count], vec![0; count]);
    for (triangle, place) in places.iter().enumerate() {
        let of = shell[triangle];
        if asked[of] == VOTES {
            continue;
        }
        asked[of] += 1;
        // No corner, no middle: those of others often lie in the same line.
        let [u, v, w] = [0.351, 0.423, 0.226];
        let from: [f64; 3] =
            std::array::from_fn(|i| u * place[0][i] + v * place[1][i] + w * place[2][i]);
        let mut turns = 0i32;
        tree.find([from, [far, from[1], from[2]]], work, |other| {
            if shell[other] != of {
                turns += passes(from, &places[other]);
            }
            None::<()>
        })?;
        wrong[of] += i32::from(turns != i32::from(volume[of] < 0.0));
        if wrong[of] == VOTES {
            return Ok(Some(triangle));
        }
    }
    Ok(None)
}

/// The surface of each triangle, and how many there are.
fn shells(beside: &[[usize; 3]]) -> (Vec<usize>, usize) {
    let mut shell = vec![usize::MAX; beside.len()];
    let (mut count, mut open) = (0, Vec::new());
    for first in 0..beside.len() {
        if shell[first] != usize::MAX {
            continue;
        }
        open.push(first);
        shell[first] = count;
        while let Some(triangle) = open.pop() {
            for &other in &beside[triangle] {
                if shell[other] == usize::MAX {
                    shell[other] = count;
                    open.push(other);
                }
            }
        }
        count += 1;
    }
    (shell, count)
}

/// 1 if the ray from a place along x leaves a body through the triangle, -1 if it enters one.
fn passes(from: [f64; 3], place: &[[f64; 3]; 3]) -> i32 {
    let [a, b, c] = place.map(|p| [p[1] - from[1], p[2] - from[2]]);
    let turn = |p: [f64; 2], q: [f64; 2]| p[0] * q[1] - p[1] * q[0];
    let sides = [turn(b, c), turn(c, a), turn(a, b)];
    let total: f64 = sides.iter().sum();
    let within = sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0);
    let x: f64 = (0..3).map(|k| sides[k] * place[k][0]).sum::<f64>() / total;
    if !within || x <= from[0] {
        0
    } else if total > 0.0 {
        1
    } else {
        -1
    }
}
