//! Gaps of displaced pixels.

use super::Window;
use crate::answer::{Effort, Person};
use crate::error::ContactError;
use crate::objects::View;
use crate::pixels::PixelSkin;

/// Gap of a displaced pixel beyond which nothing presses, reference mm.
const FREE_MM: f32 = 0.3;
/// Depth of a displaced pixel from which the side that it has to come out of is looked for, mm.
const DEEP_MM: f32 = 0.01;
/// Cosine between the skin's and the object's normal below which that is done.
const STEEP: f32 = 0.5;
/// The least that counts.
const LEVEL_MIN: f32 = 0.2;
/// Most steps of it.
const TURNS_MAX: u32 = 8;

/// Radius of a pixel's bead over the distance of the map's pixels.
const BEAD: f32 = 0.5;

impl Window {
    /// Gaps of the pixels along the skin's normal, under the pressure whose displacement is
    /// `grid`, mm; none of those that are left when the frame's budget is used.
    ///
    /// A pixel is a bead under the skin that touches it from within. Its gap is that of the skin where a
    /// thing is level with it; an edge that is sharper than a pixel is round to it, so that gaps and
    /// normals have no jumps as it moves along the skin.
    pub(in super::super) fn measure(
        &mut self,
        skin: &PixelSkin,
        view: View<'_>,
        person: Person,
        grid: &[f32],
        effort: &mut Effort,
    ) -> Result<(), ContactError> {
        let bead_mm = BEAD * skin.apart_mm;
        for slot in 0..self.entries.len() {
            let inward = self.inward[slot];
            self.own_mm[slot] = 0.0;
            if view.is_spent(effort) {
                // What is known presses there.
                (self.give[slot], self.gap_mm[slot]) = (0.0, 0.0);
                (self.normal[slot], self.friction[slot]) = (inward, 0.0);
                continue;
            }
            let stencil = &skin.stencils[self.entries[slot] as usize];
            let dent = stencil.value(|vertex| self.dent_mm[vertex]);
            let own = grid[self.cells[slot] as usize] - dent;
            self.own_mm[slot] = own;
            let (mut way, mut turns) = (0.0, 0);
            let (nearest, along) = loop {
                let at: [f32; 3] = std::array::from_fn(|i| {
                    self.at_mm[slot][i] + (own + way + bead_mm) * inward[i]
                });
                let nearest = view.nearest_at(at.map(f64::from)).ok_or(ContactError::Diverged)?;
                view.count(1, effort);
                view.count_more(nearest.asked, effort);
                let along: f32 =
                    nearest.normal.iter().zip(inward).map(|(a, b)| *a as f32 * b).sum();
                let gap = nearest.gap_mm as f32 - bead_mm;
                // Deep inside, the nearest side need not be the one in whose way the skin is.
                let is_aside = gap < -DEEP_MM && (along < STEEP || gap < -FREE_MM);
                if is_aside && turns < TURNS_MAX && !view.is_spent(effort) {
                    way += -gap;
                    turns += 1;
                    continue;
                }
                break (nearest, along);
            };
            let gap = nearest.gap_mm.min(1e3) as f32 - bead_mm;
            let gap = gap / along.clamp(LEVEL_MIN, 1.0) - way;
            // In the units of the reference finger: pressure over stiffness, length over width.
            self.give[slot] =
                (person.stiffness / (nearest.stiffness_mpa_per_mm * person.width)) as f32;
            self.gap_mm[slot] = gap;
            self.friction[slot] = nearest.friction as f32;
            self.normal[slot] = nearest.normal.map(|n| n as f32);
        }
        Ok(())
    }

    /// Gaps of the pixels that are solved for, mm; near the skin's edge with what their pressure has
    /// beside the vertices'.
    pub(in super::super) fn gradient(
        &self,
        [pressure, of_vertices]: [&[f32]; 2],
        gradient: &mut [f32],
    ) {
        for (slot, gradient) in gradient.iter_mut().enumerate() {
            let (gap, p) = (self.gap_mm[slot], pressure[slot]);
            let is_free = gap > FREE_MM && !(p > 0.0);
            let eased = self.ease[slot] * (p - of_vertices[slot]);
            *gradient = if is_free { 1e3 } else { gap + self.give[slot] * p + eased };
        }
    }
}
