//! Contact on pixels: what vertices are too far apart to see.
//!
//! A finger's compliance at vertices is right over long distances and too coarse under an edge or
//! a dot. Nearby, skin is a stack of plane layers, whose compliance `K` is known for every
//! wave length. The displacement of a pixel is
//!
//! ```text
//! u(x) = S [u_v - K p_v] + K p
//! ```
//!
//! with the vertices' displacement `u_v` under their forces, the pressure `p_v` that is linear
//! between vertices, interpolation `S` of second degree, and the pressure `p` on pixels. So a vertex'
//! own dent makes way for the true one; what is far away cancels. In `u_v` the mesh's own dent, 2.3
//! times as deep as `K` says, is [replaced](own_dents) by the layers'.
//!
//! Pixels move along the skin's normal. Gaps are asked where pixels are displaced to and
//! measured along that normal, `d / (n . m)`: a pixel meets the side that is in its way, also where
//! another one is nearer to where it was at rest. `p >= 0`, `gap >= 0`, `p gap = 0` on
//! pixels; the vertices' forces are the pressure's sums over their hats, and both go in turn until
//! forces settle. A map tells means over pixels of pressure that is a cubic between those that are
//! [solved for](PixelSpacing), so that a pixel which the contact's edge crosses has its part:
//! point values are 15 % off where means are 9 (median over training presses, FE on graded
//! meshes). Pixels at the skin's edge hold the pressure that vertices find by themselves: contact
//! goes on beyond the map, where no pixel could carry it. In the three rows of triangles beside them
//! pixels leave a gap for what their pressure has beside the vertices', less and less inward.

mod convolution;

mod memory;
mod nearby;
mod own_dents;
mod skin;
mod smooth;
mod spacing;
mod turns;
mod window;

use crate::answer::{Contact, Effort, Person};
use crate::bounded::BoundedSolver;
use crate::error::ContactError;
use crate::force_target::{NetForce, Search};
use crate::model::ContactModel;
use crate::objects::{Object, View};
use crate::second_order::Amplitudes;
use crate::solver::Solver;
use convolution::Convolution;
use nearby::Nearby;
use papilla_atlas::MAP_LEN;
use std::sync::Arc;
use turns::Turns;
use window::Window;

pub use memory::PixelMemory;
pub use skin::PixelSkin;
pub use spacing::PixelSpacing;

/// Change of the vertices' displacement that ends what they find by themselves, reference mm: pixels
/// only go on by its change from frame to frame.
const AT_VERTICES_MM: f32 = 5e-4;
/// Rounds of vertices and pixels at most.
const ROUNDS_MAX: usize = 12;
/// Change of the vertices' forces, of their sum, that ends them.
const SETTLED: f32 = 0.01;
/// The same, above which an answer is not settled.
const UNSETTLED: f32 = 0.03;
/// Change of the forces without pixels, of their sum, up to which the last frame is a start.
const JUMP: f32 = 0.5;
/// Violation of a complementarity condition that is accepted, reference mm.
const VIOLATION_MM: f32 = 1e-4;
/// Most products with the compliance in a round.
const PRODUCTS_MAX: u32 = 80;
const PA_PER_MPA: f32 = 1e6;
/// Pixels settle to a hundredth of the force: [`SETTLED`].
const PIXELS: Search = Search { tolerance: 0.01, tries_max: 12 };

/// Pressure of a person for 1 MPa on the reference finger, Pa.
fn unit_pa(person: Person) -> f32 {
    PA_PER_MPA * person.stiffness as f32
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
    /// By pixel of the window: gap, mm, and pressure, MPa.
    rest: Vec<f32>,
    pressure: Vec<f32>,
    /// By pixel: pressure that vertices find by themselves, MPa.
    of_vertices: Vec<f32>,
    /// By pixel of the map: what pixels hold, and its means over pixels, Pa.
    held_pa: Vec<f32>,
    map_pa: Vec<f32>,
    peak_pa: f32,
}

