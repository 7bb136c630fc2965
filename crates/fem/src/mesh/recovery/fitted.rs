//! SED of triquadratic elements at the nodes of an interface, from where their strain is best.
//!
//! Strain of `Hex27` is a whole order better at the points of a 2 x 2 Gauss rule on a face (in
//! the plane of the face; in depth it is read at the face itself) than at nodes. These
//! points of all faces form a lattice of their own, and a node takes the value of a polynomial
//! of second degree that is fitted to those around it, near ones weighted most (Zienkiewicz & Zhu
//! 1992, superconvergent patch recovery). Distances are counted in intervals of the lattice
//! of nodes, however that is drawn out.

use super::{NoElement, Sample, SedRecovery, element_on_side, sorted};
use crate::element::ElementKind;
use crate::element::reference::GAUSS_2;
use crate::mesh::{Mesh, Region};
use papilla_vector::dot;
use std::collections::{BTreeSet, HashMap};

/// Intervals at which a point's weight has fallen to 1/e.
const WIDTH: f64 = 1.0;
/// Intervals beyond which points count nothing.
const FAR: f64 = 2.8;
/// Weighted mean of the points' places, in intervals, beyond which they lie on one side of the node
/// and a polynomial of first degree has to do.
const ONE_SIDED: f64 = 0.25;
/// Terms of a polynomial of second degree in two variables.
const TERMS: usize = 6;

/// A face's samples and their places.
struct Face {
    nodes: Vec<u32>,
    samples: [usize; 4],
    at: [[f64; 3]; 4],
}

impl SedRecovery {
    /// Recovery at `nodes` of the surface named `surface`, from `region`'s side, by fits to the
    /// best points of `Hex27`; on other elements as [`SedRecovery::new`].
    ///
    /// # Errors
    /// [`NoElement`] if a node has no element of that region on the surface.
    pub fn fitted(
        mesh: &Mesh,
        surface: &str,
        region: Region,
        nodes: &[u32],
    ) -> Result<Self, NoElement> {
        if mesh.blocks.iter().any(|b| b.kind != ElementKind::Hex27) {
            return Self::new(mesh, surface, region, nodes);
        }
        let (faces, samples) = faces(mesh, surface, region);
        let mut around: HashMap<u32, Vec<usize>> = HashMap::new();
        for (f, face) in faces.iter().enumerate() {
            for &n in &face.nodes {
                around.entry(n).or_default().push(f);
            }
        }
        let mut terms = Vec::with_capacity(nodes.len());
        for &node in nodes {
            let own = around.get(&node).ok_or(NoElement { node, region })?;
            let near: BTreeSet<usize> = own
                .iter()
                .flat_map(|&f| faces[f].nodes.iter().flat_map(|n| &around[n]))
                .copied()
                .collect();
            let x = mesh.nodes[node as usize];
            let axes = intervals(mesh, &faces[own[0]].nodes, node);
            let points: Vec<(usize, [f64; 2])> = near
                .iter()
                .flat_map(|&f| faces[f].samples.into_iter().zip(faces[f].at))
                .map(|(s, p)| (s, coordinates(axes, std::array::from_fn(|i| p[i] - x[i]))))
                .filter(|(_, [a, b])| a.hypot(*b) < FAR)
                .collect();
            terms.push(fit(&points));
        }
        Ok(Self { samples, terms })
    }
}

/// Faces with elements of `region`, and the samples on them.
fn faces(mesh: &Mesh, surface: &str, region: Region) -> (Vec<Face>, Vec<Sample>) {
    let owner = element_on_side(mesh, region);
    let (mut faces, mut samples) = (Vec::new(), Vec::new());
    for face in mesh.surfaces.get(surface).into_iter().flat_map(|s| s.faces()) {
        let Some(&(block, element, side)) = owner.get(&sorted(&face[..4])) else { continue };
        let centre = ElementKind::Hex27.side_centre(side);
        let mut in_plane = (0..3).filter(|&i| centre[i].abs() < 0.5);
        let (Some(p), Some(q)) = (in_plane.next(), in_plane.next()) else { continue };
        let first = samples.len();
        let at = [0, 1, 2, 3].map(|k| {
            let mut xi = centre;
            xi[p] = GAUSS_2[k % 2].0;
            xi[q] = GAUSS_2[k / 2].0;
            let sample = Sample::new(mesh, block, element, xi);
            let at = sample.interpolate(mesh, &mesh.nodes);
            samples.push(sample);
            at
        });
        faces.push(Face { nodes: face.to_vec(), samples: [0, 1, 2, 3].map(|k| first + k), at });
    }
    (faces, samples)
}

