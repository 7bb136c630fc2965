//! Strain energy density at the nodes of an interface, one side at a time.
//!
//! SED jumps across layers, so each side averages only elements of its own. A
//! trilinear element's in-plane strain is best at the face's middle, so Hex8
//! samples there and a vertex takes its faces' values weighted by one over
//! their area (exact for a linear field on a graded tensor grid); Hex27 is
//! sampled at the vertex itself.

use super::{FaceKind, Mesh, Tissue};
use crate::element::geometry::{BlockGeometry, jacobian};
use crate::element::kernel::displacement_gradient;
use crate::element::{ElementKind, Inverted, Memory, Solid, extrapolate};
use crate::material::Kinematics;
use std::collections::HashMap;
use std::sync::Arc;

/// A deformed body, as far as recovery needs it.
pub struct Deformed<'a> {
    /// Undeformed mesh.
    pub mesh: &'a Mesh,
    /// Undeformed element geometry, one a block.
    pub geometry: &'a [BlockGeometry],
    /// What each tissue is made of.
    pub materials: &'a [Arc<dyn Solid>],
    /// Displacement, mm, one a mesh node.
    pub u: &'a [[f64; 3]],
    /// History of an element's quadrature points `(block, element)`; empty for
    /// materials without memory.
    pub history: &'a dyn Fn(usize, usize) -> &'a [f64],
}

/// One evaluation point that contributes to an interface node.
#[derive(Clone, Debug)]
struct Sample {
    block: usize,
    element: usize,
    /// `dN/dX` at the point, one per node, 1/mm.
    gradients: Vec<[f64; 3]>,
    /// Dilatation basis at the point.
    basis: [f64; 4],
    /// Weights of the element's quadrature points.
    from_points: Vec<f64>,
}

/// Evaluates SED at chosen nodes of a surface from the elements of one tissue.
#[derive(Clone, Debug)]
pub struct SedRecovery {
    samples: Vec<Sample>,
    /// Per node: `(sample, weight)`, weights summing to 1.
    terms: Vec<Vec<(usize, f64)>>,
}

/// Why a recovery could not be set up.
#[derive(Debug, thiserror::Error)]
#[error(
    "node {node} of the surface touches no element of {tissue}; the layer does not reach the surface there"
)]
pub struct NoElement {
    /// Mesh node.
    pub node: u32,
    /// Tissue that was looked for.
    pub tissue: &'static str,
}

/// Corner nodes of the six faces of a hexahedron and the reference coordinates
/// of their centres.
const HEX_FACES: [([usize; 4], [f64; 3]); 6] = [
    ([0, 3, 7, 4], [-1.0, 0.0, 0.0]),
    ([1, 2, 6, 5], [1.0, 0.0, 0.0]),
    ([0, 1, 5, 4], [0.0, -1.0, 0.0]),
    ([3, 2, 6, 7], [0.0, 1.0, 0.0]),
    ([0, 1, 2, 3], [0.0, 0.0, -1.0]),
    ([4, 5, 6, 7], [0.0, 0.0, 1.0]),
];

impl SedRecovery {
    /// Recovery at `nodes` of the surface named `surface`, from `tissue`'s side.
    ///
    /// # Errors
    /// [`NoElement`] if a node has no element of that tissue on the surface.
    pub fn new(
        mesh: &Mesh,
        surface: &str,
        tissue: Tissue,
        nodes: &[u32],
    ) -> Result<Self, NoElement> {
        let owner = element_on_face(mesh, tissue);
        let mut by_node: HashMap<u32, Vec<(usize, f64)>> = HashMap::new();
        let mut samples = Vec::new();
        let faces = mesh.surfaces.get(surface);
        for (face, area) in faces.map(|s| face_areas(mesh, s)).unwrap_or_default() {
            let Some(&(block, element, centre)) = owner.get(&corner_key(&face)) else { continue };
            let b = &mesh.blocks[block];
            if b.kind == ElementKind::Hex8 {
                samples.push(sample(mesh, block, element, centre));
                for &n in &face {
                    by_node.entry(n).or_default().push((samples.len() - 1, 1.0 / area));
                }
            } else {
                for &n in &face {
                    let Some(local) = b.element(element).iter().position(|&m| m == n) else {
                        continue;
                    };
                    samples.push(sample(mesh, block, element, b.kind.node_xi(local)));
                    by_node.entry(n).or_default().push((samples.len() - 1, 1.0 / area));
                }
            }
        }
        let mut terms = Vec::with_capacity(nodes.len());
        for &node in nodes {
            let mut t = by_node.remove(&node).ok_or(NoElement { node, tissue: tissue.name() })?;
            let total: f64 = t.iter().map(|(_, w)| w).sum();
            for (_, w) in &mut t {
                *w /= total;
            }
            terms.push(t);
        }
        Ok(Self { samples, terms })
    }

