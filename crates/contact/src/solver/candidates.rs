//! Vertices that may come into contact, and the slots that hold them.

use super::{CANDIDATE_MM, KEPT_MM, Solver};
use crate::answer::Effort;
use crate::objects::View;

/// Vertices that things may touch.
#[derive(Clone, Copy)]
pub(super) struct Seen<'a> {
    /// Free distance, reference mm, and vertex.
    pub(super) candidates: &'a [(f64, u32)],
    /// Whether all things are far from all of the finger.
    pub(super) is_far: bool,
}

impl Solver {
    /// Finds them; returns whether all things are far from all of the finger.
    pub(super) fn find_candidates(&mut self, view: View<'_>, effort: &mut Effort) -> bool {
        let Self { model, candidates, wanted, patch, .. } = self;
        for (_, vertex) in candidates.drain(..) {
            wanted[vertex as usize] = false;
        }
        let asked = view.near(model, KEPT_MM, |vertex, free| {
            if free < CANDIDATE_MM || (free < KEPT_MM && patch.slot(vertex).is_some()) {
                candidates.push((free, vertex));
            }
        });
        view.count(asked, effort);
        effort.candidates = candidates.len() as u32;
        let [slots, _] = patch.room();
        self.overflow = candidates.len() > slots;
        if self.overflow {
            candidates.select_nth_unstable_by(slots, |a, b| a.0.total_cmp(&b.0));
            candidates.truncate(slots);
        }
        for (_, vertex) in candidates {
            wanted[*vertex as usize] = true;
        }
        asked <= 1
    }

    /// Makes the patch hold the candidates.
    pub(super) fn keep_candidates(&mut self) {
        for slot in (0..self.patch.vertices().len()).rev() {
            if !self.wanted[self.patch.vertices()[slot] as usize] {
                self.patch.remove(slot);
                self.made = 0;
            }
        }
        let stride = self.patch.stride();
        self.patch.make_room(self.candidates.len());
        for &(_, vertex) in &self.candidates {
            if self.patch.slot(vertex).is_none() {
                self.patch.add(&self.model, vertex);
            }
        }
        if self.patch.stride() != stride {
            self.made = 0;
        }
    }
}
