//! Fields at any undeformed points, found in the elements that hold them.
//!
//! A point on a face that elements share belongs to all of them: SED jumps across
//! layers, and [`Probe::by_region`] keeps their sides apart.

use super::sample::{Deformed, Sample};
use super::{Mesh, Region};
use crate::element::geometry::jacobian;
use crate::element::{ElementKind, Inverted};
use papilla_vector::norm;
use std::collections::BTreeMap;

/// Points of a mesh at which fields are evaluated.
#[derive(Clone, Debug)]
pub struct Probe {
    /// Per point the elements that hold it.
    samples: Vec<Vec<Sample>>,
}

/// Why a probe could not be placed.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum ProbeError {
    /// No element holds the point.
    #[error(
        "probe point {index}, ({x_mm}, {y_mm}, {z_mm}) mm, lies in no element; the nearest node is \
         {distance_mm:.3e} mm away"
    )]
    Outside {
        /// Which point.
        index: usize,
        /// Its position.
        x_mm: f64,
        /// Its position.
        y_mm: f64,
        /// Its position.
        z_mm: f64,
        /// Distance of the nearest node.
        distance_mm: f64,
    },
}

/// How far past its sides an element still holds a point, in reference
/// coordinates: rounding of positions, so that a face belongs to both elements.
const TOUCH: f64 = 1e-8;
/// Newton iterations of the inverse map.
const ITERATIONS_MAX: usize = 40;

impl Probe {
    /// Finds `points` (mm, undeformed) in the mesh. Planar meshes lie in z = 0.
    ///
    /// # Errors
    /// [`ProbeError::Outside`] names the first point that no element holds. A
    /// curved skin bulges between the nodes of its mesh: aim at nodes, or inside.
    pub fn new(mesh: &Mesh, points: &[[f64; 3]]) -> Result<Self, ProbeError> {
        let boxes = boxes(mesh);
        let mut samples = Vec::with_capacity(points.len());
        for (index, p) in points.iter().enumerate() {
            let near = boxes.iter().filter(|b| b.holds(p));
            let found: Vec<_> = near
                .filter_map(|b| {
                    let block = &mesh.blocks[b.block];
                    let xi = inverse_map(mesh, block.kind, block.element(b.element), *p)?;
                    Some(Sample::new(mesh, b.block, b.element, xi))
                })
                .collect();
            if found.is_empty() {
                let [x_mm, y_mm, z_mm] = *p;
                let distance_mm = mesh
                    .nodes
                    .iter()
                    .map(|n| norm(std::array::from_fn(|i| n[i] - p[i])))
                    .fold(f64::INFINITY, f64::min);
                return Err(ProbeError::Outside { index, x_mm, y_mm, z_mm, distance_mm });
            }
            samples.push(found);
        }
        Ok(Self { samples })
    }

    /// Per point the elements that hold it, in the mesh's order.
    #[must_use]
    pub fn samples(&self) -> &[Vec<Sample>] {
        &self.samples
    }

    /// A value at every point, once for each region that holds it: the mean over
    /// that region's elements, regions by number.
    ///
    /// # Errors
    /// The first error of `value`.
    pub fn by_region<E>(
        &self,
        mesh: &Mesh,
        mut value: impl FnMut(&Sample) -> Result<f64, E>,
    ) -> Result<Vec<Vec<(Region, f64)>>, E> {
        let mut out = Vec::with_capacity(self.samples.len());
        for samples in &self.samples {
            let mut sums: BTreeMap<Region, (f64, u32)> = BTreeMap::new();
            for s in samples {
                let (sum, count) = sums.entry(s.region(mesh)).or_default();
                *sum += value(s)?;
                *count += 1;
            }
            out.push(sums.into_iter().map(|(r, (sum, n))| (r, sum / f64::from(n))).collect());
        }
        Ok(out)
    }

