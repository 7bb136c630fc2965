//! Hexahedra and faces from quad cells and layers of nodes.
//!
//! A cell spans `step x step` lattice intervals (1, or 2 for quadratic elements)
//! and lists its `(step + 1)^2` nodes row by row, counter-clockwise from outside.

use crate::tissue::Tissue;
use papilla_fem::element::ElementKind;
use papilla_fem::element::reference::HEX27_LATTICE;
use papilla_fem::mesh::{Block, FaceKind, Surface};

/// Quad cells over a set of surface nodes.
#[derive(Clone, Copy)]
pub(super) struct Cells<'a> {
    pub cells: &'a [Vec<u32>],
    /// Lattice intervals along each side of a cell, 1 or 2.
    pub step: usize,
}

impl Cells<'_> {
    /// Hexahedra between layers of nodes; `zeta` points outward. `tissue` names
    /// each interval from the outermost, `node` the mesh node of a layer
    /// (0 outermost) and a surface node.
    pub(super) fn hexahedra(self, tissue: &[Tissue], node: impl Fn(usize, u32) -> u32) -> Block {
        let step = self.step;
        let kind = if step == 1 { ElementKind::Hex8 } else { ElementKind::Hex27 };
        let mut block = Block { kind, connectivity: Vec::new(), region: Vec::new() };
        for top in (0..tissue.len()).step_by(step) {
            for cell in self.cells {
                for at in &HEX27_LATTICE[..kind.nodes()] {
                    // -1, 0, 1 to 0 .. step; xi runs along rows, eta along columns.
                    let to = |c: i8| ((i64::from(c) + 1) * step as i64 / 2) as usize;
                    let (r, c, depth) = (to(at[0]), to(at[1]), step - to(at[2]));
                    block.connectivity.push(node(top + depth, cell[r * (step + 1) + c]));
                }
                block.region.push(tissue[top].region());
            }
        }
        block
    }

    /// The cells as faces, counter-clockwise from outside; `node` is the mesh
    /// node of a surface node.
    pub(super) fn faces(self, node: impl Fn(u32) -> u32) -> Surface {
        let (kind, order): (_, &[usize]) = if self.step == 1 {
            (FaceKind::Quad4, &[0, 2, 3, 1])
        } else {
            (FaceKind::Quad9, &[0, 6, 8, 2, 3, 7, 5, 1, 4])
        };
        let of_cell = |cell: &Vec<u32>| order.iter().map(|&i| node(cell[i])).collect::<Vec<_>>();
        Surface { kind, connectivity: self.cells.iter().flat_map(of_cell).collect() }
    }

    /// Sides that bound the cells: `step + 1` nodes each, the cells to their left
    /// when seen from outside.
    pub(super) fn rim(self) -> Vec<Vec<u32>> {
        let (step, w) = (self.step, self.step + 1);
        let sides = |cell: &Vec<u32>| {
            let side = |at: &dyn Fn(usize) -> usize| (0..w).map(|i| cell[at(i)]).collect();
            let around: [Vec<u32>; 4] = [
                side(&|i| i * w),
                side(&|i| step * w + i),
                side(&|i| (step - i) * w + step),
                side(&|i| step - i),
            ];
            around
        };
        let all: Vec<Vec<u32>> = self.cells.iter().flat_map(sides).collect();
        let ends: std::collections::HashSet<_> = all.iter().map(|s| (s[0], s[step])).collect();
        all.into_iter().filter(|s| !ends.contains(&(s[step], s[0]))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two cells side by side on a lattice of `2 step x step` intervals.
    fn two_cells(step: u32) -> Vec<Vec<u32>> {
        let w = step + 1;
        let nodes = |first_row: u32| (0..w * w).map(move |i| first_row * w + i).collect();
        vec![nodes(0), nodes(step)]
    }

    #[test]
    fn the_rim_runs_once_around_with_the_cells_to_its_left() {
        for step in [1, 2] {
            let cells = two_cells(step);
            let rim = Cells { cells: &cells, step: step as usize }.rim();
            assert_eq!(rim.len(), 6, "the side between the cells is not on the rim");
            let next: std::collections::HashMap<_, _> =
                rim.iter().map(|s| (s[0], s[step as usize])).collect();
            let (mut at, mut count) = (0, 0);
            loop {
                (at, count) = (next[&at], count + 1);
                if at == 0 {
                    break;
                }
            }
            assert_eq!(count, 6);
            // Rows run along the first side: the cell's other nodes lie to its left.
            assert_eq!(next[&0], step * (step + 1));
        }
    }

    #[test]
    fn hexahedra_stand_on_the_inner_layer_and_look_outward() {
        for step in [1_u32, 2] {
            let cells = two_cells(step);
            let n = (2 * step + 1) * (step + 1);
            let tissue = [Tissue::Dermis; 2];
            let block = Cells { cells: &cells, step: step as usize }
                .hexahedra(&tissue, |layer, s| layer as u32 * n + s);
            assert_eq!(block.len(), if step == 1 { 4 } else { 2 });
            let first = block.element(0);
            assert!(first[..4].iter().all(|&a| a / n == step), "zeta = -1 is the inner layer");
            assert!(first[4..8].iter().all(|&a| a < n), "zeta = 1 is the outer layer");
        }
    }
}
