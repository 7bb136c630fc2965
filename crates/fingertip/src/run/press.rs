//! The press of one scene, state by state.

use crate::simulation::Simulation;
use crate::simulation::balanced::Balanced;
use crate::simulation::body::SimulationError;
use crate::simulation::drive::Drive;
use crate::simulation::record::IncrementRecord;
use papilla_dataset::BALANCE_RELATIVE_MAX;
use papilla_fem::contact::ContactRule;
use papilla_fem::solve::{Solver, StepReport};
use papilla_vector::norm;

/// A stored equilibrium.
#[derive(Clone, Debug)]
pub struct Pressed {
    /// Values at vertices, and checks.
    pub record: IncrementRecord,
    /// What the solver says of it.
    pub report: StepReport,
    /// Greatest pressure on the contact surface, MPa.
    pub pressure_mpa_max: f64,
    /// Why the contact is none to rely on; `None` if it is.
    pub doubt: Option<String>,
}

/// Most nodes in contact whose force is that of so many nodes rather than of the indenter: on the
/// coarse even mesh a ball of 2 mm radius, .4 mm deep, has 59 % of the force that it has on the medium
/// graded mesh where it stands on one node, and 142 % where it stands between four.
const FEW: usize = 4;

/// Why a state's contact is none to rely on.
fn doubt(setup: &Simulation, solver: &Solver<'_>, record: &IncrementRecord) -> Option<String> {
    let depth_mm = record.depth_mm;
    if matches!(setup.drive, Drive::Depths(_)) && norm(record.force_n) == 0.0 {
        return Some(format!(
            "there is no force at a depth of {depth_mm} mm: the indenter slipped between the nodes of \
             the mesh. Take geometry.order = \"graded\" or a finer mesh, or a larger indenter (is its \
             unit the one that was meant?)"
        ));
    }
    let is_nodal = record.contact == ContactRule::Nodal && !matches!(setup.drive, Drive::Shares(_));
    let touching = solver.traction_mpa().iter().filter(|t| **t > 0.0).count();
    (is_nodal && !setup.body.plane && (1..=FEW).contains(&touching)).then(|| {
        format!(
            "the contact rests on {touching} node{} of the skin: its force and pressure are those of the \
             mesh. Take geometry.order = \"graded\" or a finer mesh, or press deeper",
            if touching == 1 { "" } else { "s" }
        )
    })
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
            let doubt = doubt(setup, s, record);
            let record = record.clone();
            let pressed = Pressed { record, report: *report, pressure_mpa_max, doubt };
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
