//! A frame on pixels: vertices and pixels are solved in turn, in rounds.

use super::nearby::Nearby;
use super::{JUMP, PixelContact, unit_pa};
use crate::answer::{Contact, Effort};
use crate::error::ContactError;
use crate::objects::View;
use crate::solver::Solver;

/// Rounds of vertices and pixels at most.
const ROUNDS_MAX: usize = 24;
/// Change of the vertices' forces, of their sum, that ends them.
const SETTLED: f32 = 0.01;
/// The same, above which an answer is not settled.
const UNSETTLED: f32 = 0.03;
/// Careful rounds at most after these, and their work that ends them, in units.
const CAREFUL_MAX: usize = 60;
const CAREFUL_WORK: u64 = 400_000_000;
/// Violation of a complementarity condition that is accepted, reference mm.
const VIOLATION_MM: f32 = 1e-4;
/// Most products with the compliance in a round.
const PRODUCTS_MAX: u32 = 80;
/// The same, when the frame's budget is used.
const PRODUCTS_MIN: u32 = 10;
/// Units of work that a pixel takes with each product.
const SOLVE: u64 = 16;

impl PixelContact {
    pub(super) fn refine(
        &mut self,
        solver: &Solver,
        view: View<'_>,
        out: &mut Contact,
    ) -> Result<(), ContactError> {
        let Self { skin, window, pressure, held_pa, turns, rubbing, .. } = self;
        let (model, person) = (&*solver.model, solver.person());
        if !window.open(skin, model, solver.near(), view, &mut out.effort) {
            // No pixel shows what vertices found, if they did.
            out.quality.settled &= out.touched().is_empty();
            self.reset();
            return Ok(());
        }
        let unit_pa = unit_pa(person);
        solver.normal_forces(turns.without_pixels());
        rubbing.begin(solver, &mut window.shear_n);
        let is_alone = turns.found_without_pixels().iter().flatten().all(|force| *force == 0.0);
        if is_alone && !window.is_inside_at_rest(skin, view, &mut out.effort) {
            // Skin is dented by the last frame alone.
            self.reset();
            return Ok(());
        }
        let warm = turns.begin(&window.ids, &mut window.force_n);
        if warm {
            for (p, entry) in pressure.iter_mut().zip(&window.entries) {
                *p = held_pa[skin.raster.indices()[*entry as usize] as usize] / unit_pa;
            }
        }
        self.clear_map();
        let mut change = self.rounds(solver, view, warm, &mut out.effort);
        if change.is_none() {
            // What runs away starts once more, from what vertices find.
            self.turns.forget();
            self.turns.begin(&self.window.ids, &mut self.window.force_n);
            change = self.rounds(solver, view, false, &mut out.effort);
        }
        let Some(change) = change else {
            self.reset();
            return Err(ContactError::Diverged);
        };
        // Pixels go by vertices' answer no further than a start.
        out.quality.settled =
            change <= UNSETTLED && !view.is_spent(&out.effort) && solver.is_slip_settled();
        if change > UNSETTLED {
            self.stand_in();
            // From what came close the next frame goes on.
            if change > JUMP {
                self.turns.forget();
            }
        }
        self.answer(solver, out);
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
            self.round(solver, view, start, effort).ok()?;
            change = Some(self.turns.take(&mut self.window.force_n)).filter(|c| c.is_finite())?;
            if change <= SETTLED || view.is_spent(effort) {
                return Some(change);
            }
        }
        if change <= UNSETTLED { Some(change) } else { self.careful_rounds(solver, view, effort) }
    }

    /// Rounds that go on from the best of them.
    fn careful_rounds(
        &mut self,
        solver: &Solver,
        view: View<'_>,
        effort: &mut Effort,
    ) -> Option<f32> {
        let m = self.window.free();
        let (mut change, began) = (f32::INFINITY, effort.work);
        self.careful.begin(&self.pressure[..m]);
        for round in 0..CAREFUL_MAX {
            if round > 0 {
                let Self { careful, turns, window, pressure, .. } = self;
                careful.go_on(turns.active(), &mut window.force_n, &mut pressure[..m]);
            }
            self.round(solver, view, None, effort).ok()?;
            let Self { careful, turns, window, pressure, .. } = self;
            let forces = [&window.force_n, turns.answered()];
            change = careful.note(turns.active(), forces, &pressure[..m]);
            if !(change > UNSETTLED) || view.is_spent(effort) || effort.work - began > CAREFUL_WORK
            {
                break;
            }
        }
        Some(change).filter(|change| change.is_finite())
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

    /// Vertices, then pixels, and the sums of their pressure. The first round starts from the last
    /// frame's pressure if `start` says so, else from the vertices'.
    fn round(
        &mut self,
        solver: &Solver,
        view: View<'_>,
        start: Option<bool>,
        effort: &mut Effort,
    ) -> Result<(), ContactError> {
        let model = &solver.model;
        let Self { skin, window, amplitudes, turns, pressure, of_vertices, .. } = self;
        window.displace(skin, model, amplitudes.as_mut().filter(|_| solver.has_second_order()));
        effort.work += window.work(model, solver.has_second_order());
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
            effort.work += window.opening_work() + convolution.table_work();
        }
        let Self { skin, window, convolution, bounded, turns, .. } = self;
        let Self { rest, pressure, of_vertices, .. } = self;
        let size = [convolution.rows(), convolution.columns()];
        window.press_forces(skin, rest);
        let grid = convolution.press(window.cells(n), &rest[..n]);
        window.own_dents(skin, grid, size);
        let grid = convolution.press_rows(window.cells(n), &pressure[..n]);
        window.measure(skin, view, solver.person(), grid, effort)?;
        if view.is_spent(effort) {
            // Not all gaps are known: the last round's pressure stands, or the vertices'.
            if start.is_some() {
                pressure[..n].copy_from_slice(&of_vertices[..n]);
            }
            self.end_round(effort);
            return Ok(());
        }
        window.turn_to_skin(&pressure[..n]);
        let gradient = &mut rest[..m];
        window.gradient([&pressure[..m], &of_vertices[..m]], gradient);
        let [give, ease] = [&window.give[..m], &window.ease[..m]];
        let most = |values: &[f32]| values.iter().copied().fold(0.0, f32::max);
        let norm = skin.surface.largest() as f32 + most(give) + most(ease);
        let cells = window.cells(m);
        let beside = &window.beside[..m];
        let bends = convolution.bends();
        let unit = convolution.work() + SOLVE * m as u64;
        let is_warm = turns.starts_warm();
        let nearby = Nearby { convolution, cells, give, ease, norm, beside, bends, is_warm };
        let p = &mut pressure[..m];
        let most = view.most(PRODUCTS_MAX, unit, effort).max(PRODUCTS_MIN);
        let products = bounded.improve(nearby, gradient, p, VIOLATION_MM, most).products;
        effort.products += products;
        effort.work += (2 + u64::from(products)) * unit;
        self.end_round(effort);
        Ok(())
    }

    /// Sums what pixels press with under the vertices' hats.
    fn end_round(&mut self, effort: &mut Effort) {
        let Self { skin, window, pressure, turns, rubbing, .. } = self;
        let pressure = &pressure[..window.len()];
        effort.iterations += 1;
        window.sum_forces(skin, pressure, turns.found());
        rubbing.sum_forces(skin, window, pressure);
    }
}