    /// SED, MPa, at every point, once for each region that holds it.
    ///
    /// # Errors
    /// [`Inverted`] if an element that is sampled has turned inside out.
    pub fn sed_mpa(&self, body: &Deformed<'_>) -> Result<Vec<Vec<(Region, f64)>>, Inverted> {
        self.by_region(body.mesh, |s| s.sed_mpa(body))
    }
}

/// `intervals + 1` evenly spaced points from `from` to `to`, both included exactly.
#[must_use]
pub fn line(from: [f64; 3], to: [f64; 3], intervals: usize) -> Vec<[f64; 3]> {
    let n = intervals as f64;
    (0..=intervals)
        .map(|k| {
            let t = k as f64;
            std::array::from_fn(|i| ((n - t) * from[i] + t * to[i]) / n)
        })
        .collect()
}

/// Where an element may hold points.
struct Box3 {
    block: usize,
    element: usize,
    low: [f64; 3],
    high: [f64; 3],
}

impl Box3 {
    fn holds(&self, p: &[f64; 3]) -> bool {
        (0..3).all(|i| p[i] >= self.low[i] && p[i] <= self.high[i])
    }
}

/// Boxes of the elements' nodes, widened: a quadratic side bulges past its nodes
/// by at most an eighth of its length.
fn boxes(mesh: &Mesh) -> Vec<Box3> {
    let mut boxes = Vec::with_capacity(mesh.element_count());
    for (block, b) in mesh.blocks.iter().enumerate() {
        for element in 0..b.len() {
            let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
            for &n in b.element(element) {
                for i in 0..3 {
                    low[i] = low[i].min(mesh.nodes[n as usize][i]);
                    high[i] = high[i].max(mesh.nodes[n as usize][i]);
                }
            }
            let size = (0..3).map(|i| high[i] - low[i]).fold(0.0, f64::max);
            let margin = if b.kind.order() == 1 { 1e-6 } else { 0.125 } * size;
            low = low.map(|v| v - margin);
            high = high.map(|v| v + margin);
            boxes.push(Box3 { block, element, low, high });
        }
    }
    boxes
}

/// Reference coordinates of `p` in an element, by Newton's method from its
/// middle; `None` if the element does not hold it.
fn inverse_map(mesh: &Mesh, kind: ElementKind, nodes: &[u32], p: [f64; 3]) -> Option<[f64; 3]> {
    let n = kind.nodes();
    let (mut value, mut gradient) = (vec![0.0; n], vec![[0.0; 3]; n]);
    let simplex = kind.lattice().is_empty();
    let mut xi = if simplex { [0.25; 3] } else { [0.0; 3] };
    for _ in 0..ITERATIONS_MAX {
        kind.shape(xi, &mut value, &mut gradient);
        let at = || nodes.iter().map(|&a| mesh.nodes[a as usize]);
        let (inverse, determinant) = jacobian(at(), &gradient);
        if !(determinant > 0.0) {
            return None;
        }
        let mut miss = p;
        for (x, v) in at().zip(&value) {
            for i in 0..3 {
                miss[i] -= v * x[i];
            }
        }
        // Off the plane is out of reach of a planar element.
        if kind.is_planar() && miss[2] != 0.0 {
            return None;
        }
        let step: [f64; 3] =
            std::array::from_fn(|k| (0..3).map(|i| inverse[k][i] * miss[i]).sum::<f64>());
        for i in 0..3 {
            // Far outside the map of a curved element may fold.
            xi[i] = (xi[i] + step[i]).clamp(-1.5, 1.5);
        }
        if step.iter().all(|s| s.abs() < 1e-12) {
            let inside = if simplex {
                xi.iter().all(|v| *v >= -TOUCH) && xi.iter().sum::<f64>() <= 1.0 + TOUCH
            } else {
                xi.iter().all(|v| v.abs() <= 1.0 + TOUCH)
            };
            return inside.then_some(xi);
        }
    }
    None
}
