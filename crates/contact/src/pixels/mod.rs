//! Contact on pixels, for details that lie between the vertices.
//!
//! The compliance of a finger at its vertices is right over long distances, but too coarse under an
//! edge or a dot. Over short distances the skin is taken as a stack of plane layers, whose
//! compliance `K` is known for every wave length. The displacement of a pixel is
//!
//! ```text
//! u(x) = S [u_v - K p_v] + K p
//! ```
//!
//! Here `u_v` is the displacement of the vertices under their forces, `p_v` the pressure of these
//! forces, linear between vertices, `S` an interpolation of second degree, and `p` the pressure on
//! pixels. So the dent that a vertex makes is replaced by the true one, and what is far away
//! cancels. Before that, the dent of the mesh in `u_v`, 2.3 times as deep as `K` says, is
//! [replaced](own_dents) by that of the layers.
//!
//! Pixels move along the normal `n` of the skin. The gap of a displaced pixel is measured along
//! that normal: `d / (n . m)`, with the distance `d` and the normal `m` of the object. So a pixel
//! meets the side that is in its way, even if another side is nearer. To an object a pixel is a
//! *bead*: a ball with a radius of half the distance of pixels that touches the skin from within.
//! So an edge is at least as round as a bead. On pixels `p >= 0`, `gap >= 0` and `p gap = 0`. The
//! forces of the vertices are sums of the pressure over their hat functions. Vertices and pixels
//! are solved in turn until the forces settle.
//!
//! A map holds means over pixels of a pressure that is a cubic between the pixels that are [solved
//! for](PixelSpacing). So a pixel that the edge of the contact crosses shows only its part of the
//! pressure. Values at points would be 15 % off, means are 9 % off (median over training states,
//! against FE on graded meshes).
//!
//! Where the map ends at the base plane of the finger, the skin goes on behind it [as in a
//! mirror](mirror). At the other edges of the map, contact goes on where there are no pixels.
//! Pixels there hold the pressure of the vertices. In the three rows of triangles beside them,
//! pixels leave a gap for the difference between their own pressure and that of the vertices, less
//! and less towards the inside.

mod careful;
mod change;
mod convolution;
mod memory;
mod mirror;
mod nearby;
mod own_dents;
mod rounds;
mod rubbing;
mod shown;
mod skin;
mod smooth;
mod spacing;
mod turns;
mod window;

use crate::answer::{Aside, Contact, Effort, Person};
use crate::bounded::BoundedSolver;
use crate::error::ContactError;
use crate::force_target::{NetForce, Search};
use crate::model::ContactModel;
use crate::object::Object;
use crate::objects::View;
use crate::second_order::Amplitudes;
use crate::solver::{Solver, Until};
use careful::Careful;
use convolution::Convolution;
use papilla_atlas::MAP_LEN;
use papilla_atlas::PA_PER_MPA;
use rubbing::Rubbing;
use shown::Shown;
use std::sync::Arc;
use turns::Turns;
use window::Window;

pub use memory::PixelMemory;
pub use skin::PixelSkin;
pub use spacing::PixelSpacing;

/// Change of the vertices' displacement that ends what they find by themselves, reference mm: pixels
/// only go on by its change from frame to frame.
const AT_VERTICES_MM: f32 = 5e-4;
/// Change of the forces without pixels, of their sum, up to which the last frame is a start.
const JUMP: f32 = 0.5;
/// Pixels settle to a hundredth of the force: [`rounds`].
const PIXELS: Search = Search { tolerance: 0.01, tries_max: 12 };

/// Pressure of a person for 1 MPa on the reference finger, Pa.
fn unit_pa(person: Person) -> f32 {
    PA_PER_MPA as f32 * person.stiffness as f32
}

