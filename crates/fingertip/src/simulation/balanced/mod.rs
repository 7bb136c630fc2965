//! An indentation whose energy balances: taken again where its path was too coarse or its nodes
//! slipped.

use super::body::{Body, SimulationError};
use super::drive::{Approach, Course, Drive};
use super::record::IncrementRecord;
use papilla_fem::contact::ContactRule;
use papilla_fem::solve::{Snapshot, Solver, StepReport};
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

/// How often the way between stored depths is made finer for the work integral.
const REFINEMENTS: [u32; 3] = [1, 2, 4];
/// Part of the accepted difference of energy and work to which the work is mended on its way: what
/// is missed before one stored depth stays with the next.
const MENDED: f64 = 0.5;
/// A finer path over time that leaves more than this share of what the last one missed is the last.
const GAIN_MIN: f64 = 0.5;
/// Most equilibria for one stored state of a path over time, for the same.
const PATH_REFINEMENT_MAX: u32 = 16;

/// One of the ways on which an indentation was solved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Attempt {
    /// Where on the skin contact was found.
    pub contact: ContactRule,
    /// How fine the path was, see [`Body::press`].
    pub refinement: u32,
    /// Largest `energy_vs_work` of its states; absent without one.
    pub energy_vs_work: Option<f64>,
    /// Why it ended before its last state.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stopped: Option<String>,
}

/// What an indentation ended with.
pub struct Balanced<T> {
    /// What was kept of each state, those before an error among them.
    pub kept: Vec<T>,
    /// Every way taken; the last is the one that was kept.
    pub attempts: Vec<Attempt>,
    /// Whether the last way led to the end.
    pub pressed: Result<(), SimulationError>,
}

/// Keeps something of each stored state; is told its number, and may be told again.
pub type Keep<'a, T> = &'a mut dyn FnMut(usize, &Solver<'_>, &IncrementRecord, &StepReport) -> T;

/// An indentation at a stored depth, to be gone on with by another process.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Standing<T> {
    behind: Vec<Behind>,
    kept: Vec<T>,
    excess: f64,
    solver: Snapshot,
}

/// A way that was taken to its end.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Behind {
    contact: ContactRule,
    refinement: u32,
    /// Absent without a state.
    energy_vs_work: Option<f64>,
    stopped: Option<String>,
    excess: f64,
    no_equilibrium: bool,
}

impl From<Behind> for Attempt {
    fn from(Behind { contact, refinement, energy_vs_work, stopped, .. }: Behind) -> Self {
        Self { contact, refinement, energy_vs_work, stopped }
    }
}

/// An indentation that has just stored a depth.
pub struct AtState<'a, T> {
    behind: &'a [Behind],
    kept: &'a [T],
    excess: f64,
    solver: &'a Solver<'a>,
}

impl<T: Clone> AtState<'_, T> {
    /// Depths stored on this way.
    #[must_use]
    pub fn states(&self) -> usize {
        self.kept.len()
    }

    /// What it takes to go on from here: the same bits as if nothing had come between.
    #[must_use]
    pub fn standing(&self) -> Standing<T> {
        Standing {
            behind: self.behind.to_vec(),
            kept: self.kept.to_vec(),
            excess: self.excess,
            solver: self.solver.snapshot(),
        }
    }
}

/// How an indentation that may be stopped begins, and who stops it.
pub struct Stoppable<'a, T> {
    /// Where an earlier process left it.
    pub from: Option<Standing<T>>,
    /// Called at each stored depth; `Break` ends the indentation with
    /// [`SimulationError::Halted`]. Forces and paths over time have no such places.
    pub at_state: &'a mut dyn FnMut(&AtState<'_, T>) -> ControlFlow<()>,
}

/// What one way ended with.
struct Taken<T> {
    kept: Vec<T>,
    depths_mm: Vec<f64>,
    pressed: Result<(), SimulationError>,
    /// Whether it ended for want of an equilibrium.
    no_equilibrium: bool,
    /// Largest `energy_vs_work` over the accepted one; NaN if one is NaN.
    excess: f64,
}

