//! The skin's grid with cells split for a contact, and how the atlas is read off it.

use super::grading::Spacing;
use super::half_cube::{Grid, GridSize, SIDES};
use super::leaves::{Leaf, Leaves};
use super::patch::{PATCH_SIDE_QUARTERS, Patch, Vertices, patch_of};
use crate::geometry::fingertip::{FingertipShape, FingertipShapeError};
use papilla_fem::element::shape::{hat_1d, quadratic_1d};
use papilla_fem::mesh::{HangingNode, Mesh};
use std::collections::{BTreeMap, BTreeSet};

/// The lattice whose cells are split.
pub(super) const BASE: GridSize = GridSize { across: 8, side: 4, cap: 4, body: 6 };

/// Lattice of the atlas' vertices on a mesh whose nodes are elsewhere for each contact: that of the
/// even mesh of medium density.
const ATLAS: GridSize = super::half_cube::MEDIUM;

/// A grid whose cells were split.
#[derive(Clone, Debug)]
pub(super) struct Refined {
    /// Its cells of nine nodes.
    pub grid: Grid,
    /// Its lattice, the finest.
    pub size: GridSize,
    /// Nodes that hang, and what they follow, as numbers of the grid.
    pub hanging: Vec<HangingNode>,
    /// What the cells were split for.
    pub spacing: Option<Spacing>,
    leaves: Leaves,
}

impl Refined {
    /// Splits the cells of [`BASE`] as far as `spacing` asks, but those under the nail.
    pub(super) fn new(shape: &FingertipShape, spacing: Option<Spacing>) -> Self {
        let wanted = |at: &[[f64; 3]; 9], direction| match &spacing {
            Some(s) if !at.iter().any(|&p| shape.under_nail(p)) => s.wanted_mm(at, direction),
            _ => f64::INFINITY,
        };
        let leaves = Leaves::new(BASE, shape, &wanted);
        Self::of(leaves, spacing)
    }

    /// The same grid with `cells` halved, see [`Leaves::halved`].
    pub(super) fn halved(&self, shape: &FingertipShape, cells: &BTreeSet<usize>) -> Option<Self> {
        Some(Self::of(self.leaves.halved(shape, cells)?, self.spacing.clone()))
    }

    /// Nodes of the cells, and which of them hang.
    fn of(leaves: Leaves, spacing: Option<Spacing>) -> Self {
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
        Self { grid: Grid { parameters, lattice, cells }, size, hanging, spacing, leaves }
    }

    /// What the atlas shows: `interface` is the number of the first node of that layer.
    pub(super) fn patch(
        &self,
        shape: &FingertipShape,
        interface: u32,
    ) -> Result<Patch, FingertipShapeError> {
        let body = ATLAS.body_fractions(shape);
        let atlas = ATLAS.build(1, &body);
        let Patch { skin: shown, triangles, .. } = patch_of(&atlas, ATLAS, 1, 0);
        let skin = self.shown();
        let corners_of = |triangle: &[u32; 3]| {
            let at = triangle.map(|v| atlas.lattice[shown[v as usize] as usize]);
            let on = |side| {
                let place = |a| {
                    let found = ATLAS.place_on(side, a)?.map(f64::from);
                    Some(self.leaves.place(ATLAS, &body, side, found))
                };
                let [a, b, c] = at.map(place);
                Some((side, [a?, b?, c?]))
            };
            // A triangle of the surface lies on one side.
            (0..SIDES).find_map(on).unwrap_or_default()
        };
        let index = |node: u32| skin.partition_point(|&s| s < node) as u32;
        let mut out = Vertices {
            skin_mm: vec![],
            interface_mm: vec![],
            nodes: vec![],
            quadratic: vec![],
            linear: vec![],
            corners: triangles.iter().map(corners_of).collect(),
            cells: self.shown_cells().map(|(leaf, nodes)| (leaf, nodes.map(index))).collect(),
        };
        for &v in &shown {
            let (leaf, at) = self.find(atlas.lattice[v as usize], &body);
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
        let mut nodes: Vec<u32> = self.shown_cells().flat_map(|(_, nodes)| nodes).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Those cells with their nodes.
    fn shown_cells(&self) -> impl Iterator<Item = (Leaf, [u32; 9])> {
        let last = self.size.side * PATCH_SIDE_QUARTERS / 4;
        let is_shown = move |&s: &u32| self.grid.lattice[s as usize][1] < last;
        let cells = self.leaves.leaves.iter().zip(&self.grid.cells);
        cells
            .map(|(leaf, nodes)| (*leaf, std::array::from_fn(|n| nodes[n])))
            .filter(move |(_, nodes): &(Leaf, [u32; 9])| nodes.iter().any(is_shown))
    }

    /// The nodes of the cell that holds an address of the finest lattice, and where in it.
    pub(super) fn cell_at(&self, at: [u32; 3]) -> ([u32; 9], [f64; 2]) {
        let (side, [row, column]) = self.size.place(at);
        let (cell, at) = self.holding(side, [row, column].map(f64::from));
        (std::array::from_fn(|n| self.grid.cells[cell][n]), at)
    }

    /// The cell that holds a vertex of the atlas, and where in it; `body` are the fractions at the
    /// rows of the atlas' lattice.
    fn find(&self, vertex: [u32; 3], body: &[f64]) -> (usize, [f64; 2]) {
        let (side, [row, column]) = ATLAS.place(vertex);
        self.holding(side, self.leaves.place(ATLAS, body, side, [row, column].map(f64::from)))
    }

    /// See [`Leaves::unresolved_mm`].
    pub(super) const fn unresolved_mm(&self) -> Option<[f64; 2]> {
        self.leaves.unresolved_mm
    }

    /// Its cells, on the finest lattice.
    pub(super) fn leaves(&self) -> &[Leaf] {
        &self.leaves.leaves
    }

    /// The cell that holds a place of a side, and where in it.
    pub(super) fn holding(&self, side: usize, place: [f64; 2]) -> (usize, [f64; 2]) {
        let found = self.leaves.leaves.iter().enumerate().find_map(|(n, leaf): (_, &Leaf)| {
            (leaf.side == side).then(|| leaf.reference(place)).flatten().map(|at| (n, at))
        });
        // Cells cover every side.
        found.unwrap_or((0, [0.0; 2]))
    }
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
