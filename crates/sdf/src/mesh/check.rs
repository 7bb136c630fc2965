//! What a mesh has to be, to have an inside.

use super::error::MeshError;
use super::shells::{covered, lying_upon};
use super::tree::Tree;
use super::work::Work;
use super::{Mesh, TRIANGLES_MAX, normal, square};
use crate::rules::LENGTH_MAX_MM;
use papilla_vector::{cross, dot, minus, scaled_to_one};
use std::collections::HashMap;

/// Least height of a triangle over its longest edge.
const FLAT: f64 = 1e-6;
/// Least cosine between neighbours' normals: below it one lies folded upon the other.
const FOLDED: f64 = -1.0 + 1e-9;

/// A mesh that has an inside; corners at the same place are one.
pub(super) struct Checked {
    pub(super) corners_mm: Vec<[f64; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) tree: Tree,
}

/// The same of a mesh that need not bound a body: triangles without area are left out, nothing else
/// is looked at.
pub(super) fn unchecked(mesh: &Mesh) -> Result<Checked, MeshError> {
    let (corners_mm, mut triangles) = welded(mesh)?;
    triangles.retain(|t| square(normal(t.map(|c| corners_mm[c as usize]))) > 0.0);
    if triangles.is_empty() {
        return Err(MeshError::Count { found: 0 });
    }
    let places: Vec<_> =
        triangles.iter().map(|t: &[u32; 3]| t.map(|c| corners_mm[c as usize])).collect();
    let tree = Tree::new(&places);
    Ok(Checked { corners_mm, triangles, tree })
}

/// Checks it for as long as `go_on` says so, which is asked now and then.
pub(super) fn checked(mesh: &Mesh, go_on: &dyn Fn() -> bool) -> Result<Checked, MeshError> {
    let found = mesh.triangles.len();
    if !(4..=TRIANGLES_MAX).contains(&found) {
        return Err(MeshError::Count { found });
    }
    let far = |p: &[f64; 3]| !p.iter().all(|v| v.abs() <= LENGTH_MAX_MM);
    if let Some(vertex) = mesh.vertices_mm.iter().position(far) {
        return Err(MeshError::Vertex { vertex });
    }
    let (corners_mm, triangles) = welded(mesh)?;
    let places: Vec<_> =
        triangles.iter().map(|t: &[u32; 3]| t.map(|c| corners_mm[c as usize])).collect();
    for (triangle, place) in places.iter().enumerate() {
        let longest =
            (0..3).map(|k| square(minus(place[k], place[(k + 1) % 3]))).fold(0.0, f64::max);
        if !(square(normal(*place)).sqrt() > FLAT * longest) {
            return Err(MeshError::Flat { triangle });
        }
    }
    let tree = Tree::new(&places);
    let beside = neighbours(&triangles)?;
    for (triangle, others) in beside.iter().enumerate() {
        for &other in others {
            let [a, b] = [triangle, other].map(|t| scaled_to_one(normal(places[t])));
            if dot(a, b) < FOLDED {
                return Err(MeshError::Crossing { pair: [triangle, other] });
            }
        }
    }
    let mut work = Work::new(found, go_on);
    if let Some(pair) = crossing(&triangles, &places, &tree, &mut work)? {
        return Err(MeshError::Crossing { pair });
    }
    let volume: f64 = places.iter().map(|[a, b, c]| dot(*a, cross(*b, *c))).sum();
    if volume <= 0.0 {
        return Err(MeshError::InsideOut);
    }
    if let Some(pair) = lying_upon(&places, &tree, &mut work)? {
        return Err(MeshError::Touching { pair });
    }
    if let Some(triangle) = covered(&beside, &places, &tree, &mut work)? {
        return Err(MeshError::Nested { triangle });
    }
    Ok(Checked { corners_mm, triangles, tree })
}

/// Corners without doubles, mm, and the triangles between them.
type Welded = (Vec<[f64; 3]>, Vec<[u32; 3]>);

/// Corners at the same place become one.
fn welded(mesh: &Mesh) -> Result<Welded, MeshError> {
    let mut first = HashMap::new();
    let mut corners = Vec::new();
    let mut new = Vec::with_capacity(mesh.vertices_mm.len());
    for p in &mesh.vertices_mm {
        // Zero and minus zero are one place.
        let index = *first.entry(p.map(|v| (v + 0.0).to_bits())).or_insert_with(|| {
            corners.push(*p);
            corners.len() as u32 - 1
        });
        new.push(index);
    }
    let renamed = |(triangle, corners): (usize, &[u32; 3])| {
        let [a, b, c] = corners.map(|c| new.get(c as usize).copied());
        match (a, b, c) {
            (Some(a), Some(b), Some(c)) => Ok([a, b, c]),
            _ => Err(MeshError::Index { triangle }),
        }
    };
    let triangles = mesh.triangles.iter().enumerate().map(renamed).collect::<Result<_, _>>()?;
    Ok((corners, triangles))
}

/// The triangle across each edge.
fn neighbours(triangles: &[[u32; 3]]) -> Result<Vec<[usize; 3]>, MeshError> {
    let mut owner = HashMap::with_capacity(3 * triangles.len());
    for (triangle, corners) in triangles.iter().enumerate() {
        for k in 0..3 {
            if owner.insert([corners[k], corners[(k + 1) % 3]], triangle).is_some() {
                return Err(MeshError::Open { triangle });
            }
        }
    }
    let beside = |(triangle, corners): (usize, &[u32; 3])| {
        let across = |k: usize| owner.get(&[corners[(k + 1) % 3], corners[k]]).copied();
        match (across(0), across(1), across(2)) {
            (Some(a), Some(b), Some(c)) => Ok([a, b, c]),
            _ => Err(MeshError::Open { triangle }),
        }
    };
    triangles.iter().enumerate().map(beside).collect()
}

/// Two triangles of which an edge of one goes through the other.
fn crossing(
    triangles: &[[u32; 3]],
    places: &[[[f64; 3]; 3]],
    tree: &Tree,
    work: &mut Work<'_>,
) -> Result<Option<[usize; 2]>, MeshError> {
    for own in 0..triangles.len() {
        for k in 0..3 {
            let ends = [triangles[own][k], triangles[own][(k + 1) % 3]];
            // Each edge once.
            if ends[0] > ends[1] {
                continue;
            }
            let [a, b] = [places[own][k], places[own][(k + 1) % 3]];
            let bounds = [f64::min, f64::max].map(|pick| [0, 1, 2].map(|i| pick(a[i], b[i])));
            let found = tree.find(bounds, work, |other| {
                let apart = !triangles[other].iter().any(|corner| ends.contains(corner));
                (apart && goes_through([a, b], places[other])).then_some([own, other])
            })?;
            if found.is_some() {
                return Ok(found);
            }
        }
    }
    Ok(None)
}

/// Whether a segment goes through the inside of a triangle.
fn goes_through([p, q]: [[f64; 3]; 2], [a, b, c]: [[f64; 3]; 3]) -> bool {
    let volume = |u, v, w, x| dot(cross(minus(v, u), minus(w, u)), minus(x, u));
    let (above, below) = (volume(a, b, c, p), volume(a, b, c, q));
    if !(above > 0.0 && below < 0.0 || above < 0.0 && below > 0.0) {
        return false;
    }
    let sides = [volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)];
    sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0)
}
