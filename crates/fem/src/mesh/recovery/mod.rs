//! Strain energy density at the nodes of an interface, one side at a time.
//!
//! SED jumps across layers, so each side averages only elements of its own. A
//! linear element's in-plane strain is best at the face's middle, so `Hex8`,
//! `Quad4` and `Tet4` sample there and a vertex takes its faces' values weighted
//! by one over their area (exact for a linear field on a graded tensor grid);
//! quadratic elements are sampled at the vertex itself. In the plane a face is an
//! edge and its area the length.

mod fitted;
mod quarters;

use super::sample::{Deformed, Sample};
use super::{Mesh, Region, Surface};
use crate::element::Inverted;
use std::collections::HashMap;

/// Evaluates SED at chosen nodes of a surface from the elements of one region.
#[derive(Clone, Debug)]
pub struct SedRecovery {
    samples: Vec<Sample>,
    /// Per node: `(sample, weight)`, weights summing to 1.
    terms: Vec<Vec<(usize, f64)>>,
}

/// Why a recovery could not be set up.
#[derive(Debug, thiserror::Error)]
#[error(
    "node {node} of the surface touches no element of region {}; the layer does not reach the surface there",
    region.0
)]
pub struct NoElement {
    /// Mesh node.
    pub node: u32,
    /// Region that was looked for.
    pub region: Region,
}

impl SedRecovery {
    /// Recovery at `nodes` of the surface named `surface`, from `region`'s side.
    ///
    /// # Errors
    /// [`NoElement`] if a node has no element of that region on the surface.
    pub fn new(
        mesh: &Mesh,
        surface: &str,
        region: Region,
        nodes: &[u32],
    ) -> Result<Self, NoElement> {
        let owner = element_on_side(mesh, region);
        let mut by_node: HashMap<u32, Vec<(usize, f64)>> = HashMap::new();
        let mut samples = Vec::new();
        for (face, corners, area) in
            mesh.surfaces.get(surface).into_iter().flat_map(|s| faces(mesh, s))
        {
            let Some(&(block, element, side)) = owner.get(&sorted(&face[..corners])) else {
                continue;
            };
            let b = &mesh.blocks[block];
            if b.kind.order() == 1 {
                samples.push(Sample::new(mesh, block, element, b.kind.side_centre(side)));
                for &n in &face {
                    by_node.entry(n).or_default().push((samples.len() - 1, 1.0 / area));
                }
            } else {
                for &n in &face {
                    let Some(local) = b.element(element).iter().position(|&m| m == n) else {
                        continue;
                    };
                    samples.push(Sample::new(mesh, block, element, b.kind.node_xi(local)));
                    by_node.entry(n).or_default().push((samples.len() - 1, 1.0 / area));
                }
            }
        }
        Self::of(samples, by_node, nodes, region)
    }

    /// Weights over the samples round each of `nodes`, scaled to sum to 1.
    fn of(
        samples: Vec<Sample>,
        mut by_node: HashMap<u32, Vec<(usize, f64)>>,
        nodes: &[u32],
        region: Region,
    ) -> Result<Self, NoElement> {
        let mut terms = Vec::with_capacity(nodes.len());
        for &node in nodes {
            let mut t = by_node.remove(&node).ok_or(NoElement { node, region })?;
            let total: f64 = t.iter().map(|(_, w)| w).sum();
            for (_, w) in &mut t {
                *w /= total;
            }
            terms.push(t);
        }
        Ok(Self { samples, terms })
    }

    /// Where SED is sampled, before it is averaged to the nodes.
    #[must_use]
    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// Per node the samples that it averages, with weights that sum to 1.
    #[must_use]
    pub fn terms(&self) -> &[Vec<(usize, f64)>] {
        &self.terms
    }

    /// Nodal means of values at [`Self::samples`].
    #[must_use]
    pub fn average(&self, values: &[f64]) -> Vec<f64> {
        self.terms
            .iter()
            .map(|t| t.iter().map(|&(s, w)| w * values[s]).sum::<f64>().max(0.0))
            .collect()
    }

    /// SED in MPa (= mJ/mm3) at the nodes.
    ///
    /// # Errors
    /// [`Inverted`] if an element that is sampled has turned inside out.
    pub fn sed_mpa(&self, body: &Deformed<'_>) -> Result<Vec<f64>, Inverted> {
        let values = self.samples.iter().map(|s| s.sed_mpa(body)).collect::<Result<Vec<_>, _>>()?;
        Ok(self.average(&values))
    }
}

/// The identity of a face: its corners, sorted.
fn sorted(corners: &[u32]) -> Vec<u32> {
    let mut key = corners.to_vec();
    key.sort_unstable();
    key
}

/// Block, element and side of every face of a region's elements.
fn element_on_side(mesh: &Mesh, region: Region) -> HashMap<Vec<u32>, (usize, usize, usize)> {
    let mut owner = HashMap::new();
    for (block, b) in mesh.blocks.iter().enumerate() {
        for e in (0..b.len()).filter(|&e| b.region[e] == region) {
            let conn = b.element(e);
            for (side, corners) in b.kind.sides().iter().enumerate() {
                let corners: Vec<u32> = corners.iter().map(|&c| conn[c]).collect();
                owner.insert(sorted(&corners), (block, e, side));
            }
        }
    }
    owner
}

/// Nodes, number of corners and area of every face.
fn faces(mesh: &Mesh, surface: &Surface) -> Vec<(Vec<u32>, usize, f64)> {
    let rule = surface.kind.quadrature();
    let corners = surface.kind.corners();
    let mut faces: Vec<_> = surface.faces().map(|f| (f.to_vec(), corners, 0.0)).collect();
    let mut visit = 0;
    surface.integrate(&rule, &|n| mesh.nodes[n as usize], &mut |_, _, normal| {
        faces[visit / rule.len()].2 += papilla_vector::norm(normal);
        visit += 1;
    });
    faces
}
