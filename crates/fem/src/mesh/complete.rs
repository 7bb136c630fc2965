//! Serendipity hexahedra completed to triquadratic ones, for contact.
//!
//! The faces of 20-node hexahedra cannot carry contact at their nodes (see
//! [`FaceKind::carries_contact`]). Given middle nodes of faces and body where
//! their own shape functions put them, they become 27-node ones of exactly the
//! same shape, with positive shares of area and one order of accuracy more.
//! Commercial codes do the same behind the scenes for faces in contact.

use super::{FaceKind, Mesh};
use crate::element::ElementKind;
use std::collections::HashMap;

/// The mesh itself if the surface `contact` can carry contact (or does not
/// exist), else with every serendipity hexahedron completed.
#[must_use]
pub fn for_contact(mesh: Mesh, contact: &str) -> Mesh {
    let keeps = mesh.surfaces.get(contact).is_none_or(|s| s.kind.carries_contact());
    if keeps { mesh } else { complete(mesh) }
}

/// Completes every `Hex20` to `Hex27` and every `Quad8` face to `Quad9`. New
/// nodes come after the others and join the node sets that hold their face's
/// eight nodes.
#[must_use]
pub fn complete(mut mesh: Mesh) -> Mesh {
    let mut middle: HashMap<[u32; 4], u32> = HashMap::new();
    let mut faces = Vec::new();
    for block in mesh.blocks.iter().filter(|b| b.kind == ElementKind::Hex27) {
        for nodes in block.connectivity.chunks_exact(27) {
            for (side, corners) in block.kind.sides().iter().enumerate() {
                let corners: Vec<u32> = corners.iter().map(|&c| nodes[c]).collect();
                middle.insert(key(&corners), nodes[20 + side]);
            }
        }
    }
    for b in 0..mesh.blocks.len() {
        if mesh.blocks[b].kind != ElementKind::Hex20 {
            continue;
        }
        let old = std::mem::take(&mut mesh.blocks[b].connectivity);
        let mut connectivity = Vec::with_capacity(old.len() / 20 * 27);
        for nodes in old.chunks_exact(20) {
            connectivity.extend(nodes);
            for side in 0..ElementKind::Hex20.sides().len() {
                let face: Vec<u32> = super::surface::side_nodes(ElementKind::Hex20, side)
                    .into_iter()
                    .map(|a| nodes[a])
                    .collect();
                let next = mesh.nodes.len() as u32;
                let id = *middle.entry(key(&face)).or_insert(next);
                if id == next {
                    let x = weighted(&mesh, &[(&face[..4], -0.25), (&face[4..], 0.5)]);
                    mesh.nodes.push(x);
                    faces.push((face, id));
                }
                connectivity.push(id);
            }
            connectivity.push(mesh.nodes.len() as u32);
            let x = weighted(&mesh, &[(&nodes[..8], -0.25), (&nodes[8..], 0.25)]);
            mesh.nodes.push(x);
        }
        mesh.blocks[b].connectivity = connectivity;
        mesh.blocks[b].kind = ElementKind::Hex27;
    }
    for set in mesh.node_sets.values_mut() {
        let held = |n: &u32| set.binary_search(n).is_ok();
        let new: Vec<u32> =
            faces.iter().filter(|(f, _)| f.iter().all(held)).map(|(_, id)| *id).collect();
        set.extend(new);
        set.sort_unstable();
    }
    for surface in mesh.surfaces.values_mut().filter(|s| s.kind == FaceKind::Quad8) {
        // Every face of a surface is a side of some element.
        let whole = |f: &[u32]| f.iter().copied().chain(middle.get(&key(f)).copied()).collect();
        let faces: Vec<Vec<u32>> = surface.connectivity.chunks_exact(8).map(whole).collect();
        surface.connectivity = faces.concat();
        surface.kind = FaceKind::Quad9;
    }
    mesh
}

/// The identity of a face: its corners, sorted.
fn key(face: &[u32]) -> [u32; 4] {
    let mut key = [face[0], face[1], face[2], face[3]];
    key.sort_unstable();
    key
}

fn weighted(mesh: &Mesh, terms: &[(&[u32], f64)]) -> [f64; 3] {
    let mut x = [0.0; 3];
    for (nodes, weight) in terms {
        for &n in *nodes {
            for i in 0..3 {
                x[i] += weight * mesh.nodes[n as usize][i];
            }
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::BlockGeometry;
    use crate::mesh::Region;
    use crate::mesh::block::{BlockLattice, build, even};

    fn curved(kind: ElementKind) -> Mesh {
        let axes = [even(1.0, 4), even(1.0, 4), even(1.0, 4)];
        build(&BlockLattice { axes, layers: vec![Region(1); 2], kind }, |[x, y, z]| {
            [x + 0.1 * y * y, y + 0.1 * z * x, z * (1.0 + 0.2 * x * x)]
        })
    }

    fn volume(mesh: &Mesh) -> f64 {
        let b = &mesh.blocks[0];
        let g = BlockGeometry::new(b.kind, &mesh.nodes, &b.connectivity).unwrap();
        (0..b.len()).map(|e| g.element(e).weights.iter().sum::<f64>()).sum()
    }

    #[test]
    fn completing_keeps_the_shape_and_gives_faces_that_carry_contact() {
        let serendipity = curved(ElementKind::Hex20);
        let whole = for_contact(serendipity.clone(), "z_max");
        assert_eq!(whole.blocks[0].kind, ElementKind::Hex27);
        assert!((volume(&whole) / volume(&serendipity) - 1.0).abs() < 1e-13);
        let twin = curved(ElementKind::Hex27);
        assert_eq!(whole.nodes.len(), twin.nodes.len());
        for (name, set) in &twin.node_sets {
            assert_eq!(whole.node_sets[name].len(), set.len(), "{name}");
            assert_eq!(whole.node_sets[name], whole.surfaces[name].nodes(), "{name}");
            assert!(whole.surfaces[name].kind.carries_contact());
        }
    }

    #[test]
    fn what_carries_contact_is_left_alone() {
        let mesh = for_contact(curved(ElementKind::Hex27), "z_max");
        assert_eq!(mesh.blocks[0].kind, ElementKind::Hex27);
        let mesh = for_contact(curved(ElementKind::Hex20), "no such surface");
        assert_eq!(mesh.blocks[0].kind, ElementKind::Hex20);
    }
}
