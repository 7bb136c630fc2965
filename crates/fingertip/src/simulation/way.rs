//! A straight way from one stored depth to the next.

use super::body::SimulationError;
use super::guide::Guided;
use papilla_fem::solve::{Effort, Mark, Solver, StepReport};
use std::ops::Range;

/// How much more of the work may be missed before it is mended where the force has the course of
/// a guide: the coarse mesh errs most at first touch, and what it misses there does not grow.
const GUIDED: f64 = 2.0;

/// Farthest from one equilibrium to the next, mm. A longer step, deep in a finger, starts so far
/// from equilibrium that the tangent is indefinite on the way (a ring, .64 to 1.28 mm in one step:
/// no equilibrium in 8 minutes; in two, 33 iterations), and may end in a state of the same force in
/// which an element is crushed (a level plate, 1.9 to 3.8 mm in one step: J = .02 for .47).
const STEP_MAX_MM: f64 = 0.5;

/// The same beside a guide, which goes there by shorter steps. Farther from its last equilibrium a
/// body may find none (a bar of 6 mm, pitched by 38 degrees, from rest to 2.2 mm: 40 indefinite
/// tangents, 4 minutes, and no equilibrium; by way of 1.1 mm 71 s in all).
const GUIDED_STEP_MAX_MM: f64 = 1.1;

/// Equilibria between first touch and the first two stored depths, if these are not far.
const EXTRA_DEPTHS: [usize; 2] = [5, 1];

/// Least part of the guide's way that is tried at once where the whole leads to no equilibrium.
const GUIDED_PART_MIN: f64 = 0.25;

/// A straight way through depths, stored ones and those between them.
pub(super) struct Way<'a> {
    pub depths_mm: &'a [f64],
    pub refinement: u32,
    pub graded: bool,
    pub energy_vs_work_max: Option<f64>,
}

impl Way<'_> {
    /// Goes from the depth before to that of number `i`.
    fn to_state(&self, solver: &mut Solver<'_>, i: usize) -> Result<StepReport, SimulationError> {
        let depth_mm = self.depths_mm[i];
        let at = |source| SimulationError::at_depth(depth_mm, source);
        let mut effort = Effort::default();
        let mut known: Vec<_> = self.mark(solver).into_iter().collect();
        for between in path_mm(self.depths_mm, i, self.refinement, self.graded) {
            effort = effort.plus(&solver.advance_to(self.fraction(between)).map_err(at)?.effort);
            known.extend(self.mark(solver));
        }
        let mut report = solver.advance_to(self.fraction(depth_mm)).map_err(at)?;
        report.effort = report.effort.plus(&effort);
        self.mend(solver, known, 1.0, &mut report);
        Ok(report)
    }

    /// Sends the guide there; none is left where it finds no equilibrium.
    pub(super) fn lead<'a>(&self, mut guided: Guided<'a>, i: usize) -> Option<Guided<'a>> {
        match self.to_state(&mut guided.solver, i) {
            Ok(report) => {
                guided.arrive(report.effort);
                Some(guided)
            }
            Err(error) => {
                tracing::info!(%error, "the coarse mesh that leads the way is given up");
                None
            }
        }
    }

    /// Goes to the depth of number `i`, beside the guide if there is one, which is lost where it finds
    /// no equilibrium.
    pub(super) fn beside(
        &self,
        guided: &mut Option<Guided<'_>>,
        solver: &mut Solver<'_>,
        i: usize,
    ) -> Result<StepReport, SimulationError> {
        *guided = guided.take().and_then(|g| self.lead(g, i));
        match guided {
            Some(guided) => self.to_state_after(guided, solver, i),
            None => self.to_state(solver, i),
        }
    }

    /// As [`Self::to_state`], straight to a state that a guide is at, if it is beside the guide's;
    /// else by parts of the guide's way.
    fn to_state_after(
        &self,
        guided: &Guided<'_>,
        solver: &mut Solver<'_>,
        i: usize,
    ) -> Result<StepReport, SimulationError> {
        let to_mm = self.depths_mm[i];
        let from_mm = if i == 0 { 0.0 } else { self.depths_mm[i - 1] };
        let mut known: Vec<_> = self.mark(solver).into_iter().collect();
        let mut effort = guided.effort;
        let (mut gone, mut part) = (0.0, 1.0);
        let mut report = loop {
            let arrives = gone + part >= 1.0;
            // The guide's own depth to the last bit, by which its course is found.
            let depth_mm =
                if arrives { to_mm } else { from_mm + (gone + part) * (to_mm - from_mm) };
            match solver.advance_from(self.fraction(depth_mm), guided.guess(solver, part)) {
                Ok(mut report) if arrives => {
                    // Not if the body had equilibria where the guide had none.
                    solver.take_course(&guided.solver);
                    let times = if part < 1.0 { 1.0 } else { GUIDED };
                    self.mend(solver, known, times, &mut report);
                    break report;
                }
                Ok(report) => {
                    gone += part;
                    effort = effort.plus(&report.effort);
                    known.extend(self.mark(solver));
                }
                Err(spent) => {
                    part *= 0.5;
                    effort = effort.plus(&spent);
                    if part < GUIDED_PART_MIN {
                        break self.to_state(solver, i)?;
                    }
                }
            }
        };
        report.effort = report.effort.plus(&effort);
        report.guiding = guided.effort;
        Ok(report)
    }

    /// Load fraction at a depth.
    fn fraction(&self, depth_mm: f64) -> f64 {
        depth_mm / self.depths_mm.last().copied().unwrap_or(1.0)
    }

    /// Where the body is, to mend work by; `None` if work is not mended.
    fn mark(&self, solver: &Solver<'_>) -> Option<Mark> {
        self.energy_vs_work_max.map(|_| solver.mark())
    }

    fn mend(&self, solver: &mut Solver<'_>, known: Vec<Mark>, times: f64, report: &mut StepReport) {
        if let Some(limit) = self.energy_vs_work_max {
            report.mending = solver.mend_work(known, times * limit);
            report.effort = report.effort.plus(&report.mending);
        }
    }
}

