//! SED of quadratic elements, read as that of linear ones is.
//!
//! At its nodes a quadratic element's strain is at its worst: under a contact of a few
//! elements it swings from node to node. In the middle of the quarters of a face,
//! close to the points of a 2 x 2 Gauss rule, it is at its best. So each quarter gives
//! a value, and a vertex takes the mean of the quarters round it: on the same lattice of nodes
//! the very stencil of linear elements.

use super::{NoElement, Sample, SedRecovery, element_on_side, sorted};
use crate::element::ElementKind;
use crate::mesh::surface::{norm, side_nodes};
use crate::mesh::{Mesh, Tissue};
use std::collections::HashMap;

impl SedRecovery {
    /// Recovery at `nodes` of the surface named `surface`, from `tissue`'s side, which reads
    /// `Hex27` in the middle of the quarters of its faces and others as
    /// [`SedRecovery::new`] does.
    ///
    /// # Errors
    /// [`NoElement`] if a node has no element of that tissue on the surface.
    pub fn by_quarters(
        mesh: &Mesh,
        surface: &str,
        tissue: Tissue,
        nodes: &[u32],
    ) -> Result<Self, NoElement> {
        if mesh.blocks.iter().any(|b| b.kind != ElementKind::Hex27) {
            return Self::new(mesh, surface, tissue, nodes);
        }
        let owner = element_on_side(mesh, tissue);
        let mut by_node: HashMap<u32, Vec<(usize, f64)>> = HashMap::new();
        let mut samples = Vec::new();
        for face in mesh.surfaces.get(surface).into_iter().flat_map(|s| s.faces()) {
            let Some(&(block, element, side)) = owner.get(&sorted(&face[..4])) else { continue };
            let of_element = mesh.blocks[block].element(element);
            for (xi, quarter) in quarters(side) {
                let quarter = quarter.map(|a| of_element[a]);
                let [corner, before, centre, after] = quarter.map(|n| mesh.nodes[n as usize]);
                let area = area(corner, before, centre, after);
                samples.push(Sample::new(mesh, block, element, xi));
                for n in quarter {
                    by_node.entry(n).or_default().push((samples.len() - 1, 1.0 / area));
                }
            }
        }
        Self::of(samples, by_node, nodes, tissue)
    }
}

/// Middle and local nodes (corner, mid-edge, centre, mid-edge) of the quarters of a side.
fn quarters(side: usize) -> Vec<([f64; 3], [usize; 4])> {
    let kind = ElementKind::Hex27;
    let nodes = side_nodes(kind, side);
    let centre = kind.side_centre(side);
    let local = |xi: [f64; 3]| {
        nodes.iter().copied().find(|&a| (0..3).all(|i| (kind.node_xi(a)[i] - xi[i]).abs() < 1e-12))
    };
    kind.sides()[side]
        .iter()
        .filter_map(|&corner| {
            let x = kind.node_xi(corner);
            let [mut before, mut after] = [x, x];
            let mut in_plane = (0..3).filter(|&i| centre[i].abs() < 0.5);
            before[in_plane.next()?] = 0.0;
            after[in_plane.next()?] = 0.0;
            let middle = std::array::from_fn(|i| 0.5 * (x[i] + centre[i]));
            Some((middle, [corner, local(before)?, local(centre)?, local(after)?]))
        })
        .collect()
}

/// Area of a quadrangle given in order, from its diagonals.
fn area(a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]) -> f64 {
    let (p, q): ([f64; 3], [f64; 3]) =
        (std::array::from_fn(|i| c[i] - a[i]), std::array::from_fn(|i| d[i] - b[i]));
    0.5 * norm(std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        p[j] * q[k] - p[k] * q[j]
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::fingertip::{Density, Order, Parts, build};

    /// On the same lattice of nodes quadratic elements are read by the stencil of linear ones.
    #[test]
    fn a_vertex_takes_the_quarters_round_it() {
        let of = |order| {
            let shape = Default::default();
            let finger = build(&shape, Density::Coarse, order, Parts::default()).unwrap();
            let nodes = &finger.patch.interface;
            let mesh = &finger.mesh;
            SedRecovery::by_quarters(mesh, "interface", Tissue::Dermis, nodes).unwrap()
        };
        let [linear, quadratic] = [Order::Linear, Order::Quadratic].map(of);
        assert_eq!(linear.terms().len(), quadratic.terms().len());
        let sizes = |r: &SedRecovery| {
            let mut sizes: Vec<_> = r.terms().iter().map(Vec::len).collect();
            sizes.sort_unstable();
            sizes
        };
        assert_eq!(sizes(&linear), sizes(&quadratic));
        for terms in quadratic.terms() {
            assert!((terms.iter().map(|t| t.1).sum::<f64>() - 1.0).abs() < 1e-12);
        }
        for sample in quadratic.samples() {
            let off = sample.xi.iter().filter(|x| (x.abs() - 0.5).abs() < 1e-12).count();
            assert_eq!(off, 2, "{:?}", sample.xi);
        }
    }
}
