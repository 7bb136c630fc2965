//! What contact on pixels keeps from frame to frame, as the start of the next frame here or in
//! another process.

use super::{PixelContact, Shown};

/// The warm start of a [`PixelContact`]: from the same memory, and the solver's, the same frame
/// gets the same bits. Empty if the next frame starts from nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PixelMemory {
    /// Vertices with a force of any kind.
    pub vertices: Vec<u32>,
    /// By these: force x y z that a round starts from, and the one that vertices find by
    /// themselves, N.
    pub forces_n: Vec<[f32; 6]>,
    /// Pixels of the map under pressure.
    pub pixels: Vec<u32>,
    /// By these: pressure, Pa.
    pub pressure_pa: Vec<f32>,
}

impl PixelContact {
    /// What the next frame starts from.
    #[must_use]
    pub fn memory(&self) -> PixelMemory {
        let mut memory = PixelMemory::default();
        if !self.turns.is_warm() {
            return memory;
        }
        let (start, without) = (&self.window.force_n, self.turns.found_without_pixels());
        for vertex in 0..start[0].len() {
            let of = |forces: &[Vec<f32>; 3], i: usize| forces[i][vertex];
            let forces: [f32; 6] =
                std::array::from_fn(|i| of(if i < 3 { start } else { without }, i % 3));
            if forces.iter().any(|f| *f != 0.0) {
                memory.vertices.push(vertex as u32);
                memory.forces_n.push(forces);
            }
        }
        for (index, pressure_pa) in self.held_pa.iter().enumerate().filter(|(_, p)| **p > 0.0) {
            memory.pixels.push(index as u32);
            memory.pressure_pa.push(*pressure_pa);
        }
        memory
    }

    /// Starts the next frame from the memory of a contact of the same skin. False: the memory fits
    /// no skin, and the next frame starts from nothing.
    #[must_use]
    pub fn recall(&mut self, memory: &PixelMemory) -> bool {
        self.reset();
        let PixelMemory { vertices, forces_n, pixels, pressure_pa } = memory;
        let count = self.window.force_n[0].len();
        let fits = vertices.len() == forces_n.len()
            && pixels.len() == pressure_pa.len()
            && vertices.iter().all(|v| (*v as usize) < count)
            && pixels.iter().all(|i| (*i as usize) < self.held_pa.len())
            && forces_n.as_flattened().iter().chain(pressure_pa).all(|v| v.is_finite());
        if !fits {
            return false;
        }
        if vertices.is_empty() {
            return true;
        }
        self.shown = Shown::all();
        let without = self.turns.recall();
        self.window.force_n.iter_mut().for_each(|f| f.fill(0.0));
        for (vertex, forces) in vertices.iter().zip(forces_n) {
            for i in 0..3 {
                self.window.force_n[i][*vertex as usize] = forces[i];
                without[i][*vertex as usize] = forces[3 + i];
            }
        }
        for (index, p) in pixels.iter().zip(pressure_pa) {
            self.held_pa[*index as usize] = *p;
        }
        true
    }
}
