//! The quad grid of a finger-shaped surface: a cubed half-sphere whose open side
//! is extended along the finger. No pole; every quad has four neighbours but
//! those at the two-by-two corners of the cube, where three meet.

use crate::geometry::fingertip::{FingertipShape, SurfaceParameter};
use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_4;

/// Sides of the half cube: front, palmar, left, dorsal, right.
pub(super) const SIDES: usize = 5;

/// Cells of the grid. Sides are palmar, left, dorsal, right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct GridSize {
    /// Across the palmar and the dorsal side (along `y`).
    pub across: u32,
    /// Across each lateral side (along `z`).
    pub side: u32,
    /// From the cap's front face to its equator.
    pub cap: u32,
    /// From the equator to the base plane.
    pub body: u32,
}

/// The even lattice of medium density, whose nodes are the atlas' vertices.
pub(super) const MEDIUM: GridSize = GridSize { across: 22, side: 16, cap: 12, body: 10 };

/// A surface grid: nodes with their parameters, cells of `step x step` lattice
/// intervals listed with `(step + 1)^2` nodes row by row.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    pub parameters: Vec<SurfaceParameter>,
    /// Lattice address `[i, j, k]` of each node; `k` counts from the front face.
    pub lattice: Vec<[u32; 3]>,
    /// Nodes of each cell, `[row][column]`, counter-clockwise from outside.
    pub cells: Vec<Vec<u32>>,
}

impl GridSize {
    /// Number of the node at a lattice address, new if not met before.
    pub(super) fn node_of(self, map: &mut BTreeMap<[u32; 3], u32>, at: [u32; 3]) -> u32 {
        let next = u32::try_from(map.len()).unwrap_or(u32::MAX);
        *map.entry(at).or_insert(next)
    }

    /// The lattice with each interval cut into as many.
    pub(super) const fn times(self, n: u32) -> Self {
        let Self { across, side, cap, body } = self;
        Self { across: n * across, side: n * side, cap: n * cap, body: n * body }
    }

    /// Fractions of the body's length at its rows: the first as long as the cap's, the others
    /// growing from it.
    pub(super) fn body_fractions(self, shape: &FingertipShape) -> Vec<f64> {
        let cap_row_mm = shape.cap_length_mm * FRAC_PI_4 / f64::from(self.cap);
        geometric_fractions(self.body, cap_row_mm / (shape.length_mm - shape.cap_length_mm))
    }

    /// Rows and columns of a side of the half cube.
    pub(super) const fn extent(self, side: usize) -> [u32; 2] {
        let rows = self.cap + self.body;
        match side {
            0 => [self.side, self.across],
            1 | 3 => [self.across, rows],
            _ => [self.side, rows],
        }
    }

    /// Lattice address of a row and a column of a side; rows, then columns turn counter-clockwise
    /// seen from outside.
    pub(super) const fn address(self, side: usize, [row, column]: [u32; 2]) -> [u32; 3] {
        let (na, nb) = (self.across, self.side);
        match side {
            0 => [column, row, 0],       // front, outward -x
            1 => [row, 0, column],       // palmar, outward -z
            2 => [0, nb - row, column],  // outward -y
            3 => [na - row, nb, column], // dorsal, outward +z
            _ => [na, row, column],      // outward +y
        }
    }

    /// The row and column of a lattice address on a side, if it lies on it.
    pub(super) fn place_on(self, side: usize, [i, j, k]: [u32; 3]) -> Option<[u32; 2]> {
        match side {
            0 => (k == 0).then_some([j, i]),
            1 => (j == 0).then_some([i, k]),
            2 => (i == 0).then(|| [self.side - j, k]),
            3 => (j == self.side).then(|| [self.across - i, k]),
            _ => (i == self.across).then_some([j, k]),
        }
    }

    /// A side and the place on it of a lattice address.
    pub(super) fn place(self, at: [u32; 3]) -> (usize, [u32; 2]) {
        let on = |side| self.place_on(side, at).map(|place| (side, place));
        // Every address of the surface lies on one.
        (0..SIDES).find_map(on).unwrap_or_default()
    }

