//! The work of the parts of a frame, in the units of its budget.

use crate::answer::Effort;
use crate::objects::View;

/// Units of the distance from a sphere.
const DISTANCE: u64 = 25;
/// Distances that a look along the way in takes where things are narrow; of wide ones it takes fewer.
const LOOK: u64 = 30;
/// Of so many vertices one is looked at on a way in, when the budget is used.
const FEW: usize = 8;

impl View<'_> {
    /// Counts distances from all things.
    #[inline]
    pub(crate) fn count(&self, distances: u32, effort: &mut Effort) {
        effort.distances += distances;
        let each = if self.held.is_empty() { self.cost } else { LOOK * self.cost };
        effort.work += DISTANCE * u64::from(distances) * each;
    }

    /// Counts a look along the way in.
    pub(crate) fn count_look(&self, effort: &mut Effort) {
        effort.distances += 1;
        effort.work += DISTANCE * LOOK * self.cost;
    }

    /// Counts what was asked beyond one distance from all things, in distances of a sphere.
    #[inline]
    pub(crate) fn count_more(&self, asked: u32, effort: &mut Effort) {
        effort.work += DISTANCE * u64::from(asked);
    }

    /// Whether the frame has used its budget.
    pub(crate) fn is_spent(&self, effort: &Effort) -> bool {
        effort.work >= self.work_max
    }

    /// Whether the budget leaves out a vertex on a way in: the frame is not settled then.
    pub(crate) fn leaves_out(&self, vertex: usize, effort: &Effort) -> bool {
        !vertex.is_multiple_of(FEW) && self.is_spent(effort)
    }

    /// The lesser of `left` and of how many steps of so many units are within the budget.
    pub(crate) fn most(&self, left: u32, units: u64, effort: &Effort) -> u32 {
        let within = self.work_max.saturating_sub(effort.work) / units.max(1);
        left.min(u32::try_from(within).unwrap_or(u32::MAX))
    }

    /// The same view, with what is left of the budget.
    pub(crate) fn after(self, spent: &Effort) -> Self {
        Self { work_max: self.work_max.saturating_sub(spent.work), ..self }
    }
}
