//! The cell that a place of the lattice lies in.

use crate::Cells;
use std::collections::HashMap;

/// Finds the cell of a place: cells begin at multiples of their sizes.
pub(super) struct Finder<'a> {
    places: &'a [[u32; 5]],
    sizes: Vec<[u32; 2]>,
    cells: HashMap<[u32; 5], usize>,
    /// Found last: the next place mostly lies in it too.
    last: usize,
}

impl<'a> Finder<'a> {
    pub(super) fn new(cells: &'a Cells) -> Self {
        let mut sizes: Vec<[u32; 2]> = cells.place.iter().map(|p| [p[3], p[4]]).collect();
        sizes.sort_unstable();
        sizes.dedup();
        let by_place = cells.place.iter().enumerate().map(|(n, p)| (*p, n)).collect();
        Self { places: &cells.place, sizes, cells: by_place, last: 0 }
    }

    /// A cell, and where along its rows and columns, -1 to 1.
    pub(super) fn cell(&mut self, side: u32, at: [f64; 2]) -> Option<(usize, [f64; 2])> {
        if !self.places.get(self.last).is_some_and(|place| holds(place, side, at)) {
            self.last = self.search(side, at)?;
        }
        let [_, row, column, rows, columns] = self.places[self.last];
        let along =
            |at: f64, first: u32, size: u32| 2.0 * (at - f64::from(first)) / f64::from(size) - 1.0;
        Some((self.last, [along(at[0], row, rows), along(at[1], column, columns)]))
    }

    fn search(&self, side: u32, [row, column]: [f64; 2]) -> Option<usize> {
        // A place on the last row or column belongs to the cell before it.
        const BEFORE: f64 = 1e-3;
        for back in [[0.0, 0.0], [BEFORE, 0.0], [0.0, BEFORE], [BEFORE, BEFORE]] {
            let at = [row - back[0], column - back[1]];
            for &size in &self.sizes {
                let first = [0, 1].map(|k| (at[k].max(0.0) as u32) / size[k] * size[k]);
                if let Some(&n) = self.cells.get(&[side, first[0], first[1], size[0], size[1]]) {
                    return Some(n);
                }
            }
        }
        None
    }
}

/// Whether a place lies in a cell, but for the cell's last row and column.
fn holds(cell: &[u32; 5], side: u32, at: [f64; 2]) -> bool {
    let within =
        |at: f64, first: u32, size: u32| (f64::from(first)..f64::from(first + size)).contains(&at);
    side == cell[0] && within(at[0], cell[1], cell[3]) && within(at[1], cell[2], cell[4])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::two_cells;

    #[test]
    fn a_place_is_found_in_its_cell() {
        let cells = two_cells();
        let mut found = Finder::new(&cells);
        assert_eq!(found.cell(1, [0.0, 64.0]), Some((0, [-1.0, 0.0])));
        assert_eq!(found.cell(1, [32.0, 160.0]), Some((1, [-0.5, -0.5])));
        // The far corner belongs to the last cell.
        assert_eq!(found.cell(1, [128.0, 200.0]), Some((1, [1.0, 0.125])));
        assert_eq!(found.cell(1, [128.0, 256.0]), Some((1, [1.0, 1.0])));
        assert_eq!(found.cell(0, [0.0, 0.0]), None);
        assert_eq!(found.cell(1, [0.0, 300.0]), None);
    }
}
