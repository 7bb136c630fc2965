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
        faces[visit / rule.len()].2 += crate::tensor::norm(normal);
        visit += 1;
    });
    faces
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::{BlockGeometry, ConstitutiveModel, Elastic, ElementKind, Materials};
    use crate::material::NeoHookean;
    use crate::mesh::FaceKind;
    use crate::mesh::block::{BlockLattice, build, even};
    use crate::tensor::Kinematics;
    use std::sync::Arc;

    const KINDS: [ElementKind; 6] = [
        ElementKind::Hex8,
        ElementKind::Hex20,
        ElementKind::Hex27,
        ElementKind::Quad4,
        ElementKind::Quad8,
        ElementKind::Quad9,
    ];

    /// Poisson's ratio 0.45.
    fn material(e_mpa: f64) -> Arc<dyn ConstitutiveModel> {
        Elastic::shared(NeoHookean { mu_mpa: e_mpa / 2.9 }, e_mpa / 0.3)
    }

    /// A unit cube or square of two layers, the interface half way, edges curved.
    fn layered(kind: ElementKind, elements: usize) -> Mesh {
        let axis = || even(1.0, elements * kind.order());
        let third = if kind.is_planar() { vec![0.0] } else { axis() };
        let layers =
            (0..elements).map(|l| if 2 * l < elements { Region(1) } else { Region(0) }).collect();
        let up = kind.dimension() - 1;
        let mut mesh =
            build(&BlockLattice { axes: [axis(), axis(), third], layers, kind }, |mut p| {
                p[up] *= 1.0 + 0.1 * (2.0 * p[0]).sin();
                p
            });
        // The upper sides of the lower layer's top elements.
        let b = &mesh.blocks[0];
        let top = if kind.is_planar() { 2 } else { 5 };
        let per_layer = b.len() / elements;
        let connectivity = (0..per_layer)
            .flat_map(|e| {
                let nodes = b.element(per_layer * (elements / 2 - 1) + e);
                crate::mesh::surface::side_nodes(kind, top).into_iter().map(|a| nodes[a])
            })
            .collect();
        let surface = Surface { kind: FaceKind::of(kind), connectivity };
        mesh.surfaces.insert("interface".into(), surface);
        mesh
    }

    fn recover(mesh: &Mesh, region: Region, u: &[[f64; 3]]) -> (Vec<u32>, Vec<f64>) {
        let nodes = mesh.surfaces["interface"].nodes();
        let recovery = SedRecovery::new(mesh, "interface", region, &nodes).unwrap();
        let sed = read(mesh, &recovery, u);
        (nodes, sed)
    }

    fn read(mesh: &Mesh, recovery: &SedRecovery, u: &[[f64; 3]]) -> Vec<f64> {
        let b = &mesh.blocks[0];
        let geometry = [BlockGeometry::new(b.kind, &mesh.nodes, &b.connectivity).unwrap()];
        let materials = Materials::new([2.0, 1.0, 1.0, 1.0, 1.0].map(material).into());
        recovery
            .sed_mpa(&Deformed {
                mesh,
                geometry: &geometry,
                materials: &materials,
                u,
                history: &|_, _| &[],
            })
            .unwrap()
    }

    /// Even strain: both sides exact, with the jump of the moduli between them.
    #[test]
    fn sed_of_an_even_strain_is_exact_on_both_sides() {
        let h = [[0.1, 0.05, 0.0], [-0.02, -0.08, 0.0], [0.0; 3]];
        let exact = |e| {
            let k = Kinematics::new(h);
            material(e).stored_mpa(&k, k.j_minus_1, &[])
        };
        for kind in KINDS {
            let mesh = layered(kind, 4);
            let u: Vec<[f64; 3]> = mesh
                .nodes
                .iter()
                .map(|x| std::array::from_fn(|i| (0..3).map(|j| h[i][j] * x[j]).sum()))
                .collect();
            for (region, e) in [(Region(1), 1.0), (Region(0), 2.0)] {
                for sed in recover(&mesh, region, &u).1 {
                    assert!((sed / exact(e) - 1.0).abs() < 1e-12, "{kind:?} {region:?}");
                }
            }
        }
    }

    /// On a smooth displacement errors fall with the mesh: `Hex27` and `Quad9` by
    /// the square of its size; the others at least in proportion to it.
    #[test]
    fn sed_converges_at_the_interface() {
        let field = |x: [f64; 3]| [0.1 * (1.7 * x[1]).sin(), 0.1 * (1.3 * x[0] + x[1]).cos(), 0.0];
        let gradient = |x: [f64; 3]| {
            let s = -0.1 * (1.3 * x[0] + x[1]).sin();
            [[0.0, 0.17 * (1.7 * x[1]).cos(), 0.0], [1.3 * s, s, 0.0], [0.0; 3]]
        };
        for kind in KINDS {
            let error = |elements: usize| {
                let mesh = layered(kind, elements);
                let u: Vec<_> = mesh.nodes.iter().map(|&x| field(x)).collect();
                let (nodes, sed) = recover(&mesh, Region(1), &u);
                let mut worst = 0.0f64;
                for (&n, found) in nodes.iter().zip(sed) {
                    let k = Kinematics::new(gradient(mesh.nodes[n as usize]));
                    let exact = material(1.0).stored_mpa(&k, k.j_minus_1, &[]);
                    worst = worst.max((found - exact).abs());
                }
                worst
            };
            let (coarse, fine) = (error(6), error(12));
            let order = (coarse / fine).log2();
            let least = if kind.dilatation_functions() > 1 { 1.7 } else { 0.8 };
            assert!(order > least, "{kind:?}: order {order}, error {fine}");
        }
    }

    /// The displacement of a manufactured field that varies in depth, solved for: elements have the
    /// strain of its best approximation, not of its interpolant, which is what Gauss points are
    /// better at. Here the nodal interpolant stands for it; fits still are of higher order than
    /// readings at nodes, at the interface and not below it.
    #[test]
    fn fits_are_closer_than_readings_at_nodes() {
        let field = |x: [f64; 3]| {
            let wave = (4.0 * x[0]).sin() * (3.0 * x[1]).cos() * (-2.0 * x[2]).exp();
            [0.03 * wave, -0.02 * wave, 0.04 * wave]
        };
        let gradient = |x: [f64; 3]| {
            let (s, c) = (4.0 * x[0]).sin_cos();
            let (t, d) = (3.0 * x[1]).sin_cos();
            let e = (-2.0 * x[2]).exp();
            let g = [4.0 * c * d * e, -3.0 * s * t * e, -2.0 * s * d * e];
            [0.03, -0.02, 0.04].map(|a| g.map(|v| a * v))
        };
        let error = |elements: usize, fitted: bool| {
            let mesh = layered(ElementKind::Hex27, elements);
            let u: Vec<_> = mesh.nodes.iter().map(|&x| field(x)).collect();
            let nodes = mesh.surfaces["interface"].nodes();
            let recovery = if fitted {
                SedRecovery::fitted(&mesh, "interface", Region(1), &nodes)
            } else {
                SedRecovery::new(&mesh, "interface", Region(1), &nodes)
            };
            let sed = read(&mesh, &recovery.unwrap(), &u);
            let (mut miss, mut size) = (0.0, 0.0);
            for (&n, found) in nodes.iter().zip(sed) {
                let k = Kinematics::new(gradient(mesh.nodes[n as usize]));
                let exact = material(1.0).stored_mpa(&k, k.j_minus_1, &[]);
                miss += (found - exact).powi(2);
                size += exact * exact;
            }
            f64::sqrt(miss / size)
        };
        let (nodes, coarse, fine) = (error(6, false), error(4, true), error(6, true));
        assert!(fine < nodes, "fits {fine}, nodes {nodes}");
        let order = (coarse / fine).ln() / 1.5f64.ln();
        assert!(order > 2.0, "order {order}: {coarse} {fine}");
    }

    #[test]
    fn a_layer_that_does_not_reach_the_surface_is_an_error() {
        let mesh = layered(ElementKind::Quad4, 4);
        let nodes = mesh.surfaces["interface"].nodes();
        let error = SedRecovery::new(&mesh, "interface", Region(4), &nodes).unwrap_err();
        assert_eq!(error.region, Region(4));
    }
}
