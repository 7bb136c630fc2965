//! A planar body and its mirror image about x = 0.

use papilla_fem::element::ElementKind;
use papilla_fem::mesh::{Mesh, Surface};

/// The whole of which `half` (x >= 0) is one half. Nodes of the set `symmetry`
/// are shared and the set is gone; every other set and surface holds both
/// halves. Surfaces that are walked from x = 0 are walked from end to end.
pub(super) fn mirrored(half: &Mesh, symmetry: &str) -> Mesh {
    let mut twin: Vec<u32> = vec![u32::MAX; half.nodes.len()];
    for &n in &half.node_sets[symmetry] {
        twin[n as usize] = n;
    }
    let mut nodes = half.nodes.clone();
    for (n, image) in twin.iter_mut().enumerate().filter(|(_, t)| **t == u32::MAX) {
        *image = nodes.len() as u32;
        let [x, y, z] = half.nodes[n];
        nodes.push([-x, y, z]);
    }
    let image = |n: &u32| twin[*n as usize];
    let mut whole = Mesh { nodes, ..Mesh::default() };
    for block in &half.blocks {
        let turned = turned_round(block.kind);
        let mut both = block.clone();
        for e in 0..block.len() {
            let of = block.element(e);
            both.connectivity.extend(turned.iter().map(|&a| image(&of[a])));
        }
        both.region.extend_from_slice(&block.region);
        whole.blocks.push(both);
    }
    for (name, set) in half.node_sets.iter().filter(|(name, _)| *name != symmetry) {
        let mut both: Vec<u32> = set.iter().copied().chain(set.iter().map(image)).collect();
        both.sort_unstable();
        both.dedup();
        whole.node_sets.insert(name.clone(), both);
    }
    for (name, surface) in &half.surfaces {
        let edges: Vec<&[u32]> = surface.faces().collect();
        let mut connectivity = Vec::new();
        for edge in edges.into_iter().rev() {
            connectivity.extend([image(&edge[1]), image(&edge[0])]);
            connectivity.extend(edge[2..].iter().map(image));
        }
        connectivity.extend_from_slice(&surface.connectivity);
        whole.surfaces.insert(name.clone(), Surface { kind: surface.kind, connectivity });
    }
    whole
}

/// Node order of a mirrored element: reference coordinate xi turned round, so
/// that the element does not fold.
fn turned_round(kind: ElementKind) -> Vec<usize> {
    let lattice = kind.lattice();
    let at = |to: [i8; 3]| lattice.iter().position(|c| *c == to).unwrap_or_default();
    lattice.iter().map(|&[x, y, z]| at([-x, y, z])).collect()
}