/// Intervals of the lattice of nodes at a node of a 9-node face, along its two directions, mm.
fn intervals(mesh: &Mesh, face: &[u32], node: u32) -> [[f64; 3]; 2] {
    let kind = ElementKind::Quad9;
    let local = face.iter().position(|&n| n == node).unwrap_or(8);
    let (mut value, mut gradient) = ([0.0; 9], [[0.0; 3]; 9]);
    kind.shape(kind.node_xi(local), &mut value, &mut gradient);
    [0, 1].map(|k| {
        let along = |i: usize| -> f64 {
            face.iter().zip(&gradient).map(|(&n, g)| g[k] * mesh.nodes[n as usize][i]).sum()
        };
        [along(0), along(1), along(2)]
    })
}

/// Coordinates of `r` along two axes that span its plane, least squares.
fn coordinates([a, b]: [[f64; 3]; 2], r: [f64; 3]) -> [f64; 2] {
    let (aa, ab, bb, ar, br) = (dot(a, a), dot(a, b), dot(b, b), dot(a, r), dot(b, r));
    let determinant = aa * bb - ab * ab;
    [(ar * bb - br * ab) / determinant, (br * aa - ar * ab) / determinant]
}

/// Weights of the points in the fitted polynomial's value at the origin.
fn fit(points: &[(usize, [f64; 2])]) -> Vec<(usize, f64)> {
    let weight = |[a, b]: [f64; 2]| (-(a * a + b * b) / (WIDTH * WIDTH)).exp();
    let total: f64 = points.iter().map(|(_, c)| weight(*c)).sum();
    let mean = [0, 1].map(|k| points.iter().map(|(_, c)| weight(*c) * c[k]).sum::<f64>() / total);
    let degrees: &[usize] = if mean[0].hypot(mean[1]) > ONE_SIDED { &[3, 1] } else { &[6, 3, 1] };
    for &terms in degrees {
        let basis = |[a, b]: [f64; 2]| [1.0, a, b, a * a, a * b, b * b];
        let mut normal = [[0.0; TERMS]; TERMS];
        for (_, c) in points {
            let (w, p) = (weight(*c), basis(*c));
            for i in 0..terms {
                for j in 0..terms {
                    normal[i][j] += w * p[i] * p[j];
                }
            }
        }
        if let Some(first) = first_of_inverse(normal, terms) {
            return points
                .iter()
                .map(|&(s, c)| {
                    let p = basis(c);
                    (s, weight(c) * (0..terms).map(|i| first[i] * p[i]).sum::<f64>())
                })
                .collect();
        }
    }
    points.iter().map(|&(s, c)| (s, weight(c) / total)).collect()
}

/// First row of the inverse of a symmetric matrix; `None` if points are too few or in line.
fn first_of_inverse(mut a: [[f64; TERMS]; TERMS], n: usize) -> Option<[f64; TERMS]> {
    const PIVOT_MIN: f64 = 1e-7;
    let mut x = [0.0; TERMS];
    x[0] = 1.0;
    let scale: [f64; TERMS] = std::array::from_fn(|i| a[i][i]);
    for p in 0..n {
        if !(a[p][p] > PIVOT_MIN * scale[p]) {
            return None;
        }
        for r in p + 1..n {
            let factor = a[r][p] / a[p][p];
            for c in p..n {
                a[r][c] -= factor * a[p][c];
            }
            x[r] -= factor * x[p];
        }
    }
    for p in (0..n).rev() {
        let known: f64 = (p + 1..n).map(|c| a[p][c] * x[c]).sum();
        x[p] = (x[p] - known) / a[p][p];
    }
    Some(x)
}
