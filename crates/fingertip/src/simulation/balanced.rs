//! An indentation whose energy balances: taken again where its path was too coarse or its nodes
//! slipped.

use super::body::{Body, SimulationError};
use super::drive::{Approach, Drive};
use super::record::IncrementRecord;
use papilla_fem::contact::ContactRule;
use papilla_fem::solve::{Solver, StepReport};
use serde::{Deserialize, Serialize};

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

/// What one way ended with.
struct Taken<T> {
    kept: Vec<T>,
    depths_mm: Vec<f64>,
    pressed: Result<(), SimulationError>,
    /// Largest `energy_vs_work` over the accepted one; NaN if one is NaN.
    excess: f64,
}

impl<T> Taken<T> {
    /// Whether every state was found and one misses its energy.
    fn loses_energy(&self) -> bool {
        // NaN does.
        self.pressed.is_ok() && !(self.excess <= 1.0)
    }
}

impl Body {
    /// Presses, keeps something of each stored state (`keep` is told its number and may be
    /// told again), and takes the indentation again on a finer path as long as energy and work
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
        keep: &mut dyn FnMut(usize, &Solver<'_>, &IncrementRecord, &StepReport) -> T,
    ) -> Balanced<T> {
        let mut attempts = Vec::new();
        let mut press = |approach: &Approach| {
            self.refined(solver, approach, drive, energy_vs_work_max, keep, &mut attempts)
        };
        let with = |rule| Approach { contact: Some(rule), ..approach.clone() };
        let mut way = approach.clone();
        let mut taken = press(&way);
        let stopped = matches!(
            taken.pressed,
            Err(SimulationError::Solve { .. } | SimulationError::Slipped { .. })
        );
        let straight = !matches!(drive, Drive::Path(_));
        if ((straight && taken.loses_energy()) || stopped) && self.can_take_gauss_points(approach) {
            tracing::info!("nodes slip off the indenter: solved again with Gauss-point contact");
            way = with(ContactRule::Gauss);
            taken = press(&way);
        }
        if straight && taken.loses_energy() && self.can_take_order_3(&way) {
            tracing::info!(
                "the skin jumps within faces: solved again with Gauss points of order 3"
            );
            taken = press(&with(ContactRule::GaussOrder3));
        }
        Balanced { kept: taken.kept, attempts, pressed: taken.pressed }
    }

    /// Presses on finer paths until the energy balances, or no finer one is left.
    fn refined<T>(
        &self,
        solver: &mut Solver<'_>,
        approach: &Approach,
        drive: &Drive,
        energy_vs_work_max: f64,
        keep: &mut dyn FnMut(usize, &Solver<'_>, &IncrementRecord, &StepReport) -> T,
        attempts: &mut Vec<Attempt>,
    ) -> Taken<T> {
        let mut once = |drive: &Drive, refinement: u32| {
            let (mut kept, mut depths_mm, mut excess) = (Vec::new(), Vec::new(), 0.0f64);
            let path = (refinement, Some(MENDED * energy_vs_work_max));
            let pressed = self.press_to(solver, approach, drive, path, &mut |s, record, r| {
                let found = record.checks.energy_vs_work / energy_vs_work_max;
                excess = if found <= excess { excess } else { found };
                depths_mm.push(record.depth_mm);
                kept.push(keep(kept.len(), s, record, r));
            });
            attempts.push(Attempt {
                contact: solver.contact_rule(),
                refinement,
                energy_vs_work: (!kept.is_empty()).then_some(excess * energy_vs_work_max),
                stopped: pressed.as_ref().err().map(ToString::to_string),
            });
            Taken { kept, depths_mm, pressed, excess }
        };
        let mut taken = once(drive, 1);
        let (drive, finer) = match drive {
            Drive::Depths(_) => (drive.clone(), REFINEMENTS[1..].to_vec()),
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
            taken = once(&drive, refinement);
            // What rubs loses energy that no finer path finds.
            if matches!(drive, Drive::Path(_)) && taken.excess > GAIN_MIN * before {
                break;
            }
        }
        taken
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
mod tests {
    use super::*;

    #[test]
    fn a_path_is_refined_by_as_much_as_it_misses() {
        for (excess, first) in [(1.1, 2), (3.9, 2), (4.1, 4), (51.4, 8), (1e9, 16)] {
            assert_eq!(path_refinements(excess)[0], first, "{excess}");
        }
        assert_eq!(path_refinements(5.0), [4, 8, 16]);
        assert_eq!(path_refinements(f64::NAN), [2, 4, 8, 16]);
    }
}
