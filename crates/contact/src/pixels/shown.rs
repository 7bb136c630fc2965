//! Which part of a map a frame shows something in, so that the rest need not be gone through.

use papilla_atlas::MAP_LEN;
use std::ops::Range;

/// A stretch of the map, row by row; empty at first.
#[derive(Clone, Debug, Default)]
pub(super) struct Shown(Range<usize>);

impl Shown {
    /// All of the map.
    pub(super) fn all() -> Self {
        Self(0..MAP_LEN)
    }

    /// Takes a pixel in.
    pub(super) fn take(&mut self, index: usize) {
        self.0 = if self.0.is_empty() {
            index..index + 1
        } else {
            self.0.start.min(index)..self.0.end.max(index + 1)
        };
    }

    /// Takes in as many pixels more at both ends; none of nothing.
    pub(super) fn widen(&mut self, by: usize) {
        if !self.0.is_empty() {
            self.0 = self.0.start.saturating_sub(by)..(self.0.end + by).min(MAP_LEN);
        }
    }

    /// From the first to the last of them.
    pub(super) fn range(&self) -> Range<usize> {
        self.0.clone()
    }
}
