//! SED of quadratic elements, read as that of linear ones is.
//!
//! At its nodes a quadratic element's strain is at its worst: under a contact of a few
//! elements it swings from node to node. In the middle of the quarters of a face,
//! close to the points of a 2 x 2 Gauss rule, it is at its best. So each quarter gives
//! a value, and a vertex takes the mean of the quarters round it: on the same lattice of nodes
//! the very stencil of linear elements.

use super::{NoElement, Sample, SedRecovery, element_on_side, sorted};
use crate::element::ElementKind;
use crate::mesh::surface::side_nodes;
use crate::mesh::{Mesh, Region};
use papilla_vector::norm;
use std::collections::HashMap;

impl SedRecovery {
    /// Recovery at `nodes` of the surface named `surface`, from `region`'s side, which reads
    /// `Hex27` in the middle of the quarters of its faces and others as
    /// [`SedRecovery::new`] does.
    ///
    /// # Errors
    /// [`NoElement`] if a node has no element of that region on the surface.
    pub fn by_quarters(
        mesh: &Mesh,
        surface: &str,
        region: Region,
        nodes: &[u32],
    ) -> Result<Self, NoElement> {
        if mesh.blocks.iter().any(|b| b.kind != ElementKind::Hex27) {
            return Self::new(mesh, surface, region, nodes);
        }
        let owner = element_on_side(mesh, region);
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
        Self::of(samples, by_node, nodes, region)
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