/// Depths at which a body stops on its way, the stored ones among them.
pub(super) struct Stops {
    /// Rising, mm.
    pub depths_mm: Vec<f64>,
    /// Stops up to each stored depth, itself included.
    ends: Vec<usize>,
}

impl Stops {
    /// The stored depths alone, to which a body goes by itself.
    pub(super) fn stored(depths_mm: &[f64]) -> Self {
        Self { depths_mm: depths_mm.to_vec(), ends: (1..=depths_mm.len()).collect() }
    }

    /// Beside a guide: equal steps to each stored depth, none longer than [`GUIDED_STEP_MAX_MM`].
    pub(super) fn guided(depths_mm: &[f64]) -> Self {
        let mut stops = Self { depths_mm: Vec::new(), ends: Vec::new() };
        let mut from = 0.0;
        for &to in depths_mm {
            let steps = ((to - from) / GUIDED_STEP_MAX_MM - 1e-9).ceil().max(1.0) as u32;
            let between = (1..steps).map(|k| from + f64::from(k) / f64::from(steps) * (to - from));
            stops.depths_mm.extend(between.chain([to]));
            stops.ends.push(stops.depths_mm.len());
            from = to;
        }
        stops
    }

    /// Stops from one stored depth, exclusive, to another, inclusive; stored depths are counted
    /// from 1, and 0 is first touch.
    pub(super) fn between(&self, from: usize, to: usize) -> Range<usize> {
        let end = |stored: usize| stored.checked_sub(1).map_or(0, |i| self.ends[i]);
        end(from)..end(to)
    }
}

