//! The press of one scene, state by state.

use crate::body_file::write_vtu;
use papilla_dataset::BALANCE_RELATIVE_MAX;
use papilla_fem::solve::{Solver, StepReport};
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::balanced::Balanced;
use papilla_fingertip::simulation::body::SimulationError;
use papilla_fingertip::simulation::record::IncrementRecord;
use papilla_output::vtu;
use papilla_progress::Progress;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

/// Field of the last equilibrium before a solve was given up.
pub(super) const LAST_STATE: &str = "last-state.vtu";

/// A stored equilibrium.
pub(super) struct Pressed {
    pub record: IncrementRecord,
    pub report: StepReport,
    /// Greatest pressure on the contact surface, MPa.
    pub pressure_mpa_max: f64,
}

/// Presses and writes the fields of every stored equilibrium into `out`, if given; those before an
/// error are kept. What is stopped while an indentation is taken again keeps the states of the way
/// before where it has none yet: they are the same, but for the work on the way to them.
pub(super) fn press(
    setup: &Simulation,
    solver: &mut Solver<'_>,
    stop: &AtomicBool,
    out: Option<&PathBuf>,
    quiet: bool,
) -> anyhow::Result<(Vec<Pressed>, Result<(), SimulationError>)> {
    let Simulation { body, approach, drive, .. } = setup;
    let progress = Progress::new("states", drive.len(), 0, quiet);
    let (mut written, mut worst) = (Ok(()), 0.0f64);
    let (mut way, mut way_before) = (Vec::new(), Vec::new());
    let file = |state: usize| format!("state-{state:03}.vtu");
    let keep =
        &mut |state: usize, s: &Solver<'_>, record: &IncrementRecord, report: &StepReport| {
            if let (Some(out), true) = (out, written.is_ok()) {
                written = write_vtu(&out.join(file(state)), body, s);
                if written.is_err() {
                    // Said now, not after all states are solved.
                    stop.store(true, Ordering::Relaxed);
                }
            }
            progress.set_position(state + 1);
            progress.set_message(format!("{:.3} mm deep", record.depth_mm));
            worst = if state == 0 { 0.0 } else { worst }.max(record.checks.energy_vs_work);
            if state + 1 == drive.len() && worst > BALANCE_RELATIVE_MAX {
                progress.set_position(0);
                progress.set_message("energy and work part: taken again in smaller steps");
            }
            let surface = &body.problem.mesh.surfaces[&body.contact];
            let pressure_mpa_max = s.pressure_mpa(surface).into_iter().fold(0.0, f64::max);
            if state == 0 {
                way_before = std::mem::take(&mut way);
            }
            way.push(Pressed { record: record.clone(), report: *report, pressure_mpa_max });
        };
    let Balanced { kept, pressed: solved, .. } =
        body.press_balanced(solver, approach, drive, BALANCE_RELATIVE_MAX, keep);
    drop(progress);
    let stopped = matches!(solved, Err(SimulationError::Halted));
    let mut pressed = way;
    if stopped {
        pressed.extend(way_before.into_iter().skip(pressed.len()));
    } else {
        // A way without a state leaves none of the way before.
        pressed.truncate(kept.len());
    }
    if let (Err(_), Some(out), true) = (&solved, out, written.is_ok() && !stopped) {
        written = write_vtu(&out.join(LAST_STATE), body, solver);
    }
    written?;
    let place = |r: &IncrementRecord| if drive.is_timed() { r.time_s } else { r.depth_mm };
    let series: Vec<_> =
        pressed.iter().enumerate().map(|(i, p)| (place(&p.record), file(i))).collect();
    if let Some(out) = out {
        vtu::write_pvd(&out.join("series.pvd"), &series)?;
    }
    Ok((pressed, solved))
}
