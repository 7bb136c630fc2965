//! A small block in which three sizes of cells meet: for tests of nodes that hang.

use super::lattice::REGION;
use super::{Block, HangingNode, Mesh};
use crate::element::ElementKind;
use crate::element::reference::HEX27_LATTICE;
use std::collections::{BTreeMap, HashSet};

/// Place of a node, quarters of a mm.
type Address = [u32; 3];

/// Cells in the plane: first corner and size, in quarters of a mm. One of 8, beside it one of 4 and
/// one of 4 that is halved along its own border with the other: three sizes meet.
const CELLS: [[u32; 4]; 4] = [[0, 0, 8, 8], [8, 0, 4, 4], [8, 4, 2, 4], [10, 4, 2, 4]];
/// Layers of elements across, and their height, quarters of a mm.
const LAYERS: [u32; 2] = [2, 4];
const SIZE: [u32; 3] = [12, 8, 8];
/// Set of the nodes on the outside that do not hang.
pub const OUTSIDE: &str = "outside";

/// A block of parallelepipeds of three sizes, of one region; nodes between sizes hang.
pub fn graded_block() -> Mesh {
    let mut number: BTreeMap<Address, u32> = BTreeMap::new();
    let mut block = Block { kind: ElementKind::Hex27, connectivity: vec![], region: vec![] };
    let mut edges: HashSet<[Address; 2]> = HashSet::new();
    for layer in 0..LAYERS[0] {
        for [x, y, width, length] in CELLS {
            let (first, size) = ([x, y, layer * LAYERS[1]], [width, length, LAYERS[1]]);
            let at = |l: [i8; 3]| -> Address {
                std::array::from_fn(|i| first[i] + size[i] * (l[i] + 1) as u32 / 2)
            };
            for l in HEX27_LATTICE {
                let next = number.len() as u32;
                block.connectivity.push(*number.entry(at(l)).or_insert(next));
            }
            for l in HEX27_LATTICE {
                // Lines of three nodes along x and y at every height.
                for i in (0..2).filter(|&i| l[i] == 0 && l[1 - i] != 0) {
                    let [mut from, mut to] = [l; 2];
                    (from[i], to[i]) = (-1, 1);
                    edges.insert([at(from), at(to)]);
                }
            }
            block.region.push(REGION);
        }
    }
    let middle = |a: Address, b: Address| std::array::from_fn(|i| u32::midpoint(a[i], b[i]));
    let mut hanging = BTreeMap::new();
    for &[a, b] in &edges {
        let m = middle(a, b);
        if m != a && edges.contains(&[a, m]) {
            hanging.insert(number[&middle(a, m)], [a, m, b].map(|at| number[&at]));
            hanging.insert(number[&middle(m, b)], [b, m, a].map(|at| number[&at]));
        }
    }
    let mut nodes = vec![[0.0; 3]; number.len()];
    let mut outside = Vec::new();
    for (at, n) in number {
        let [x, y, z] = at.map(|v| 0.25 * f64::from(v));
        nodes[n as usize] = [x + 0.2 * y, y - 0.1 * z, z + 0.15 * x];
        if !hanging.contains_key(&n) && (0..3).any(|i| at[i] == 0 || at[i] == SIZE[i]) {
            outside.push(n);
        }
    }
    outside.sort_unstable();
    let hanging = hanging.into_iter().map(|(node, masters)| HangingNode { node, masters });
    Mesh {
        nodes,
        blocks: vec![block],
        hanging: hanging.collect(),
        node_sets: [(OUTSIDE.into(), outside)].into(),
        ..Mesh::default()
    }
}
