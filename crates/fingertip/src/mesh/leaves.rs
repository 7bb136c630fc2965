//! The skin's cells split where a contact asks for shorter ones.
//!
//! The half cube's lattice is fixed; a cell of it is halved, along its rows or its columns,
//! until nodes are as close as the contact wants them. Neighbours differ by one halving at most, so
//! that a node in the middle of a small edge follows the three of the large one
//! ([`papilla_fem::mesh::hanging`]). Every cell is a rectangle of the lattice: where a place of the
//! skin lies in which cell is known without a search.

use super::half_cube::{GridSize, SIDES};
use crate::geometry::fingertip::{FingertipShape, SurfaceParameter};
use papilla_vector::norm;
use std::collections::{BTreeMap, BTreeSet, HashSet};

/// Times that a cell can be halved along each of its sides.
const HALVINGS_MAX: u32 = 6;
/// Intervals of the finest lattice in one of the base's.
const TIMES: u32 = 1 << HALVINGS_MAX;
/// Largest ratio of a cell's sides.
const ASPECT_MAX: f64 = 5.0;

/// A cell: a rectangle of a side of the half cube, in intervals of the finest lattice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Leaf {
    /// Side of the half cube: front, palmar, left, dorsal, right.
    pub side: usize,
    /// Its first row and column.
    pub first: [u32; 2],
    /// Rows and columns.
    pub size: [u32; 2],
}

type Address = [u32; 3];

/// Who says how close nodes have to be: from nine points of a cell, mm, and a unit vector along
/// it to a length, mm.
pub(super) type Wanted<'a> = &'a dyn Fn(&[[f64; 3]; 9], [f64; 3]) -> f64;

/// The surface's cells, with their nodes.
#[derive(Clone, Debug)]
pub(super) struct Leaves {
    /// The finest lattice.
    pub size: GridSize,
    pub leaves: Vec<Leaf>,
    /// What a cell that cannot be halved further would have to be, and its nodes' distance, mm; of
    /// those the one that misses most.
    pub unresolved_mm: Option<[f64; 2]>,
    /// Fractions of the body's length at its rows.
    body: Vec<f64>,
}

impl Leaves {
    /// The cells of `base` (two lattice intervals each way), split as `wanted`.
    pub(super) fn new(base: GridSize, shape: &FingertipShape, wanted: Wanted<'_>) -> Self {
        let size = base.times(TIMES);
        let body = size.body_fractions(shape);
        let mut out = Self { size, leaves: Vec::new(), unresolved_mm: None, body };
        let cell = 2 * TIMES;
        let mut stack = Vec::new();
        for side in 0..SIDES {
            let [rows, columns] = size.extent(side);
            for row in (0..rows).step_by(cell as usize) {
                for column in (0..columns).step_by(cell as usize) {
                    stack.push(Leaf { side, first: [row, column], size: [cell; 2] });
                }
            }
        }
        while let Some(leaf) = stack.pop() {
            match out.split_along(leaf, shape, wanted) {
                Some(k) => stack.extend(leaf.halves(k)),
                None => out.leaves.push(leaf),
            }
        }
        out.balance();
        out.leaves.sort_unstable();
        out
    }

    /// The same cells, but `cells` (by number) halved along the longer of their sides, and
    /// neighbours as far as these want it; `None` if one of them is as small as cells can be.
    pub(super) fn halved(&self, shape: &FingertipShape, cells: &BTreeSet<usize>) -> Option<Self> {
        let mut out = Self { leaves: Vec::with_capacity(self.leaves.len()), ..self.clone() };
        for (n, &leaf) in self.leaves.iter().enumerate() {
            if !cells.contains(&n) {
                out.leaves.push(leaf);
                continue;
            }
            let length = self.sides_mm(leaf, shape).1.map(norm);
            let k = usize::from(length[1] > length[0]);
            if leaf.size[k] <= 2 {
                return None;
            }
            out.leaves.extend(leaf.halves(k));
        }
        out.balance();
        out.leaves.sort_unstable();
        Some(out)
    }

    /// Nodes of a cell, mm, and the ways across its middle along its rows and its columns.
    fn sides_mm(&self, leaf: Leaf, shape: &FingertipShape) -> ([[f64; 3]; 9], [[f64; 3]; 2]) {
        let at = leaf.nodes(self.size).map(|a| shape.skin(self.parameter(a)));
        let along = [[at[1], at[7]], [at[3], at[5]]]
            .map(|[a, b]| -> [f64; 3] { std::array::from_fn(|i| b[i] - a[i]) });
        (at, along)
    }

