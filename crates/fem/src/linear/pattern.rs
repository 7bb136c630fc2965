//! Which entries a mesh's matrix has, and where elements add to them.

use super::DofMap;
use crate::mesh::Mesh;
use std::collections::BTreeSet;

/// Neighbours of every node through elements, itself left out; those that follow others have none.
pub(super) fn node_graph(mesh: &Mesh) -> Vec<BTreeSet<u32>> {
    let mut graph = vec![BTreeSet::new(); mesh.nodes.len()];
    for block in &mesh.blocks {
        for e in 0..block.len() {
            let nodes = mesh.coupled_nodes(block, e);
            for &a in &nodes {
                graph[a as usize].extend(nodes.iter().copied().filter(|&b| b != a));
            }
        }
    }
    graph
}

/// Lower triangle of the pattern, by columns.
pub(super) fn pattern(neighbours: &[BTreeSet<u32>], dofs: &DofMap) -> (Vec<usize>, Vec<usize>) {
    let mut start = vec![0];
    let mut row = Vec::new();
    for node in 0..neighbours.len() {
        for i in 0..3 {
            let column = dofs.of_dof[3 * node + i];
            if column == DofMap::FIXED {
                continue;
            }
            let first = row.len();
            for &b in neighbours[node].iter().chain(std::iter::once(&(node as u32))) {
                row.extend(
                    dofs.of_dof[3 * b as usize..3 * b as usize + 3]
                        .iter()
                        .filter(|&&r| r != DofMap::FIXED && r >= column)
                        .map(|&r| r as usize),
                );
            }
            row[first..].sort_unstable();
            start.push(row.len());
        }
    }
    (start, row)
}

/// Place of entry `(r, c)` among the values.
///
/// # Panics
/// If the pattern has none: no element couples the two.
pub(super) fn entry(column_start: &[usize], row: &[usize], r: usize, c: usize) -> usize {
    let (r, c) = (r.max(c), r.min(c));
    let first = column_start[c];
    let found = row[first..column_start[c + 1]].binary_search(&r);
    assert!(found.is_ok(), "entry ({r}, {c}) is not in the pattern");
    first + found.unwrap_or(0)
}

/// Per block: value index of every local pair `p <= q` of every element, row-major upper
/// triangle, [`DofMap::FIXED`] where a degree of freedom is prescribed.
pub(super) fn scatter_maps(
    mesh: &Mesh,
    dofs: &DofMap,
    column_start: &[usize],
    row: &[usize],
) -> Vec<Vec<u32>> {
    mesh.blocks
        .iter()
        .map(|block| {
            let size = 3 * block.kind.nodes();
            let mut map = Vec::with_capacity(block.len() * size * (size + 1) / 2);
            for e in 0..block.len() {
                let of: Vec<u32> = mesh
                    .coupled_nodes(block, e)
                    .into_iter()
                    .flat_map(|n| (0..3).map(move |i| 3 * n as usize + i))
                    .map(|d| dofs.of_dof[d])
                    .collect();
                for p in 0..size {
                    for q in p..size {
                        map.push(if of[p] == DofMap::FIXED || of[q] == DofMap::FIXED {
                            DofMap::FIXED
                        } else {
                            entry(column_start, row, of[p] as usize, of[q] as usize) as u32
                        });
                    }
                }
            }
            map
        })
        .collect()
}
