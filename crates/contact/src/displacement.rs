//! How far the whole skin moves under the forces of a contact, also far from it.

use crate::answer::Contact;
use crate::model::ContactModel;
use crate::pixels::PixelContact;
use crate::push::Push;
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
    push: Push,
    /// All tiles of the compliance.
    tiles: Vec<u32>,
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
        let v = model.vertices();
        let zeros = || std::array::from_fn(|_| vec![0.0; v]);
        let second_order = model.second_order.as_ref().filter(|_| solver.has_second_order());
        Self {
            amplitudes: second_order.map(|s| s.amplitudes()),
            force_n: zeros(),
            push: Push::new(&model),
            tiles: (0..model.compliance.side() as u32).collect(),
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
        // Where no pixel was near, vertices answered.
        let pixels = pixels.filter(|pixels| pixels.peak_pa() > 0.0);
        match pixels {
            Some(pixels) => pixels.forces(&mut self.force_n),
            None => solver.forces(&mut self.force_n),
        }
        let Self { model, amplitudes, force_n, push, tiles, vertices, linear, moved } = self;
        push.take(model, |vertex| [0, 1, 2].map(|i| force_n[i][vertex]));
        push.displace(model, [tiles, vertices], linear);
        push.add_second_order(model, amplitudes.as_mut(), vertices, linear, moved);
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
}
