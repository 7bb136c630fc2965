//! Where the history variables of viscoelastic materials lie.

use crate::element::{BlockGeometry, HistoryVariables, Materials};
use crate::mesh::Mesh;

/// Where the history of each element is in one long array.
#[derive(Clone, Debug)]
pub struct HistoryLayout {
    /// First number of each element, one list a block, with the end as last entry.
    start: Vec<Vec<usize>>,
    /// Numbers in all.
    pub len: usize,
}

impl HistoryLayout {
    /// `None` if no element's material has history variables.
    pub(super) fn new(
        mesh: &Mesh,
        geometry: &[BlockGeometry],
        materials: &Materials,
    ) -> Option<Self> {
        let mut len = 0;
        let mut start = Vec::with_capacity(mesh.blocks.len());
        for (block, g) in mesh.blocks.iter().zip(geometry) {
            let mut of = vec![len];
            for &region in &block.region {
                len += g.points * materials[region].history_len();
                of.push(len);
            }
            start.push(of);
        }
        (len > 0).then_some(Self { start, len })
    }

    /// Range of an element's numbers.
    #[inline]
    #[must_use]
    pub fn range(&self, block: usize, element: usize) -> std::ops::Range<usize> {
        self.start[block][element]..self.start[block][element + 1]
    }

    /// An element's history variables in `history`.
    #[inline]
    #[must_use]
    pub fn of<'a>(
        &self,
        history: &'a [f64],
        dt_s: f64,
        block: usize,
        element: usize,
    ) -> HistoryVariables<'a> {
        HistoryVariables { history: &history[self.range(block, element)], dt_s }
    }
}
