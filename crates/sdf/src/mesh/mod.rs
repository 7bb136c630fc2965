//! Signed distance to a body that triangles bound.
//!
//! The sign of the distance is that of the angle-weighted normal of the nearest face, edge or
//! corner (Baerentzen & Aanaes, *Signed distance computation using the angle weighted
//! pseudonormal*, 2005), which is right for closed meshes of any shape. Libraries that do the same
//! take memory for each question; this takes none. A surface that is open or crosses itself is
//! [mended](mend) first.

mod check;
mod closest;
mod decimate;
mod error;
mod mend;
mod shells;
mod tree;
mod winding;
mod work;

pub use decimate::Decimated;
#[cfg(feature = "files")]
pub(super) use decimate::few_enough;
pub use error::MeshError;
pub use mend::Mended;

use super::beneath::SEAM_MM;
use super::{Distance, SignedDistance};
use check::Checked;
use closest::{Feature, closest};
use papilla_vector::{cross, dot, minus, norm, scaled_to_one};
use serde::{Deserialize, Serialize};
use tree::Tree;
use winding::Winding;

/// Most triangles of a mesh.
pub const TRIANGLES_MAX: usize = 16_384;
/// Below this distance from the surface, mm, the direction is the surface's own.
const ON_SURFACE_MM: f64 = 1e-9;

/// Places at which it is counted how many triangles a distance asks.
const SAMPLES: usize = 128;
/// How far these are from the surface, mm: about as deep as skin is pressed.
const AWAY_MM: f64 = 0.5;
/// Time of a triangle and its share of the boxes, in those of a sphere's distance.
const PER_TRIANGLE: f64 = 2.5;
/// Time of a box or triangle of a winding number, in those of a sphere's distance, times the share of
/// places that are nearest to an edge: only these ask for it.
const PER_WINDING: f64 = 0.1;
/// Most of the places whose nearest triangle and winding number may differ about the side.
const UNSURE: f64 = 0.1;

/// A mesh as it is told: corners and the triangles between them, counter-clockwise seen from
/// outside. Corners at the very same place are one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Mesh {
    /// Corners, mm.
    pub vertices_mm: Vec<[f64; 3]>,
    /// Three indices of corners for each triangle, at most 16 384 triangles.
    pub triangles: Vec<[u32; 3]>,
}

/// The signed distance of a mesh.
pub struct MeshDistance {
    tree: Tree,
    faces: Vec<Face>,
    corners_mm: Vec<[f64; 3]>,
    cost: f64,
    mended: Option<(Winding, Mended)>,
    decimated: Option<Decimated>,
}

/// A triangle, ready to be asked.
struct Face {
    corners_mm: [[f64; 3]; 3],
    /// Of the face, of its edges (the first from corner 0 to 1), of its corners.
    normals: [[f64; 3]; 7],
}

impl Mesh {
    /// Its signed distance. One that is open, crosses itself or is turned the wrong way is mended
    /// first, see [`MeshDistance::mended`].
    ///
    /// # Errors
    /// [`MeshError`] says why the mesh bounds no body.
    pub fn build(&self) -> Result<MeshDistance, MeshError> {
        self.build_until(&|| true)
    }

    /// The same for as long as `go_on` says so, which is asked now and then: most of the time goes
    /// into the search for triangles that cross.
    ///
    /// # Errors
    /// As [`Self::build`]; [`MeshError::Stopped`] once `go_on` said no.
    pub fn build_until(&self, go_on: &dyn Fn() -> bool) -> Result<MeshDistance, MeshError> {
        match check::checked(self, go_on) {
            Ok(closed) => Ok(MeshDistance::new(closed)),
            Err(error) if error.can_be_mended() => MeshDistance::of(mend::body(self, go_on)?),
            Err(error) => Err(error),
        }
    }

    /// The distance of a surface that need not be closed, of any number of triangles: its sign is
    /// right where the nearest place is not on a rim, and which way triangles are turned is not
    /// looked at.
    ///
    /// # Errors
    /// [`MeshError::Index`], and [`MeshError::Count`] if no triangle has an area.
    pub fn build_open(&self) -> Result<MeshDistance, MeshError> {
        Ok(MeshDistance::new(check::unchecked(self)?))
    }
}

