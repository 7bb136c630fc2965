//! An indentation whose energy balances: taken again where its path was too coarse or its nodes
//! slipped.

use super::body::{Body, SimulationError};
use super::drive::{Approach, Drive};
use super::record::IncrementRecord;
use papilla_fem::contact::ContactRule;
use papilla_fem::solve::{Solver, StepReport};

/// How often the path between stored states is made finer for the work integral.
const REFINEMENTS: [u32; 3] = [1, 2, 4];

impl Body {
    /// Presses, keeps something of each stored state (`keep` is told its number and may be
    /// told again), and takes the indentation again on a finer path as long as energy and work
    /// part by more than `energy_vs_work_max`: the states are the same there, the work
    /// integral is better. Where that does not help, or there is no equilibrium, nodes have slipped
    /// off the indenter, and energy with them: it is solved again with Gauss-point contact, if
    /// it is wide enough for that; and at more points of them, if energy is lost there too.
    /// States before an error are kept.
    ///
    /// # Errors
    /// As [`Self::press`], beside what was kept.
    pub fn press_balanced<T>(
        &self,
        solver: &mut Solver<'_>,
        approach: &Approach,
        drive: &Drive,
        energy_vs_work_max: f64,
        keep: &mut dyn FnMut(usize, &Solver<'_>, &IncrementRecord, &StepReport) -> T,
    ) -> (Vec<T>, Result<(), SimulationError>) {
        let mut press = |approach: &Approach| {
            let (mut kept, mut pressed) = (Vec::with_capacity(drive.len()), Ok(()));
            let mut balanced = false;
            for refinement in REFINEMENTS {
                kept.clear();
                balanced = true;
                pressed = self.press(solver, approach, drive, refinement, &mut |s, record, r| {
                    balanced &= record.checks.energy_vs_work <= energy_vs_work_max;
                    kept.push(keep(kept.len(), s, record, r));
                });
                if pressed.is_err() || balanced || !matches!(drive, Drive::Depths(_)) {
                    break;
                }
            }
            let loses = pressed.is_ok() && !balanced && matches!(drive, Drive::Depths(_));
            (loses, kept, pressed)
        };
        let with = |rule| Approach { contact: Some(rule), ..approach.clone() };
        let mut taken = approach.clone();
        let (mut loses, mut kept, mut pressed) = press(&taken);
        let stopped =
            matches!(pressed, Err(SimulationError::Solve { .. } | SimulationError::Slipped { .. }));
        if (loses || stopped) && self.can_take_gauss_points(approach) {
            tracing::info!("nodes slip off the indenter: solved again with Gauss-point contact");
            taken = with(ContactRule::Gauss);
            (loses, kept, pressed) = press(&taken);
        }
        if loses && self.can_take_order_3(&taken) {
            tracing::info!(
                "the skin jumps within faces: solved again with Gauss points of order 3"
            );
            (_, kept, pressed) = press(&with(ContactRule::GaussOrder3));
        }
        (kept, pressed)
    }
}