    /// Parameter of an address of the finest lattice.
    pub(super) fn parameter(&self, at: Address) -> SurfaceParameter {
        self.size.parameter(at, &self.body)
    }

    /// Row and column of the finest lattice at those of another one, whose rows of the body are at
    /// `body`: both have the same angles on the cap and the same fractions on the body.
    pub(super) fn place(
        &self,
        of: GridSize,
        body: &[f64],
        side: usize,
        [row, column]: [f64; 2],
    ) -> [f64; 2] {
        let along = |k: f64| {
            let beyond = k - f64::from(of.cap);
            if beyond <= 0.0 {
                return k * f64::from(self.size.cap) / f64::from(of.cap);
            }
            let below = (beyond as usize).min(body.len() - 2);
            let fraction = body[below] + (beyond - below as f64) * (body[below + 1] - body[below]);
            let next = self.body.partition_point(|f| *f < fraction).clamp(1, self.body.len() - 1);
            let (from, to) = (self.body[next - 1], self.body[next]);
            f64::from(self.size.cap) + (next - 1) as f64 + (fraction - from) / (to - from)
        };
        let [rows, columns] = of.extent(side).map(f64::from);
        let [all_rows, all_columns] = self.size.extent(side).map(f64::from);
        let column = if side == 0 { column * all_columns / columns } else { along(column) };
        // Rounding must not lead over the edge.
        [(row * all_rows / rows).clamp(0.0, all_rows), column.clamp(0.0, all_columns)]
    }

    /// Along which of its directions a cell has to be halved.
    fn split_along(
        &mut self,
        leaf: Leaf,
        shape: &FingertipShape,
        wanted: Wanted<'_>,
    ) -> Option<usize> {
        let (at, along) = self.sides_mm(leaf, shape);
        let length = along.map(norm);
        // The longest first, so that cells do not become needles on the way.
        let order = if length[0] >= length[1] { [0, 1] } else { [1, 0] };
        for k in order {
            let spacing_mm = 0.5 * length[k];
            let wanted_mm = wanted(&at, along[k].map(|v| v / length[k]));
            if leaf.size[k] > 2 {
                if spacing_mm > wanted_mm || length[k] > ASPECT_MAX * length[1 - k] {
                    return Some(k);
                }
            } else if self.unresolved_mm.map_or(1.0, |[w, s]| s / w) < spacing_mm / wanted_mm {
                self.unresolved_mm = Some([wanted_mm, spacing_mm]);
            }
        }
        None
    }

    /// Halves cells until neighbours differ by one halving at most.
    fn balance(&mut self) {
        loop {
            let edges: HashSet<[Address; 2]> =
                self.leaves.iter().flat_map(|l| l.edges(self.size)).map(|(_, e)| ends(e)).collect();
            let mut next = Vec::with_capacity(self.leaves.len());
            for leaf in &self.leaves {
                let too_long = leaf.edges(self.size).into_iter().find(|(_, [a, m, b])| {
                    let quarter = |p: Address, q: Address| ends([p, p, middle(p, q)]);
                    m != a
                        && [[*a, *m], [*m, *a], [*b, *m], [*m, *b]]
                            .into_iter()
                            .any(|[p, q]| middle(p, q) != p && edges.contains(&quarter(p, q)))
                });
                match too_long {
                    Some((k, _)) => next.extend(leaf.halves(k)),
                    None => next.push(*leaf),
                }
            }
            if next.len() == self.leaves.len() {
                return;
            }
            self.leaves = next;
        }
    }

    /// Nodes that hang, with near end, middle and far end of the edge that they lie on.
    pub(super) fn hanging(&self) -> BTreeMap<Address, [Address; 3]> {
        let all = || self.leaves.iter().flat_map(|l| l.edges(self.size));
        let edges: HashSet<[Address; 2]> = all().map(|(_, e)| ends(e)).collect();
        let mut hanging = BTreeMap::new();
        for (_, [a, m, b]) in all().filter(|(_, [a, m, _])| edges.contains(&ends([*a, *a, *m]))) {
            hanging.insert(middle(a, m), [a, m, b]);
            hanging.insert(middle(m, b), [b, m, a]);
        }
        hanging
    }
}

impl Leaf {
    /// Addresses of its nodes, row by row.
    pub(super) fn nodes(self, size: GridSize) -> [Address; 9] {
        std::array::from_fn(|n| {
            let (r, c) = (n as u32 / 3, n as u32 % 3);
            let at = [self.first[0] + r * self.size[0] / 2, self.first[1] + c * self.size[1] / 2];
            size.address(self.side, at)
        })
    }

