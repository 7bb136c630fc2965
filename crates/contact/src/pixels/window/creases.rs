//! Directions of force under what is sharper than the vertices show.
//!
//! Without friction, skin is pushed along its own deformed normal. Where an object is smooth, that is the
//! object's. At an edge it lies anywhere between the normals of the faces that meet there, and a pixel has
//! the normal of only one of them.
//!
//! The normal of the deformed skin has two parts. Over long distances it is that of the skin as the vertices
//! move it. Beside that, the pixels' own displacement `K p` tilts it. But the sum of `p` times the slope
//! of `K p` is zero, whatever the object's shape, since `K` is symmetric: it costs nothing to move an
//! object along skin that is the same everywhere. So the pixels' own displacement tilts no force on the
//! whole, and the vertices' skin alone tells the direction. Of the size of a force only the part along that
//! direction counts, as before.

use super::Window;

/// One less the cosine between the normals of object and skin, as a mean over the force, from which on the
/// skin begins to tell the direction, and from which on it alone does. Pixels under plates, pens and balls of 3 mm
/// and more stay below the first.
const SHARP: [f32; 2] = [0.1, 0.2];

impl Window {
    /// Turns the normals of objects to those of the skin, if what presses is sharp; `pressure` is that of all
    /// pixels as gaps were measured. All of them are turned alike: the slopes of only some do not cancel.
    pub(in super::super) fn turn_to_skin(&mut self, pressure: &[f32]) {
        let (mut sum, mut steep) = (0.0f32, 0.0f32);
        for (slot, p) in pressure.iter().enumerate().filter(|(_, p)| **p > 0.0) {
            let load = p * self.area_mm2[slot];
            sum += load;
            steep += load * (1.0 - self.level(slot));
        }
        let [from, to] = SHARP;
        let part = ((steep / sum.max(f32::MIN_POSITIVE) - from) / (to - from)).clamp(0.0, 1.0);
        let weight = part * part * (3.0 - 2.0 * part);
        if !(weight > 0.0) {
            return;
        }
        for slot in 0..self.entries.len() {
            let (level, inward) = (self.level(slot), self.inward[slot]);
            for (normal, inward) in self.normal[slot].iter_mut().zip(inward) {
                *normal += weight * (level * inward - *normal);
            }
        }
    }

    /// Cosine between the normals of object and skin at a pixel; 0 where they face away.
    fn level(&self, slot: usize) -> f32 {
        let both = self.normal[slot].iter().zip(self.inward[slot]);
        both.map(|(normal, inward)| normal * inward).sum::<f32>().clamp(0.0, 1.0)
    }
}
