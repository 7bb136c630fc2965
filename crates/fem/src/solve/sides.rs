//! The elements that faces of a surface are sides of.

use crate::mesh::Mesh;
use crate::mesh::surface::side_nodes;
use std::collections::HashMap;

/// The side of an element that a face is.
#[derive(Clone, Debug)]
pub(super) struct Side {
    pub block: usize,
    pub element: usize,
    /// Place of each node of the face among those of the element.
    pub local: Vec<usize>,
}

/// Finds the sides of a mesh that some faces are.
pub(super) struct Sides<'a> {
    mesh: &'a Mesh,
    owners: HashMap<Vec<u32>, (usize, usize)>,
}

impl<'a> Sides<'a> {
    /// Looks for the elements of `faces`.
    pub(super) fn new<'f>(mesh: &'a Mesh, faces: impl Iterator<Item = &'f [u32]>) -> Self {
        let wanted: HashMap<Vec<u32>, ()> = faces.map(|nodes| (key(nodes), ())).collect();
        let mut owners = HashMap::new();
        for (b, block) in mesh.blocks.iter().enumerate() {
            let sides: Vec<Vec<usize>> =
                (0..block.kind.sides().len()).map(|side| side_nodes(block.kind, side)).collect();
            for e in 0..block.len() {
                let own = block.element(e);
                for side in &sides {
                    let nodes = key(&side.iter().map(|&l| own[l]).collect::<Vec<_>>());
                    if wanted.contains_key(&nodes) {
                        owners.insert(nodes, (b, e));
                    }
                }
            }
        }
        Self { mesh, owners }
    }

    /// The side that a face is; `None` if it belongs to no element.
    pub(super) fn of(&self, face: &[u32]) -> Option<Side> {
        let &(block, element) = self.owners.get(&key(face))?;
        let own = self.mesh.blocks[block].element(element);
        let local = face.iter().filter_map(|n| own.iter().position(|o| o == n)).collect();
        Some(Side { block, element, local })
    }
}

/// The nodes of a face whatever their order.
fn key(nodes: &[u32]) -> Vec<u32> {
    let mut key = nodes.to_vec();
    key.sort_unstable();
    key
}