impl MeshDistance {
    fn new(Checked { corners_mm, triangles, tree }: Checked) -> Self {
        let place = |triangle: [u32; 3]| triangle.map(|c| corners_mm[c as usize]);
        let unit: Vec<[f64; 3]> =
            triangles.iter().map(|t| scaled_to_one(normal(place(*t)))).collect();
        let mut at_corner = vec![[0.0; 3]; corners_mm.len()];
        let mut at_edge = std::collections::HashMap::new();
        for (triangle, n) in triangles.iter().zip(&unit) {
            for k in 0..3 {
                let [own, next, last] = [0, 1, 2].map(|s| triangle[(k + s) % 3]);
                let turn = angle(place([own, next, last]));
                add(&mut at_corner[own as usize], n.map(|v| turn * v));
                add(at_edge.entry([own.min(next), own.max(next)]).or_insert([0.0; 3]), *n);
            }
        }
        let faces = triangles.iter().zip(&unit).map(|(triangle, n)| {
            let edge = |k: usize| {
                let [a, b] = [triangle[k], triangle[(k + 1) % 3]];
                at_edge.get(&[a.min(b), a.max(b)]).copied().unwrap_or(*n)
            };
            let corner = |k: usize| at_corner[triangle[k] as usize];
            let normals = [*n, edge(0), edge(1), edge(2), corner(0), corner(1), corner(2)];
            Face { corners_mm: place(*triangle), normals: normals.map(scaled_to_one) }
        });
        let faces = faces.collect();
        let mut built = Self { faces, tree, corners_mm, cost: 1.0, mended: None, decimated: None };
        built.cost = 1.0 + PER_TRIANGLE * built.triangles_asked();
        built
    }

    /// That of a mended surface.
    fn of(body: mend::Body) -> Result<Self, MeshError> {
        let mend::Body { checked, winding, mended } = body;
        let mut built = Self::new(checked);
        let (mut looked, mut unsure, mut count) = (0, 0.0, 0.0);
        for p in built.samples() {
            let (_, _, side, feature) = built.nearest(p);
            count += 1.0;
            looked += winding.looked_at(p);
            if matches!(feature, Feature::Face) && (side < 0.0) != winding.is_inside(p) {
                unsure += 1.0;
            }
        }
        if unsure > UNSURE * count {
            let percent = (100.0 * (1.0 - unsure / count)) as u32;
            return Err(MeshError::NoInside { percent });
        }
        built.cost += PER_WINDING * f64::from(looked) / count;
        built.mended = Some((winding, mended));
        Ok(built)
    }

    /// Says of itself that it was made of more triangles.
    pub(super) fn with(mut self, decimated: Option<Decimated>) -> Self {
        self.decimated = decimated;
        self
    }

    /// What was done to the mesh to make a body of it; nothing to a closed one.
    #[must_use]
    pub fn mended(&self) -> Option<Mended> {
        self.mended.as_ref().map(|(_, mended)| *mended)
    }

    /// Some places on both sides of the surface.
    fn samples(&self) -> impl Iterator<Item = [f64; 3]> + use<'_> {
        let step = self.faces.len().div_ceil(SAMPLES);
        self.faces.iter().step_by(step).enumerate().map(|(i, face)| {
            let [a, b, c] = face.corners_mm;
            let away = if i % 2 == 0 { AWAY_MM } else { -AWAY_MM };
            let n = face.normals[0];
            std::array::from_fn(|k| (a[k] + b[k] + c[k]) / 3.0 + away * n[k])
        })
    }

    /// Mean number of triangles that are asked for a distance.
    fn triangles_asked(&self) -> f64 {
        let (mut asked, mut places) = (0u32, 0u32);
        for p in self.samples() {
            places += 1;
            self.tree.nearest(p, |face, _| {
                asked += 1;
                square(minus(p, closest(p, &self.faces[face].corners_mm).0))
            });
        }
        f64::from(asked) / f64::from(places)
    }

    /// The nearest triangle, its nearest point, how far before it `p` lies by its pseudonormal, and
    /// what of it is nearest.
    fn nearest(&self, p: [f64; 3]) -> (usize, [f64; 3], f64, Feature) {
        let mut best = (f64::INFINITY, 0, [0.0; 3], Feature::Face);
        self.tree.nearest(p, |face, limit| {
            let (q, feature) = closest(p, &self.faces[face].corners_mm);
            let square = square(minus(p, q));
            if square < limit {
                best = (square, face, q, feature);
            }
            square
        });
        let (_, face, q, feature) = best;
        let outward = self.faces[face].normals[feature.index()];
        (face, q, dot(minus(p, q), outward), feature)
    }
}