impl<T> Taken<T> {
    /// Whether every state was found and one misses its energy.
    fn loses_energy(&self) -> bool {
        // NaN does.
        self.pressed.is_ok() && !(self.excess <= 1.0)
    }

    /// A way of an earlier process; another followed it, so that nothing was kept.
    fn earlier(way: &Behind) -> Self {
        let pressed = if way.no_equilibrium { Err(SimulationError::Halted) } else { Ok(()) };
        let (no_equilibrium, excess) = (way.no_equilibrium, way.excess);
        Self { kept: Vec::new(), depths_mm: Vec::new(), pressed, no_equilibrium, excess }
    }
}

impl Body {
    /// Presses, keeps something of each stored state, and takes the indentation again on a finer
    /// path as long as energy and work
    /// part by more than `energy_vs_work_max`: the states are the same there (on a path over time
    /// to the error of time integration), the work integral is better. Where that does not help,
    /// or there is no equilibrium, nodes have slipped off the indenter, and energy with them: it
    /// is solved again with Gauss-point contact, if it is wide enough for that; and at more points
    /// of them, if energy is lost there too. Energy that is lost on a path over time is no sign of
    /// that: it takes no other contact.
    pub fn press_balanced<T>(
        &self,
        solver: &mut Solver<'_>,
        approach: &Approach,
        drive: &Drive,
        energy_vs_work_max: f64,
        keep: Keep<'_, T>,
    ) -> Balanced<T> {
        let through = Stoppable { from: None, at_state: &mut |_| ControlFlow::Continue(()) };
        self.press_stoppable(solver, approach, drive, energy_vs_work_max, keep, through)
    }

    /// As [`Self::press_balanced`], from where an earlier process left the indentation, and no
    /// farther than whoever watches it wants.
    pub fn press_stoppable<T>(
        &self,
        solver: &mut Solver<'_>,
        approach: &Approach,
        drive: &Drive,
        energy_vs_work_max: f64,
        keep: Keep<'_, T>,
        Stoppable { from, at_state }: Stoppable<'_, T>,
    ) -> Balanced<T> {
        let behind = Vec::new();
        let mut ways =
            Ways { body: self, solver, energy_vs_work_max, keep, behind, from, at_state };
        let with = |rule| Approach { contact: Some(rule), ..approach.clone() };
        let mut way = approach.clone();
        let mut taken = ways.refined(&way, drive);
        let straight = matches!(drive, Drive::Depths(_) | Drive::Forces(_));
        let slips = (straight && taken.loses_energy()) || taken.no_equilibrium;
        if slips && self.can_take_gauss_points(approach) {
            tracing::info!("nodes slip off the indenter: solved again with Gauss-point contact");
            way = with(ContactRule::Gauss);
            taken = ways.refined(&way, drive);
        }
        if straight && taken.loses_energy() && self.can_take_order_3(&way) {
            tracing::info!(
                "the skin jumps within faces: solved again with Gauss points of order 3"
            );
            taken = ways.refined(&with(ContactRule::GaussOrder3), drive);
        }
        let attempts = ways.behind.into_iter().map(Attempt::from).collect();
        Balanced { kept: taken.kept, attempts, pressed: taken.pressed }
    }
}

/// The ways on which an indentation is solved, one after the other.
struct Ways<'a, 's, T> {
    body: &'a Body,
    solver: &'a mut Solver<'s>,
    energy_vs_work_max: f64,
    keep: Keep<'a, T>,
    behind: Vec<Behind>,
    from: Option<Standing<T>>,
    at_state: &'a mut dyn FnMut(&AtState<'_, T>) -> ControlFlow<()>,
}

