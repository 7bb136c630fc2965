//! The press of one scene, state by state.

use crate::simulation::Simulation;
use crate::simulation::balanced::Balanced;
use crate::simulation::body::SimulationError;
use crate::simulation::record::IncrementRecord;
use papilla_dataset::BALANCE_RELATIVE_MAX;
use papilla_fem::solve::{Solver, StepReport};

/// A stored equilibrium.
#[derive(Clone, Debug)]
pub struct Pressed {
    /// Values at vertices, and checks.
    pub record: IncrementRecord,
    /// What the solver says of it.
    pub report: StepReport,
    /// Greatest pressure on the contact surface, MPa.
    pub pressure_mpa_max: f64,
}

/// Presses; `visit` is told of each stored equilibrium as it is found, with its number from 0. Where
/// energy and work part, the indentation is taken again, and a number comes again: the state that
/// came last counts. Gives the states that count, those before an error among them. What is stopped
/// while an indentation is taken again keeps the states of the way before where it has none yet: they
/// are the same, but for the work on the way to them.
pub fn press(
    setup: &Simulation,
    solver: &mut Solver<'_>,
    visit: &mut dyn FnMut(usize, &Solver<'_>, &Pressed),
) -> (Vec<Pressed>, Result<(), SimulationError>) {
    let Simulation { body, approach, drive, .. } = setup;
    let (mut way, mut way_before) = (Vec::new(), Vec::new());
    let keep =
        &mut |state: usize, s: &Solver<'_>, record: &IncrementRecord, report: &StepReport| {
            let pressure_mpa_max = body.pressure_mpa(s).into_iter().fold(0.0, f64::max);
            let pressed = Pressed { record: record.clone(), report: *report, pressure_mpa_max };
            visit(state, s, &pressed);
            if state == 0 {
                way_before = std::mem::take(&mut way);
            }
            way.push(pressed);
        };
    let Balanced { kept, pressed: solved, .. } =
        body.press_balanced(solver, approach, drive, BALANCE_RELATIVE_MAX, keep);
    let mut pressed = way;
    if matches!(solved, Err(SimulationError::Halted)) {
        pressed.extend(way_before.into_iter().skip(pressed.len()));
    } else {
        // A way without a state leaves none of the way before.
        pressed.truncate(kept.len());
    }
    (pressed, solved)
}
