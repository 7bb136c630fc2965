//! How far what presses moves the skin: all of it, not only what lies near the contact.

use crate::answer::Contact;
use crate::kernels::{DisplaceTiles, Vectors, run};
use crate::model::ContactModel;
use crate::pixels::PixelContact;
use crate::second_order::Amplitudes;
use crate::solver::Solver;
use std::sync::Arc;

/// Displacement of a finger's whole skin. All memory is taken at construction.
#[derive(Debug)]
pub struct Displacement {
    model: Arc<ContactModel>,
    amplitudes: Option<Amplitudes>,
    /// By vertex, N.
    force_n: [Vec<f32>; 3],
    /// Vertices under force, and their forces one after the other.
    pushed: Vec<u32>,
    packed: [Vec<f32>; 3],
    /// Tiles of the compliance: those under force, and all.
    pushing: Vec<u32>,
    tiles: Vec<u32>,
    tile_force: Vec<Vectors>,
    tile_moved: Vec<Vectors>,
    /// By vertex, mm: of first order, and in all.
    vertices: Vec<u32>,
    linear: [Vec<f32>; 3],
    moved: [Vec<f32>; 3],
}

impl Displacement {
    /// Of the skin that `solver` presses on.
    #[must_use]
    pub fn new(solver: &Solver) -> Self {
        let model = Arc::clone(&solver.model);
        let (v, tiles) = (model.vertices(), model.compliance.side());
        let zeros = || std::array::from_fn(|_| vec![0.0; v]);
        let second_order = model.second_order.as_ref().filter(|_| solver.has_second_order());
        Self {
            amplitudes: second_order.map(|s| s.amplitudes()),
            force_n: zeros(),
            pushed: Vec::with_capacity(v),
            packed: zeros(),
            pushing: Vec::with_capacity(tiles),
            tiles: (0..tiles as u32).collect(),
            tile_force: vec![Vectors::default(); tiles],
            tile_moved: vec![Vectors::default(); tiles],
            vertices: (0..v as u32).collect(),
            linear: zeros(),
            moved: zeros(),
            model,
        }
    }

    /// Fills in how far each vertex has moved in the last frame of `solver`, whose answer is `out`,
    /// mm of this person, in the finger's frame. Vertices near `pixels` move as those found.
    pub fn fill(
        &mut self,
        solver: &Solver,
        pixels: Option<&PixelContact>,
        out: &Contact,
        moved_mm: &mut [[f32; 3]],
    ) {
        if out.touched().is_empty() {
            moved_mm.fill([0.0; 3]);
            return;
        }
        match pixels {
            Some(pixels) => pixels.forces(&mut self.force_n),
            None => solver.forces(&mut self.force_n),
        }
        self.spread();
        let Self { model, amplitudes, pushed, packed, linear, moved, vertices, .. } = self;
        if let (Some(a), Some(s)) = (amplitudes, &model.second_order) {
            let m = pushed.len();
            s.evaluate(pushed, packed.each_ref().map(|f| &f[..m]), a);
            s.displace(a, vertices, linear, moved);
        } else {
            for (moved, linear) in moved.iter_mut().zip(&*linear) {
                moved.copy_from_slice(linear);
            }
        }
        if let Some(pixels) = pixels {
            pixels.moved_near(model, moved);
        }
        // What is held where it came in presses with a part of its force.
        let strength = solver.strength().map_or(1.0, |(strength, _)| strength as f32);
        let length = strength * solver.person().width as f32;
        for (vertex, moved_mm) in moved_mm.iter_mut().enumerate() {
            *moved_mm = [0, 1, 2].map(|i| length * moved[i][vertex]);
        }
    }

    /// The first order: compliance times forces.
    fn spread(&mut self) {
        let Self { model, force_n, pushed, packed, pushing, tile_force, .. } = self;
        pushed.clear();
        pushing.clear();
        tile_force.fill(Vectors::default());
        for vertex in 0..model.vertices() {
            let force = [0, 1, 2].map(|i| force_n[i][vertex]);
            if force.iter().all(|f| *f == 0.0) {
                continue;
            }
            let [tile, place] = model.compliance.place(vertex);
            for i in 0..3 {
                packed[i][pushed.len()] = force[i];
                tile_force[tile][i][place] = force[i];
            }
            pushed.push(vertex as u32);
            if !pushing.contains(&(tile as u32)) {
                pushing.push(tile as u32);
            }
        }
        run(DisplaceTiles {
            compliance: &model.compliance,
            pushing,
            force: tile_force,
            moving: &self.tiles,
            moved: &mut self.tile_moved,
        });
        for vertex in 0..self.model.vertices() {
            let [tile, place] = self.model.compliance.place(vertex);
            for (linear, moved) in self.linear.iter_mut().zip(&self.tile_moved[tile]) {
                linear[vertex] = moved[place];
            }
        }
    }
}
