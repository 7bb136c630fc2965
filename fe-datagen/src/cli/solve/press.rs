//! Solves a scene, and shows and writes it state by state.

use papilla_dataset::BALANCE_RELATIVE_MAX;
use papilla_fem::solve::Solver;
use papilla_fingertip::run::{self, BodyFields, Pressed, write_vtu};
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::body::SimulationError;
use papilla_fingertip::simulation::record::IncrementRecord;
use papilla_output::vtu;
use papilla_progress::Progress;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

/// Field of the last equilibrium before a solve was given up.
pub(super) const LAST_STATE: &str = "last-state.vtu";

/// Presses and writes the fields of every stored equilibrium into `out`, if given; those before an
/// error are kept.
pub(super) fn press(
    setup: &Simulation,
    solver: &mut Solver<'_>,
    stop: &AtomicBool,
    out: Option<&PathBuf>,
    quiet: bool,
) -> anyhow::Result<(Vec<Pressed>, Result<(), SimulationError>)> {
    let Simulation { body, drive, .. } = setup;
    let mesh = &body.problem.mesh;
    let progress = Progress::new("states", drive.len(), 0, quiet);
    let (mut written, mut worst) = (Ok(()), 0.0f64);
    let file = |state: usize| format!("state-{state:03}.vtu");
    let visit = &mut |state: usize, s: &Solver<'_>, pressed: &Pressed| {
        if let (Some(out), true) = (out, written.is_ok()) {
            written = write_vtu(&out.join(file(state)), mesh, &BodyFields::new(body, s));
            if written.is_err() {
                // Said now, not after all states are solved.
                stop.store(true, Ordering::Relaxed);
            }
        }
        progress.set_position(state + 1);
        progress.set_message(format!("{:.3} mm deep", pressed.record.depth_mm));
        worst = if state == 0 { 0.0 } else { worst }.max(pressed.record.checks.energy_vs_work);
        if state + 1 == drive.len() && worst > BALANCE_RELATIVE_MAX {
            progress.set_position(0);
            progress.set_message("energy and work part: taken again in smaller steps");
        }
    };
    let (pressed, solved) = run::press(setup, solver, visit);
    drop(progress);
    let stopped = matches!(solved, Err(SimulationError::Halted));
    if let (Err(_), Some(out), true) = (&solved, out, written.is_ok() && !stopped) {
        written = write_vtu(&out.join(LAST_STATE), mesh, &BodyFields::new(body, solver));
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
