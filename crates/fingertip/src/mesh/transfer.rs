//! A displacement of a coarsely split mesh at the nodes of a finely split one.

use super::refined::Refined;
use papilla_fem::element::shape::quadratic_1d;

/// A mesh at the nodes and elements of another one with the same layers.
#[derive(Clone, Debug)]
pub struct Transfer {
    /// Nodes and cells of a layer of the mesh that is read.
    nodes: usize,
    cells: usize,
    /// Of each node of a layer of the other: the cell's nodes, and their shape functions there.
    at_node: Vec<([u32; 9], [f64; 9])>,
    /// Of each cell of the other.
    at_cell: Vec<Within>,
}

/// Where a cell is in one of the other mesh: the cell that holds its middle, reference coordinates
/// of the middle there, and its size in them.
#[derive(Clone, Copy, Debug)]
struct Within {
    cell: usize,
    middle: [f64; 2],
    size: [f64; 2],
}

impl Transfer {
    /// From one split of the lattice to another one.
    pub(super) fn new(from: &Refined, to: &Refined) -> Self {
        let at_node = to.grid.lattice.iter().map(|&node| {
            let (cell, [row, column]) = from.cell_at(node);
            let (along, across) =
                (|k: i8| quadratic_1d(k, row).0, |k: i8| quadratic_1d(k, column).0);
            let values = std::array::from_fn(|n| along(n as i8 / 3 - 1) * across(n as i8 % 3 - 1));
            (cell, values)
        });
        let at_cell = to.leaves().iter().map(|leaf| {
            let middle = [0, 1].map(|k| f64::from(leaf.first[k]) + 0.5 * f64::from(leaf.size[k]));
            let (cell, middle) = from.holding(leaf.side, middle);
            let around = from.leaves()[cell].size;
            let size = [0, 1].map(|k| f64::from(leaf.size[k]) / f64::from(around[k]));
            Within { cell, middle, size }
        });
        Self {
            nodes: from.grid.parameters.len(),
            cells: from.grid.cells.len(),
            at_node: at_node.collect(),
            at_cell: at_cell.collect(),
        }
    }

    /// A nodal field of the mesh that is read, at the nodes of the other.
    #[must_use]
    pub fn nodal(&self, field: &[[f64; 3]]) -> Vec<[f64; 3]> {
        field
            .chunks_exact(self.nodes)
            .flat_map(|layer| {
                self.at_node.iter().map(|(nodes, values)| {
                    let mut sum = [0.0; 3];
                    for (&n, v) in nodes.iter().zip(values) {
                        for i in 0..3 {
                            sum[i] += v * layer[n as usize][i];
                        }
                    }
                    sum
                })
            })
            .collect()
    }

    /// A field that is linear in each element, `c . (1, xi, eta, zeta)`, in the other's elements.
    #[must_use]
    pub fn linear(&self, field: &[[f64; 4]]) -> Vec<[f64; 4]> {
        field
            .chunks_exact(self.cells)
            .flat_map(|layer| {
                self.at_cell.iter().map(|w| {
                    let [mean, along, across, outward] = layer[w.cell];
                    let middle = mean + along * w.middle[0] + across * w.middle[1];
                    [middle, along * w.size[0], across * w.size[1], outward]
                })
            })
            .collect()
    }
}