/// Contact on the pixels of one finger. All memory is taken at construction.
#[derive(Debug)]
pub struct PixelContact {
    skin: Arc<PixelSkin>,
    window: Window,
    bounded: BoundedSolver,
    convolution: Convolution,
    amplitudes: Option<Amplitudes>,
    turns: Turns,
    careful: Careful,
    rubbing: Rubbing,
    /// By pixel of the window: gap, mm, and pressure, MPa.
    rest: Vec<f32>,
    pressure: Vec<f32>,
    /// By pixel: pressure that vertices find by themselves, MPa.
    of_vertices: Vec<f32>,
    /// By pixel of the map: what pixels hold, and its means over pixels, Pa.
    held_pa: Vec<f32>,
    map_pa: Vec<f32>,
    /// Where on the map they may be other than zero.
    shown: Shown,
    peak_pa: f32,
}

impl Solver {
    /// Finds what presses on the finger, first at vertices, then on pixels; pressure and traction at vertices
    /// are the pixels' means under their hats, the local stiffness the vertices' own. Where skin
    /// sticks and where it slips is found at vertices. Gaps at vertices say nothing of what lies between
    /// them, so it is objects that are needed.
    ///
    /// # Errors
    /// As [`Self::solve`].
    pub fn solve_on_pixels(
        &mut self,
        objects: &[Object],
        pixels: &mut PixelContact,
        out: &mut Contact,
    ) -> Result<(), ContactError> {
        self.within(objects.into(), 0.0, |solver, view| {
            (solver.sides.toward, solver.sides.fine) = (None, true);
            solver.frame_until(Until::within(AT_VERTICES_MM), view, out)?;
            pixels.refine(solver, solver.held(view), out)?;
            // Under a single pixel without neighbours there is no area.
            let is_met = pixels.peak_pa > 0.0 && !out.touched().is_empty();
            solver.end_frame(view, is_met, out);
            Ok(())
        })
    }

    /// As [`Self::solve_for_force`], on pixels: vertices find the travel, pixels correct it.
    ///
    /// # Errors
    /// As [`Self::solve_for_force`].
    pub fn solve_for_force_on_pixels(
        &mut self,
        objects: &[Object],
        net: NetForce,
        pixels: &mut PixelContact,
        out: &mut Contact,
    ) -> Result<f64, ContactError> {
        net.validate()?;
        self.within(objects.into(), 0.0, |solver, view| {
            (solver.sides.toward, solver.sides.fine) = (Some(net.direction), true);
            let mut effort = Effort::default();
            if solver.reached.is_none() {
                // Vertices may see nothing of what pixels do; then the way begins where objects are.
                let (how, taken) = (Search::AT_VERTICES, (&mut effort, &mut *out));
                let _ = solver.travel_until(view, net, how, taken, Self::frame);
                // Its work counts, and no more.
                effort = Effort { work: effort.work, ..Effort::default() };
            }
            let taken = (&mut effort, &mut *out);
            let travel = solver.travel_until(view, net, PIXELS, taken, |solver, view, out| {
                solver.frame_until(Until::within(AT_VERTICES_MM), view, out)?;
                pixels.refine(solver, solver.held(view), out)
            })?;
            let shift_mm = net.direction.map(|d| d * travel / view.length);
            solver.tell_missed(View { shift_mm, ..view }, true, out);
            solver.follow_slip(view);
            Ok(travel)
        })
    }
}

impl PixelContact {
    /// A finger that nothing touches.
    #[must_use]
    pub fn new(skin: Arc<PixelSkin>, model: &ContactModel, spacing: PixelSpacing) -> Self {
        let pixels = skin.raster.pixel_count();
        Self {
            window: Window::new(&skin, model, spacing),
            bounded: BoundedSolver::new(pixels),
            convolution: Convolution::new(Arc::clone(&skin.plans)),
            amplitudes: model.second_order.as_ref().map(|s| s.amplitudes()),
            turns: Turns::new(model.vertices()),
            careful: Careful::new(model.vertices(), pixels),
            rubbing: Rubbing::new(model.vertices()),
            rest: vec![0.0; pixels],
            of_vertices: vec![0.0; pixels],
            pressure: vec![0.0; pixels],
            held_pa: vec![0.0; MAP_LEN],
            map_pa: vec![0.0; MAP_LEN],
            shown: Shown::default(),
            peak_pa: 0.0,
            skin,
        }
    }