    /// The grid with cells of `step` lattice intervals (1, or 2 for quadratic
    /// elements, which needs even sizes); `body` holds the fraction of each of the body's rows.
    pub(super) fn build(self, step: u32, body: &[f64]) -> Grid {
        let mut map = BTreeMap::new();
        let mut cells = Vec::new();
        for side in 0..SIDES {
            let [height, width] = self.extent(side);
            for r in (0..height).step_by(step as usize) {
                for c in (0..width).step_by(step as usize) {
                    let mut cell = Vec::with_capacity(((step + 1) * (step + 1)) as usize);
                    for dr in 0..=step {
                        for dc in 0..=step {
                            let at = self.address(side, [r + dr, c + dc]);
                            cell.push(self.node_of(&mut map, at));
                        }
                    }
                    cells.push(cell);
                }
            }
        }
        let mut lattice = vec![[0; 3]; map.len()];
        for (at, id) in map {
            lattice[id as usize] = at;
        }
        let parameters = lattice.iter().map(|&at| self.parameter(at, body)).collect();
        Grid { parameters, lattice, cells }
    }

    /// Parameter of a lattice address; `body` holds the fraction of each of the body's rows.
    pub(super) fn parameter(self, [i, j, k]: [u32; 3], body: &[f64]) -> SurfaceParameter {
        let equiangular = |i: u32, n: u32| {
            // The middle is exactly 0 and the ends exactly 1, for mirror symmetry.
            let t = (2.0 * f64::from(i) - f64::from(n)) / f64::from(n);
            if 2 * i == n {
                0.0
            } else if i == 0 || i == n {
                t
            } else {
                (FRAC_PI_4 * t).tan()
            }
        };
        let (y, z) = (equiangular(i, self.across), equiangular(j, self.side));
        if k <= self.cap {
            let t = 1.0 - f64::from(k) / f64::from(self.cap);
            let height = if k == 0 { 1.0 } else { (FRAC_PI_4 * t).tan() };
            let length = (height * height + y * y + z * z).sqrt();
            SurfaceParameter::Cap([-height / length, y / length, z / length])
        } else {
            let length = (y * y + z * z).sqrt();
            SurfaceParameter::Body([y / length, z / length], body[(k - self.cap) as usize])
        }
    }
}

/// `n + 1` increasing fractions of `[0, 1]`, the first step `first`, each step
/// a fixed ratio longer than the last.
pub(super) fn geometric_fractions(n: u32, first: f64) -> Vec<f64> {
    let sum = |ratio: f64| -> f64 { (0..n).map(|i| ratio.powf(f64::from(i))).sum::<f64>() * first };
    let (mut low, mut high) = (0.2, 5.0);
    for _ in 0..100 {
        let mid = 0.5 * (low + high);
        if sum(mid) < 1.0 { low = mid } else { high = mid }
    }
    let ratio = 0.5 * (low + high);
    let total = sum(ratio);
    let mut fractions = vec![0.0];
    for i in 0..n {
        fractions.push(fractions[i as usize] + first * ratio.powf(f64::from(i)) / total);
    }
    fractions[n as usize] = 1.0;
    fractions
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grid_is_a_closed_tube_with_one_open_end() {
        let size = GridSize { across: 6, side: 4, cap: 2, body: 4 };
        for step in [1, 2] {
            let grid = size.build(step, &geometric_fractions(4, 0.2));
            let perimeter = 2 * (size.across + size.side);
            let nodes = (size.across + 1) * (size.side + 1) + (size.cap + size.body) * perimeter;
            assert_eq!(grid.parameters.len(), nodes as usize);
            // Every directed edge of a cell's corners has its reverse, but on the base.
            let n = step as usize;
            let mut edges = std::collections::HashMap::new();
            for c in &grid.cells {
                let corner = [c[0], c[n], c[n * (n + 1) + n], c[n * (n + 1)]];
                for e in 0..4 {
                    *edges.entry((corner[e], corner[(e + 1) % 4])).or_insert(0) += 1;
                }
            }
            let open = edges.keys().filter(|(a, b)| !edges.contains_key(&(*b, *a))).count();
            assert!(edges.values().all(|&count| count == 1), "a directed edge occurs once");
            assert_eq!(open, (perimeter / step) as usize);
        }
    }

    #[test]
    fn fractions_start_with_the_asked_step_and_end_at_one() {
        let f = geometric_fractions(11, 0.05);
        assert!((f[1] - 0.05).abs() < 1e-9 && (f[11] - 1.0).abs() < 1e-15);
        assert!(f.windows(2).all(|w| w[1] > w[0]));
    }
}
