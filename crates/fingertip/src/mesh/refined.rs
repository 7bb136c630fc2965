//! The skin's grid with cells split for a contact, and how the atlas is read off it.

use super::grading::Spacing;
use super::half_cube::{Grid, GridSize};
use super::leaves::{Leaf, Leaves};
use super::patch::{PATCH_SIDE_QUARTERS, Patch, Vertices, patch_of};
use crate::geometry::fingertip::{FingertipShape, FingertipShapeError};
use papilla_fem::element::shape::{hat_1d, quadratic_1d};
use papilla_fem::mesh::{HangingNode, Mesh};
use std::collections::BTreeMap;

/// Lattice of the atlas' vertices on a mesh whose nodes are elsewhere for each contact.
const ATLAS: GridSize = GridSize { across: 44, side: 32, cap: 24, body: 20 };

/// A grid whose cells were split.
pub(super) struct Refined {
    /// Its cells of nine nodes.
    pub grid: Grid,
    /// Its lattice, the finest.
    pub size: GridSize,
    /// Nodes that hang, and what they follow, as numbers of the grid.
    pub hanging: Vec<HangingNode>,
    leaves: Leaves,
}

impl Refined {
    /// Splits the cells of a lattice as far as `spacing` asks, but those under the nail.
    pub(super) fn new(base: GridSize, shape: &FingertipShape, spacing: Option<&Spacing>) -> Self {
        let wanted = |at: &[[f64; 3]; 9], direction| match spacing {
            Some(s) if !at.iter().any(|&p| shape.under_nail(p)) => s.wanted_mm(at, direction),
            _ => f64::INFINITY,
        };
        let leaves = Leaves::new(base, &body(base, shape), shape, &wanted);
        let size = leaves.size;
        let mut map = BTreeMap::new();
        let cells = leaves
            .leaves
            .iter()
            .map(|l| l.nodes(size).map(|at| size.node_of(&mut map, at)).to_vec())
            .collect();
        let number = |at| map[&at];
        let mut hanging: Vec<HangingNode> = leaves
            .hanging()
            .into_iter()
            .map(|(at, of)| HangingNode { node: number(at), masters: of.map(number) })
            .collect();
        hanging.sort_unstable_by_key(|h| h.node);
        let mut lattice = vec![[0; 3]; map.len()];
        for (at, id) in map {
            lattice[id as usize] = at;
        }
        let parameters = lattice.iter().map(|&at| leaves.parameter(at)).collect();
        Self { grid: Grid { parameters, lattice, cells }, size, hanging, leaves }
    }

    /// What the atlas shows: `interface` is the number of the first node of that layer.
    pub(super) fn patch(
        &self,
        shape: &FingertipShape,
        interface: u32,
    ) -> Result<Patch, FingertipShapeError> {
        let atlas = ATLAS.build(1, ATLAS.first_body_fraction(shape));
        let Patch { skin: shown, triangles, .. } = patch_of(&atlas, ATLAS, 1, 0);
        let skin = self.shown();
        let index = |node: u32| skin.partition_point(|&s| s < node) as u32;
        let mut out = Vertices {
            skin_mm: vec![],
            interface_mm: vec![],
            nodes: vec![],
            quadratic: vec![],
            linear: vec![],
        };
        for v in shown {
            let (leaf, at) = self.find(atlas.lattice[v as usize]);
            let cell = &self.grid.cells[leaf];
            out.nodes.push(std::array::from_fn(|n| index(cell[n])));
            let product = |of: &dyn Fn(i8, f64) -> f64| -> [f64; 9] {
                std::array::from_fn(|n| of(n as i8 / 3 - 1, at[0]) * of(n as i8 % 3 - 1, at[1]))
            };
            out.quadratic.push(product(&|node, x| quadratic_1d(node, x).0));
            out.linear.push(product(&hat_1d));
            let [on_skin, below, ..] = shape.layers(atlas.parameters[v as usize])?;
            out.skin_mm.push(on_skin);
            out.interface_mm.push(below);
        }
        let below = skin.iter().map(|s| s + interface).collect();
        Ok(Patch { skin, interface: below, triangles, vertices: Some(out) })
    }

    /// Nodes of the cells that the atlas shows, in whole or in part, sorted.
    fn shown(&self) -> Vec<u32> {
        let last = self.size.side * PATCH_SIDE_QUARTERS / 4;
        let lattice = &self.grid.lattice;
        let is_shown = |cell: &&Vec<u32>| cell.iter().any(|&s| lattice[s as usize][1] < last);
        let mut nodes: Vec<u32> =
            self.grid.cells.iter().filter(is_shown).flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// The cell that holds a vertex of the atlas, and where in it.
    fn find(&self, vertex: [u32; 3]) -> (usize, [f64; 2]) {
        let (side, [row, column]) = ATLAS.place(vertex);
        let [rows, columns] = ATLAS.extent(side);
        let [all_rows, all_columns] = self.leaves.size.extent(side);
        // Cap and body are finer each by its own factor.
        let scaled = |x: u32, of: u32, to: u32| f64::from(x) * f64::from(to) / f64::from(of);
        let along = |x: u32| {
            let (cap, body) = (self.size.cap, self.size.body);
            if x <= ATLAS.cap {
                scaled(x, ATLAS.cap, cap)
            } else {
                f64::from(cap) + scaled(x - ATLAS.cap, ATLAS.body, body)
            }
        };
        let column = if side == 0 { scaled(column, columns, all_columns) } else { along(column) };
        let place = [scaled(row, rows, all_rows), column];
        let found = self.leaves.leaves.iter().enumerate().find_map(|(n, leaf): (_, &Leaf)| {
            (leaf.side == side).then(|| leaf.reference(place)).flatten().map(|at| (n, at))
        });
        // Cells cover every side.
        found.unwrap_or((0, [0.0; 2]))
    }
}

/// Fractions of the body's length at a lattice's rows: those of the atlas, so that both
/// lattices are one but for how often they are halved.
fn body(base: GridSize, shape: &FingertipShape) -> Vec<f64> {
    let atlas = super::half_cube::geometric_fractions(ATLAS.body, ATLAS.first_body_fraction(shape));
    let at = |k: u32| {
        let x = f64::from(k) * f64::from(ATLAS.body) / f64::from(base.body);
        let below = (x.floor() as usize).min(atlas.len() - 2);
        atlas[below] + (x - below as f64) * (atlas[below + 1] - atlas[below])
    };
    (0..=base.body).map(at).collect()
}

/// Puts nodes that hang where the edges of their neighbours are, in each of the layers of `n` nodes,
/// and names what they follow.
pub(super) fn hang(mesh: &mut Mesh, hanging: &[HangingNode], n: usize) {
    let layers = mesh.nodes.len() / n;
    for layer in 0..layers {
        let of_layer = |s: u32| (layer * n) as u32 + s;
        for h in hanging {
            let own = h.renumbered(of_layer);
            mesh.nodes[own.node as usize] = own.of(|m| mesh.nodes[m as usize]);
            mesh.hanging.push(own);
        }
    }
}