    /// Pressure of the last frame, Pa; 224 x 224, row by row.
    #[must_use]
    pub fn map_pa(&self) -> &[f32] {
        &self.map_pa
    }

    /// Greatest pressure of the last frame, Pa.
    #[must_use]
    pub fn peak_pa(&self) -> f32 {
        self.peak_pa
    }

    /// Forces on the skin's vertices after the last frame, N: what pixels hold, summed under hats.
    pub(crate) fn forces(&self, force_n: &mut [Vec<f32>; 3]) {
        let answered = self.turns.answered().iter().zip(&self.window.shear_n);
        for (force, (normal, along)) in force_n.iter_mut().zip(answered) {
            let sums = normal.iter().zip(along).map(|(normal, along)| normal + along);
            force.iter_mut().zip(sums).for_each(|(force, sum)| *force = sum);
        }
    }

    /// Fills in how far the vertices near the last frame's pixels have moved, reference mm.
    pub(crate) fn moved_near(&self, model: &ContactModel, moved: &mut [Vec<f32>; 3]) {
        self.window.moved_near(&self.skin, model, moved);
    }

    /// Forgets the last frame.
    pub fn reset(&mut self) {
        self.clear_map();
        self.peak_pa = 0.0;
        self.turns.forget();
    }

    /// Nothing is held.
    fn clear_map(&mut self) {
        let range = self.shown.range();
        self.held_pa[range.clone()].fill(0.0);
        self.map_pa[range].fill(0.0);
        self.shown = Shown::default();
    }

    /// Sums what pixels hold; `strength` multiplies it, and has a slope.
    fn answer(&mut self, solver: &Solver, out: &mut Contact) {
        let (model, person) = (&solver.model, solver.person());
        let strength = solver.strength();
        let Self { window, pressure, held_pa, map_pa, shown, peak_pa, skin, rubbing, .. } = self;
        *peak_pa = 0.0;
        let unit_pa = unit_pa(person);
        let Contact { quality, effort, stiffness_n_per_mm, .. } = *out;
        out.clear();
        (out.quality, out.effort, out.stiffness_n_per_mm) = (quality, effort, stiffness_n_per_mm);
        let (mut size_n, mut aside) = (0.0, Aside::default());
        for (i, p) in pressure[..window.len()].iter().enumerate() {
            if !(*p > 0.0) {
                continue;
            }
            let size = f64::from(p * window.area_mm2[i]);
            let mut push = window.normal[i];
            let entry = window.entries[i] as usize;
            let vertex = skin.raster.pixels()[entry].vertices[0] as usize;
            aside.add(push.map(|n| f64::from(n) * size), model.normals[vertex]);
            if rubbing.is_rough() {
                let along = rubbing.ratio(skin, window, i);
                push.iter_mut().zip(along).for_each(|(push, along)| *push += along);
            }
            let force = push.map(|n| f64::from(n) * size);
            out.add(window.at_mm[i].map(f64::from), force, size, f64::from(window.area_mm2[i]));
            size_n += size;
            out.penetration_mm = out.penetration_mm.max(f64::from(p * window.give[i]));
            let index = skin.raster.indices()[entry];
            held_pa[index as usize] = p * unit_pa;
            window.spread(skin, i, p * unit_pa, map_pa);
            shown.take(index as usize);
        }
        shown.widen(window.reach());
        let strength_pa = strength.map_or(1.0, |(strength, _)| strength as f32);
        for p in &mut map_pa[shown.range()] {
            // Beside steep edges a cubic falls below zero.
            *p = p.max(0.0) * strength_pa;
            *peak_pa = peak_pa.max(*p);
        }
        for vertex in 0..model.vertices() {
            let p = window.vertex_pressure(vertex);
            if p > 0.0 {
                out.press(vertex as u32, p * unit_pa);
                if let Some(shear_pa) = out.shear_pa.get_mut(vertex) {
                    *shear_pa = window.vertex_traction(vertex).map(|q| q * unit_pa);
                }
            }
        }
        aside.judge(&mut out.quality);
        out.finish(person, size_n);
        if let Some((strength, slope)) = strength {
            out.strengthen(strength, slope / person.width);
        }
    }
}