impl<T> Ways<'_, '_, T> {
    /// Presses on finer paths until the energy balances, or no finer one is left.
    fn refined(&mut self, approach: &Approach, drive: &Drive) -> Taken<T> {
        let mut taken = self.once(approach, drive, 1);
        let (drive, finer) = match drive {
            Drive::Depths(_) | Drive::Shares(_) => (drive.clone(), REFINEMENTS[1..].to_vec()),
            // A state at a force is the state at its depth.
            Drive::Forces(_) => (Drive::Depths(taken.depths_mm.clone()), REFINEMENTS.to_vec()),
            Drive::Path(_) => (drive.clone(), path_refinements(taken.excess)),
        };
        for refinement in finer {
            if !taken.loses_energy() {
                break;
            }
            tracing::info!(refinement, "energy and work part: taken again on a finer path");
            let before = taken.excess;
            taken = self.once(approach, &drive, refinement);
            // What rubs loses energy that no finer path finds.
            if matches!(drive, Drive::Path(_)) && taken.excess > GAIN_MIN * before {
                break;
            }
        }
        taken
    }

    /// One way, or what is known of it, or the rest of it.
    fn once(&mut self, approach: &Approach, drive: &Drive, refinement: u32) -> Taken<T> {
        let known = self.from.as_ref().and_then(|from| from.behind.get(self.behind.len()));
        if let Some(known) = known.cloned() {
            let taken = Taken::earlier(&known);
            self.behind.push(known);
            return taken;
        }
        let (mut kept, mut excess, mut snapshot) = (Vec::new(), 0.0f64, None);
        if let (Some(from), Drive::Depths(_)) = (self.from.take(), drive) {
            (kept, excess, snapshot) = (from.kept, from.excess, Some(from.solver));
        }
        let mut depths_mm: Vec<f64> = match drive {
            Drive::Depths(depths) => depths.iter().copied().take(kept.len()).collect(),
            Drive::Forces(_) | Drive::Shares(_) | Drive::Path(_) => Vec::new(),
        };
        let Self { body, solver, energy_vs_work_max, keep, behind, at_state, .. } = self;
        let course = Course {
            refinement,
            energy_vs_work_max: Some(MENDED * *energy_vs_work_max),
            from: snapshot.as_ref().map(|snapshot| (kept.len(), snapshot)),
        };
        let stops = matches!(drive, Drive::Depths(_));
        let pressed = body.press_to(solver, approach, drive, course, &mut |s, record, r| {
            let found = record.checks.energy_vs_work / *energy_vs_work_max;
            excess = if found <= excess { excess } else { found };
            depths_mm.push(record.depth_mm);
            kept.push(keep(kept.len(), s, record, r));
            let at = AtState { behind, kept: &kept, excess, solver: s };
            match if stops { at_state(&at) } else { ControlFlow::Continue(()) } {
                ControlFlow::Continue(()) => Ok(()),
                ControlFlow::Break(()) => Err(SimulationError::Halted),
            }
        });
        let no_equilibrium =
            matches!(pressed, Err(SimulationError::Solve { .. } | SimulationError::Slipped { .. }));
        self.behind.push(Behind {
            contact: self.solver.contact_rule(),
            refinement,
            energy_vs_work: (!kept.is_empty()).then_some(excess * self.energy_vs_work_max),
            stopped: pressed.as_ref().err().map(ToString::to_string),
            excess,
            no_equilibrium,
        });
        Taken { kept, depths_mm, pressed, no_equilibrium, excess }
    }
}

/// Refinements of a path whose work integral misses `excess` times what is accepted, from the one
/// that should do: the error of the trapezoidal rule falls with the square.
fn path_refinements(excess: f64) -> Vec<u32> {
    let enough = 2.0_f64.powf(excess.max(1.0).sqrt().log2().ceil());
    // One that is not a number takes all.
    let first = enough.clamp(2.0, f64::from(PATH_REFINEMENT_MAX)) as u32;
    std::iter::successors(Some(first), |r| Some(2 * r))
        .take_while(|r| *r <= PATH_REFINEMENT_MAX)
        .collect()
}

#[cfg(test)]
mod tests;
