//! Meshes: solid elements in blocks, named node sets and surfaces.

pub mod block;
pub mod complete;
pub mod gmsh;
pub mod graded_block;
pub mod hanging;
pub mod lattice;
pub mod nearest;
pub mod probe;
pub mod reader;
pub mod recovery;
pub mod sample;
pub mod supports;
pub mod surface;

use crate::element::ElementKind;
pub use crate::element::Region;
pub use hanging::HangingNode;
use std::collections::BTreeMap;
pub use surface::{FaceKind, Surface};

/// Solid elements of one kind.
#[derive(Clone, Debug)]
pub struct Block {
    /// Kind of every element.
    pub kind: ElementKind,
    /// `kind.nodes()` node indices per element.
    pub connectivity: Vec<u32>,
    /// Region of each element.
    pub region: Vec<Region>,
}

impl Block {
    /// Number of elements.
    #[must_use]
    pub fn len(&self) -> usize {
        self.region.len()
    }

    /// Whether the block has no element.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.region.is_empty()
    }

    /// Nodes of element `e`.
    #[inline]
    #[must_use]
    pub fn element(&self, e: usize) -> &[u32] {
        let n = self.kind.nodes();
        &self.connectivity[e * n..(e + 1) * n]
    }
}

/// A mesh of the undeformed body. Lengths in mm.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Node positions, mm.
    pub nodes: Vec<[f64; 3]>,
    /// Solid elements.
    pub blocks: Vec<Block>,
    /// Named groups of nodes, sorted.
    pub node_sets: BTreeMap<String, Vec<u32>>,
    /// Named surfaces, faces seen counter-clockwise from outside (edges of planar
    /// elements: body on the left).
    pub surfaces: BTreeMap<String, Surface>,
    /// Nodes that follow others, sorted.
    pub hanging: Vec<HangingNode>,
}

impl Mesh {
    /// Number of elements in all blocks.
    #[must_use]
    pub fn element_count(&self) -> usize {
        self.blocks.iter().map(Block::len).sum()
    }

    /// Whether every element is a plane-strain one, in the plane z = 0.
    #[must_use]
    pub fn is_planar(&self) -> bool {
        !self.blocks.is_empty() && self.blocks.iter().all(|b| b.kind.is_planar())
    }

    /// Holds what plane strain holds: displacement along z of every node of a
    /// planar element. `fixed` has one entry a degree of freedom.
    pub fn hold_out_of_plane(&self, fixed: &mut [bool]) {
        for block in self.blocks.iter().filter(|b| b.kind.is_planar()) {
            for &n in &block.connectivity {
                fixed[3 * n as usize + 2] = true;
            }
        }
    }

    /// Drops the nodes that no element uses and numbers the others in their old
    /// order.
    pub fn drop_unused_nodes(&mut self) {
        let mut number = vec![u32::MAX; self.nodes.len()];
        for n in self.blocks.iter().flat_map(|b| &b.connectivity) {
            number[*n as usize] = 0;
        }
        let mut next = 0;
        for n in &mut number {
            if *n == 0 {
                *n = next;
                next += 1;
            }
        }
        let mut at = 0;
        self.nodes.retain(|_| {
            at += 1;
            number[at - 1] != u32::MAX
        });
        let blocks = self.blocks.iter_mut().flat_map(|b| &mut b.connectivity);
        let faces = self.surfaces.values_mut().flat_map(|s| &mut s.connectivity);
        for n in blocks.chain(faces) {
            *n = number[*n as usize];
        }
        self.hanging.retain(|h| number[h.node as usize] != u32::MAX);
        for h in &mut self.hanging {
            *h = h.renumbered(|n| number[n as usize]);
        }
        for set in self.node_sets.values_mut() {
            set.retain(|n| number[*n as usize] != u32::MAX);
            for n in set {
                *n = number[*n as usize];
            }
        }
    }
}