/// Depths between depth `i` and the one before it at which to find
/// equilibrium too, mm. Force turns fast after first touch, and with it the
/// work integral.
fn path_mm(depths_mm: &[f64], i: usize, refinement: u32, graded: bool) -> Vec<f64> {
    let to = depths_mm[i];
    let from = if i == 0 { 0.0 } else { depths_mm[i - 1] };
    let coarse: &[f64] = match i {
        0 if graded => &[0.0, 0.12, 0.35, 0.65, 1.0],
        0 => &[0.0, 0.1, 0.25, 0.5, 0.75, 1.0],
        1 if !graded => &[0.0, 0.5, 1.0],
        _ => &[0.0, 1.0],
    };
    let at = |part: f64| from + part * (to - from);
    let mut path = Vec::new();
    for pair in coarse.windows(2) {
        let steps = ((at(pair[1]) - at(pair[0])) / STEP_MAX_MM - 1e-9).ceil().max(1.0);
        let parts = steps as u32 * refinement;
        for k in 1..=parts {
            path.push(at(pair[0] + (pair[1] - pair[0]) * f64::from(k) / f64::from(parts)));
        }
    }
    path.pop();
    path
}

/// Equilibria on a straight way through stored depths; on a mesh with a guide fewer.
pub(crate) fn equilibria(depths_mm: &[f64], guided: bool) -> usize {
    let longest_mm = if guided { GUIDED_STEP_MAX_MM } else { STEP_MAX_MM };
    let mut from_mm = 0.0;
    let to_each = depths_mm.iter().enumerate().map(|(i, &to_mm)| {
        // As many as in any way to it, or more if it is far.
        let shallow = 1 + EXTRA_DEPTHS.get(i).copied().unwrap_or(0);
        let steps = ((to_mm - std::mem::replace(&mut from_mm, to_mm)) / longest_mm - 1e-9).ceil();
        // The first touch is one too.
        let all = path_mm(depths_mm, i, 1, false).len() + 1 + usize::from(i == 0);
        if guided { shallow.max(steps as usize) } else { all }
    });
    to_each.sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_that_is_far_is_foreseen_to_take_more() {
        let count = |depths: &[f64]| [false, true].map(|guided| equilibria(depths, guided));
        assert_eq!(count(&[0.4]), [6, 6]);
        assert_eq!(count(&[0.25, 0.5, 0.75, 1.0]), [10, 10]);
        assert_eq!(count(&[3.0]), [9, 6]);
        assert_eq!(count(&[12.0]), [26, 11]);
        // As the way is that is taken.
        let taken: usize = (0..2).map(|i| path_mm(&[2.0, 6.0], i, 1, false).len() + 1).sum();
        assert_eq!(count(&[2.0, 6.0])[0], taken + 1);
    }

    #[test]
    fn no_step_is_long_however_few_states_are_stored() {
        for graded in [false, true] {
            for depths_mm in [&[4.8][..], &[1.9, 3.8], &[0.2, 0.4, 0.6], &[0.75, 1.5]] {
                let mut at = 0.0;
                for i in 0..depths_mm.len() {
                    let path = path_mm(depths_mm, i, 1, graded);
                    for next in path.iter().chain([&depths_mm[i]]) {
                        assert!(at < *next && next - at <= 1.000_001 * STEP_MAX_MM, "{at} {next}");
                        at = *next;
                    }
                }
            }
        }
        let stops = Stops::guided(&[1.0, 2.0, 4.4, 5.5]);
        let steps = [0, 1, 2, 3].map(|i| stops.between(i, i + 1).len());
        assert_eq!((steps, stops.between(0, 4)), ([1, 1, 3, 1], 0..6));
        assert!(stops.depths_mm.windows(2).all(|w| w[0] < w[1] && w[1] - w[0] < 1.1 + 1e-9));
        assert!((stops.depths_mm[3] - 3.6).abs() < 1e-12, "{:?}", stops.depths_mm);
        assert_eq!(Stops::stored(&[1.0, 4.4]).between(1, 2), 1..2);
        // A short step stays one.
        assert!(path_mm(&[0.5, 1.0], 1, 1, true).is_empty());
        assert_eq!(path_mm(&[0.5, 1.0], 1, 2, true).len(), 1);
    }
}
