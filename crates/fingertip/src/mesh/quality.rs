//! How well shaped hexahedra are.

use crate::tissue::Tissue;
use papilla_fem::mesh::Mesh;
use papilla_vector::{cross, dot, norm};

/// Worst shapes among the elements of one tissue.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quality {
    pub elements: usize,
    /// Least `det dX/dxi` over the product of the lengths of its columns, at the
    /// elements' nodes: 1 for a brick, 0 where it folds (Verdict's scaled
    /// Jacobian, taken at all 27 nodes of a `Hex27`).
    pub scaled_jacobian_min: f64,
    /// The node where it is that.
    pub worst_node: u32,
    /// Greatest ratio of an element's longest to its shortest axis, by the
    /// columns of `dX/dxi` at its centre.
    pub aspect_max: f64,
}

/// Quality of the elements of a tissue in a mesh of hexahedra.
pub(super) fn of(mesh: &Mesh, tissue: Tissue) -> Quality {
    let mut quality =
        Quality { elements: 0, scaled_jacobian_min: f64::INFINITY, worst_node: 0, aspect_max: 0.0 };
    for block in &mesh.blocks {
        for e in (0..block.len()).filter(|&e| block.region[e] == tissue.region()) {
            quality.elements += 1;
            let columns = |xi| columns(mesh, block.kind, block.element(e), xi);
            for a in 0..block.kind.nodes() {
                let c = columns(block.kind.node_xi(a));
                let scaled = determinant(&c) / c.iter().map(|v| norm(*v)).product::<f64>();
                // NaN is worst of all.
                if !(scaled >= quality.scaled_jacobian_min) {
                    quality.scaled_jacobian_min = scaled;
                    quality.worst_node = block.element(e)[a];
                }
            }
            let axes = columns([0.0; 3]).map(norm);
            let longest = axes.into_iter().fold(0.0, f64::max);
            let shortest = axes.into_iter().fold(f64::INFINITY, f64::min);
            quality.aspect_max = quality.aspect_max.max(longest / shortest);
        }
    }
    quality
}

/// Columns of `dX/dxi` at a point of an element.
fn columns(
    mesh: &Mesh,
    kind: papilla_fem::element::ElementKind,
    nodes: &[u32],
    xi: [f64; 3],
) -> [[f64; 3]; 3] {
    let (mut value, mut gradient) = ([0.0; 27], [[0.0; 3]; 27]);
    kind.shape(xi, &mut value, &mut gradient);
    std::array::from_fn(|k| {
        std::array::from_fn(|i| {
            nodes.iter().zip(&gradient).map(|(&a, d)| mesh.nodes[a as usize][i] * d[k]).sum()
        })
    })
}

fn determinant(c: &[[f64; 3]; 3]) -> f64 {
    let [a, b, d] = *c;
    dot(a, cross(b, d))
}

#[test]
fn a_sheared_brick_has_the_scaled_jacobian_of_its_angle() {
    let corners = papilla_fem::element::reference::HEX27_LATTICE[..8].iter();
    let nodes = corners.map(|a| a.map(f64::from)).map(|[x, y, z]| [x + y, y, 3.0 * z]).collect();
    let block = papilla_fem::mesh::Block {
        kind: papilla_fem::element::ElementKind::Hex8,
        connectivity: (0..8).collect(),
        region: vec![Tissue::Bone.region()],
    };
    let mesh = Mesh { nodes, blocks: vec![block], ..Mesh::default() };
    let quality = of(&mesh, Tissue::Bone);
    // Sheared by 45 degrees: sin 45; axes 2, 2 sqrt 2 and 6.
    assert!((quality.scaled_jacobian_min - 0.5_f64.sqrt()).abs() < 1e-14);
    assert!((quality.aspect_max - 3.0).abs() < 1e-14 && quality.elements == 1);
}