    /// The direction and the nodes of each edge.
    fn edges(self, size: GridSize) -> [(usize, [Address; 3]); 4] {
        let n = self.nodes(size);
        [
            (1, [n[0], n[1], n[2]]),
            (1, [n[6], n[7], n[8]]),
            (0, [n[0], n[3], n[6]]),
            (0, [n[2], n[5], n[8]]),
        ]
    }

    fn halves(self, along: usize) -> [Self; 2] {
        let mut first = self;
        first.size[along] /= 2;
        let mut second = first;
        second.first[along] += first.size[along];
        [first, second]
    }

    /// Reference coordinates along rows and columns (-1 to 1) of a place, if it is in the cell.
    pub(super) fn reference(self, place: [f64; 2]) -> Option<[f64; 2]> {
        let at = [0, 1]
            .map(|k| 2.0 * (place[k] - f64::from(self.first[k])) / f64::from(self.size[k]) - 1.0);
        at.iter().all(|x| x.abs() <= 1.0).then_some(at)
    }
}

/// The ends of an edge, whichever way it is walked.
fn ends([a, _, b]: [Address; 3]) -> [Address; 2] {
    if a <= b { [a, b] } else { [b, a] }
}

fn middle(a: Address, b: Address) -> Address {
    std::array::from_fn(|i| u32::midpoint(a[i], b[i]))
}

#[cfg(test)]
mod tests {
    use super::*;

    const BASE: GridSize = GridSize { across: 8, side: 4, cap: 4, body: 6 };

    /// Cells split towards a point of the skin, spacing growing with the distance from it.
    fn leaves(centre: [f64; 3], least_mm: f64) -> Leaves {
        let shape = FingertipShape::default();
        let centre = shape.on_skin(centre);
        let wanted = |points: &[[f64; 3]; 9], _: [f64; 3]| {
            let away = |p: &[f64; 3]| norm(std::array::from_fn(|i| p[i] - centre[i]));
            least_mm + 0.5 * points.iter().map(away).fold(f64::INFINITY, f64::min)
        };
        Leaves::new(BASE, &shape, &wanted)
    }

    #[test]
    fn cells_cover_every_side_once_and_neighbours_differ_by_one_halving() {
        for centre in [[2.0, 1.0, -6.0], [-6.0, 0.5, 0.0], [5.0, -7.0, -2.0]] {
            let found = leaves(centre, 0.08);
            assert!(found.leaves.len() > 100);
            for side in 0..SIDES {
                let [rows, columns] = found.size.extent(side);
                let area: u64 = found
                    .leaves
                    .iter()
                    .filter(|l| l.side == side)
                    .map(|l| u64::from(l.size[0]) * u64::from(l.size[1]))
                    .sum();
                assert_eq!(area, u64::from(rows) * u64::from(columns));
            }
            let edges: HashSet<[Address; 2]> = found
                .leaves
                .iter()
                .flat_map(|l| l.edges(found.size))
                .map(|(_, e)| ends(e))
                .collect();
            // Every edge has another cell's on its other side, or its halves, or it is half of one;
            // those of the base plane have none.
            let hanging = found.hanging();
            let mut counted = BTreeMap::new();
            for (_, e) in found.leaves.iter().flat_map(|l| l.edges(found.size)) {
                *counted.entry(ends(e)).or_insert(0) += 1;
            }
            for (&[a, b], &count) in &counted {
                let m = middle(a, b);
                let rows = found.size.cap + found.size.body;
                let at_base = a[2] == rows && b[2] == rows;
                let halved = edges.contains(&ends([a, a, m])) && edges.contains(&ends([m, m, b]));
                let small = hanging.contains_key(&m);
                assert!(count == 2 || at_base || halved || small, "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn what_no_cell_can_be_is_told() {
        assert!(leaves([2.0, 1.0, -6.0], 0.08).unresolved_mm.is_none());
        let [wanted, spacing] = leaves([2.0, 1.0, -6.0], 1e-3).unresolved_mm.unwrap();
        assert!(wanted < 0.02 && spacing > wanted && spacing < 0.06, "{wanted} {spacing}");
    }

    #[test]
    fn a_place_lies_in_one_cell_with_its_reference_coordinates() {
        let leaf = Leaf { side: 1, first: [8, 16], size: [8, 4] };
        assert_eq!(leaf.reference([8.0, 18.0]), Some([-1.0, 0.0]));
        assert_eq!(leaf.reference([14.0, 20.0]), Some([0.5, 1.0]));
        assert_eq!(leaf.reference([7.9, 18.0]), None);
    }
}