impl SignedDistance for MeshDistance {
    fn cost(&self) -> f64 {
        self.cost
    }

    fn mended(&self) -> Vec<String> {
        let decimated = self.decimated.iter().map(ToString::to_string);
        decimated.chain(self.mended.iter().map(|(_, mended)| mended.to_string())).collect()
    }

    fn distance(&self, p: [f64; 3]) -> Distance {
        let (face, q, side, feature) = self.nearest(p);
        let face = &self.faces[face];
        let outward = face.normals[feature.index()];
        let away = minus(p, q);
        let is_inside = match &self.mended {
            // Pieces of triangles do not share edges: their pseudonormals say nothing.
            Some((winding, _)) if !matches!(feature, Feature::Face) => winding.is_inside(p),
            _ => side < 0.0,
        };
        let gap_mm = if is_inside { -square(away).sqrt() } else { square(away).sqrt() };
        if gap_mm.abs() < ON_SURFACE_MM {
            return Distance { gap_mm, normal: outward, hessian: [[0.0; 3]; 3] };
        }
        let normal = away.map(|v| v / gap_mm);
        let along = feature.edge().map_or([0.0; 3], |[a, b]| {
            scaled_to_one(minus(face.corners_mm[b], face.corners_mm[a]))
        });
        let bends = if matches!(feature, Feature::Face) { 0.0 } else { 1.0 / gap_mm };
        let hessian = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let unit = if i == j { 1.0 } else { 0.0 };
                bends * (unit - normal[i] * normal[j] - along[i] * along[j])
            })
        });
        Distance { gap_mm, normal, hessian }
    }

    /// The planes of the triangles that `p` looks straight at, and its nearest point.
    fn exits(&self, p: [f64; 3], each: &mut dyn FnMut(Distance) -> f64) {
        each(self.distance(p));
        self.tree.nearest(p, |face, _| {
            let Face { corners_mm, normals: [normal, ..] } = &self.faces[face];
            let gap_mm = dot(minus(p, corners_mm[0]), *normal);
            let foot: [f64; 3] = std::array::from_fn(|i| p[i] - gap_mm * normal[i]);
            let beside = square(minus(closest(p, corners_mm).0, foot));
            if gap_mm > ON_SURFACE_MM || beside > SEAM_MM * SEAM_MM {
                return f64::INFINITY;
            }
            each(Distance { gap_mm, normal: *normal, hessian: [[0.0; 3]; 3] }).powi(2)
        });
    }

    fn reach_mm(&self, direction: [f64; 3]) -> f64 {
        self.corners_mm.iter().map(|p| dot(*p, direction)).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Of the whole body across the direction in which it presses: parts of it may be narrower.
    fn narrowest_mm(&self) -> f64 {
        let wide = |i: usize| {
            let along =
                |sign| self.reach_mm(std::array::from_fn(|k| if k == i { sign } else { 0.0 }));
            along(1.0) + along(-1.0)
        };
        wide(0).min(wide(1))
    }
}

fn square(a: [f64; 3]) -> f64 {
    dot(a, a)
}

fn add(sum: &mut [f64; 3], v: [f64; 3]) {
    for (sum, v) in sum.iter_mut().zip(v) {
        *sum += v;
    }
}

/// Twice the area along the outward normal.
fn normal([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    cross(minus(b, a), minus(c, a))
}

/// Angle at the first corner.
fn angle([a, b, c]: [[f64; 3]; 3]) -> f64 {
    let (u, v) = (minus(b, a), minus(c, a));
    norm(cross(u, v)).atan2(dot(u, v))
}

#[cfg(test)]
mod tests;