    /// SED in MPa (= mJ/mm3) at the nodes. Evaluated from the strain (and, with
    /// memory, from what the branches hold: the energy that can be got back),
    /// not summed over increments.
    ///
    /// # Errors
    /// [`Inverted`] if an element that is sampled has turned inside out.
    pub fn sed_mpa(&self, body: &Deformed<'_>) -> Result<Vec<f64>, Inverted> {
        let mut values = Vec::with_capacity(self.samples.len());
        for s in &self.samples {
            let block = &body.mesh.blocks[s.block];
            let material = &body.materials[block.tissue[s.element].index()];
            let local: Vec<_> =
                block.element(s.element).iter().map(|&n| body.u[n as usize]).collect();
            let mut force = vec![[0.0; 3]; local.len()];
            let history = (body.history)(s.block, s.element);
            let memory = Memory { history, dt_s: 0.0 };
            let shape = body.geometry[s.block].element(s.element);
            let state = material.evaluate(shape, &local, memory, &mut force, None)?;
            let theta: f64 = s.basis.iter().zip(state.theta_minus_1).map(|(b, t)| b * t).sum();
            let k = Kinematics::new(displacement_gradient(&local, &s.gradients));
            let own = interpolate(history, &s.from_points, material.history_len());
            values.push(material.stored_mpa(&k, theta, &own));
        }
        Ok(self.terms.iter().map(|t| t.iter().map(|&(s, w)| w * values[s]).sum()).collect())
    }
}

/// History of a point from that of the quadrature points.
fn interpolate(history: &[f64], weights: &[f64], len: usize) -> Vec<f64> {
    let mut own = vec![0.0; len];
    if len > 0 {
        for (point, w) in history.chunks_exact(len).zip(weights) {
            for (o, h) in own.iter_mut().zip(point) {
                *o += w * h;
            }
        }
    }
    own
}

fn sample(mesh: &Mesh, block: usize, element: usize, xi: [f64; 3]) -> Sample {
    let b = &mesh.blocks[block];
    let n = b.kind.nodes();
    let (mut value, mut reference) = (vec![0.0; n], vec![[0.0; 3]; n]);
    b.kind.shape(xi, &mut value, &mut reference);
    let conn = b.element(element);
    let (inverse, _) = jacobian(conn.iter().map(|&a| mesh.nodes[a as usize]), &reference);
    let gradients = reference
        .iter()
        .map(|d| std::array::from_fn(|i| (0..3).map(|k| d[k] * inverse[k][i]).sum()))
        .collect();
    let from_points = extrapolate::weights(b.kind, xi);
    Sample { block, element, gradients, basis: b.kind.dilatation_basis(xi), from_points }
}

/// Sorted corners: the identity of a quadrilateral face.
fn corner_key(face: &[u32]) -> [u32; 4] {
    let mut key = [face[0], face[1], face[2], face[3]];
    key.sort_unstable();
    key
}

/// Element of `tissue`, with the face's centre, for every face of such elements.
fn element_on_face(mesh: &Mesh, tissue: Tissue) -> HashMap<[u32; 4], (usize, usize, [f64; 3])> {
    let mut owner = HashMap::new();
    for (block, b) in mesh.blocks.iter().enumerate() {
        if !matches!(b.kind, ElementKind::Hex8 | ElementKind::Hex27) {
            continue;
        }
        for e in (0..b.len()).filter(|&e| b.tissue[e] == tissue) {
            let conn = b.element(e);
            for (corners, centre) in &HEX_FACES {
                owner.insert(corner_key(&corners.map(|c| conn[c])), (block, e, *centre));
            }
        }
    }
    owner
}

fn face_areas(mesh: &Mesh, surface: &super::Surface) -> Vec<(Vec<u32>, f64)> {
    if !matches!(surface.kind, FaceKind::Quad4 | FaceKind::Quad9) {
        return Vec::new();
    }
    let rule = surface.kind.quadrature();
    let mut areas: Vec<(Vec<u32>, f64)> = surface.faces().map(|f| (f.to_vec(), 0.0)).collect();
    let mut visit = 0;
    surface.integrate(&rule, &|n| mesh.nodes[n as usize], &mut |_, _, normal| {
        areas[visit / rule.len()].1 += super::surface::norm(normal);
        visit += 1;
    });
    areas
}