impl Solver {
    /// Finds what presses on the finger, first at vertices, then on pixels; pressure at vertices is
    /// the pixels' mean under their hats, the local stiffness the vertices' own. Gaps at vertices say
    /// nothing of what lies between them, so it is objects that are needed.
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
            require_slippery(view)?;
            solver.frame_until(AT_VERTICES_MM, view, out)?;
            pixels.refine(solver, view, out)
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
            require_slippery(view)?;
            if solver.reached.is_none() {
                // Vertices may see nothing of what pixels do; then the way begins where objects are.
                let _ = solver.travel_until(view, net, Search::AT_VERTICES, out, Self::frame);
            }
            solver.travel_until(view, net, PIXELS, out, |solver, view, out| {
                solver.frame_until(AT_VERTICES_MM, view, out)?;
                pixels.refine(solver, view, out)
            })
        })
    }
}

/// Refuses friction.
fn require_slippery(view: View<'_>) -> Result<(), ContactError> {
    if view.is_rough() {
        return Err(ContactError::Friction("pixels know no shear: solve at vertices"));
    }
    Ok(())
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
            rest: vec![0.0; pixels],
            of_vertices: vec![0.0; pixels],
            pressure: vec![0.0; pixels],
            held_pa: vec![0.0; MAP_LEN],
            map_pa: vec![0.0; MAP_LEN],
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

    /// Forgets the last frame.
    pub fn reset(&mut self) {
        self.held_pa.fill(0.0);
        self.map_pa.fill(0.0);
        self.peak_pa = 0.0;
        self.turns.forget();
    }

    fn refine(
        &mut self,
        solver: &Solver,
        view: View<'_>,
        out: &mut Contact,
    ) -> Result<(), ContactError> {
        let Self { skin, window, pressure, map_pa, held_pa, turns, .. } = self;
        let (model, person) = (&*solver.model, solver.person());
        if !window.open(skin, model, solver.near(), view, &mut out.effort) {
            self.reset();
            return Ok(());
        }
        let unit_pa = unit_pa(person);
        solver.forces(turns.without_pixels());
        let is_alone = turns.found_without_pixels().iter().flatten().all(|force| *force == 0.0);
        if is_alone && !window.is_inside_at_rest(skin, view, &mut out.effort) {
            // Skin is dented by the last frame alone.
            self.reset();
            return Ok(());
        }
        let warm = turns.begin(&mut window.force_n);
        if warm {
            for (p, entry) in pressure.iter_mut().zip(&window.entries) {
                *p = held_pa[skin.raster.indices()[*entry as usize] as usize] / unit_pa;
            }
        }
        held_pa.fill(0.0);
        map_pa.fill(0.0);
        let mut change = self.rounds(solver, view, warm, &mut out.effort);
        if change.is_none() {
            // What runs away starts once more, from what vertices find.
            self.turns.forget();
            self.turns.begin(&mut self.window.force_n);
            change = self.rounds(solver, view, false, &mut out.effort);
        }
        let Some(change) = change else {
            self.reset();
            return Err(ContactError::Diverged);
        };
        // Pixels go by vertices' answer no further than a start.
        out.quality.settled = change <= UNSETTLED;
        if !out.quality.settled {
            self.stand_in();
            // From what came close the next frame goes on.
            if change > JUMP {
                self.turns.forget();
            }
        }
        self.answer(model, person, out);
        Ok(())
    }

    /// Rounds until forces settle; their last change over their sum, none if they run away.
    fn rounds(
        &mut self,
        solver: &Solver,
        view: View<'_>,
        warm: bool,
        effort: &mut Effort,
    ) -> Option<f32> {
        let mut change = f32::INFINITY;
        for round in 0..ROUNDS_MAX {
            let start = (round == 0).then_some(warm);
            change = self.round(solver, view, start, effort).ok().filter(|c| c.is_finite())?;
            if change <= SETTLED {
                break;
            }
        }
        Some(change)
    }

    /// What vertices found stands where their forces push skin out of reach in every round.
    fn stand_in(&mut self) {
        let Self { skin, window, pressure, turns, .. } = self;
        let n = window.len();
        if pressure[..n].iter().all(|p| *p == 0.0) {
            window.press_hats(skin, turns.found_without_pixels(), &mut pressure[..n]);
        }
    }

    /// The pressure of free pixels that the first round starts from: the last frame's, pressed on as vertices press
    /// on by themselves, or theirs.
    fn start(&mut self, warm: bool) {
        let Self { skin, window, turns, rest: last, pressure, of_vertices, .. } = self;
        let m = window.free();
        if !warm {
            pressure[..m].copy_from_slice(&of_vertices[..m]);
            return;
        }
        window.press_hats(skin, turns.last(), last);
        for (i, p) in pressure[..m].iter_mut().enumerate().filter(|(_, p)| **p > 0.0) {
            *p = (*p + of_vertices[i] - last[i]).max(0.0);
        }
    }

    /// Vertices, then pixels; returns the change of the vertices' forces over their sum. The first
    /// round starts from the last frame's pressure if `start` says so, else from the vertices'.
    fn round(
        &mut self,
        solver: &Solver,
        view: View<'_>,
        start: Option<bool>,
        effort: &mut Effort,
    ) -> Result<f32, ContactError> {
        let model = &solver.model;
        let Self { skin, window, amplitudes, turns, pressure, of_vertices, .. } = self;
        window.displace(skin, model, amplitudes.as_mut().filter(|_| solver.has_second_order()));
        window.place(skin, model);
        window.measure_hats(skin, model);
        let (n, m) = (window.len(), window.free());
        // The vertices' force is held: their pressure on skin that grows would grow without end.
        window.press_hats(skin, turns.found_without_pixels(), of_vertices);
        pressure[m..n].copy_from_slice(&of_vertices[m..n]);
        if let Some(warm) = start {
            self.start(warm);
            let Self { skin, window, convolution, pressure, .. } = self;
            let pitch_mm = window.pitch_mm(pressure);
            convolution.open(window.size(), window.rows(), pitch_mm, &skin.surface);
            window.number_cells(skin, [convolution.rows(), convolution.columns()]);
        }
        let Self { skin, window, convolution, bounded, turns, .. } = self;
        let Self { rest, pressure, of_vertices, .. } = self;
        let size = [convolution.rows(), convolution.columns()];
        window.press_forces(skin, rest);
        let grid = convolution.press(&window.cells, &rest[..n]);
        window.own_dents(skin, grid, size);
        let grid = convolution.press_rows(&window.cells, &pressure[..n]);
        window.measure(skin, view, solver.person(), grid, effort)?;
        let gradient = &mut rest[..m];
        window.gradient([&pressure[..m], &of_vertices[..m]], gradient);
        let [give, ease] = [&window.give[..m], &window.ease[..m]];
        let most = |values: &[f32]| values.iter().copied().fold(0.0, f32::max);
        let norm = skin.surface.largest() as f32 + most(give) + most(ease);
        let (cells, beside) = (&window.cells[..m], &window.beside[..m]);
        let bends = convolution.bends();
        let nearby = Nearby { convolution, cells, give, ease, norm, beside, bends };
        let p = &mut pressure[..m];
        effort.products +=
            bounded.improve(nearby, gradient, p, VIOLATION_MM, PRODUCTS_MAX).products;
        effort.iterations += 1;
        window.sum_forces(skin, &pressure[..n], turns.found());
        Ok(turns.take(&mut window.force_n))
    }

    fn answer(&mut self, model: &ContactModel, person: Person, out: &mut Contact) {
        let Self { window, pressure, held_pa, map_pa, peak_pa, skin, .. } = self;
        *peak_pa = 0.0;
        let unit_pa = unit_pa(person);
        let Contact { quality, effort, stiffness_n_per_mm, .. } = *out;
        out.clear();
        (out.quality, out.effort, out.stiffness_n_per_mm) = (quality, effort, stiffness_n_per_mm);
        let mut size_n = 0.0;
        for (i, p) in pressure[..window.len()].iter().enumerate() {
            if !(*p > 0.0) {
                continue;
            }
            let size = f64::from(p * window.area_mm2[i]);
            let force = window.normal[i].map(|n| f64::from(n) * size);
            out.add(window.at_mm[i].map(f64::from), force, size, f64::from(window.area_mm2[i]));
            size_n += size;
            out.penetration_mm = out.penetration_mm.max(f64::from(p * window.give[i]));
            let index = skin.raster.indices()[window.entries[i] as usize];
            held_pa[index as usize] = p * unit_pa;
            window.spread(skin, index as usize, p * unit_pa, map_pa);
        }
        // Beside steep edges a cubic falls below zero.
        map_pa.iter_mut().for_each(|p| *p = p.max(0.0));
        *peak_pa = map_pa.iter().copied().fold(0.0, f32::max);
        for vertex in 0..model.vertices() {
            let p = window.vertex_pressure(vertex);
            if p > 0.0 {
                out.press(vertex as u32, p * unit_pa);
            }
        }
        out.finish(person, size_n);
    }
}
