//! `solve`: solves one scene and writes all its results.

mod maps;
mod press;

use super::signals::{self, INTERRUPTED};
use super::{CHECKS_FAILED, print};
use papilla_fem::contact::ContactRule;
use papilla_fem::solve::{Effort, Options};
use papilla_fingertip::forecast::{SedError, better};
use papilla_fingertip::run::{BETTER, Increment, doubts};
use papilla_fingertip::scene::{Output, Plan, Scene};
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::body::SimulationError;
use papilla_fingertip::simulation::maps::FingerMaps;
use papilla_output::atomic;
use press::{LAST_STATE, press};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

/// Solve one scene and write everything that can be looked at.
///
/// Writes summary.json and what the scene's `outputs` name, by default all: a .vtu
/// series for ParaView (series.pvd) and, for a fingertip, pressure.png and sed.png
/// (16-bit gray, with -color twins) of the deepest state and maps.npz of all stored
/// states; for a section pressure.svg, sed.svg and lines.npz along the skin. Maps are
/// those that a dataset holds of the same states.
#[derive(clap::Args)]
#[command(
    after_help = "Ctrl-C (or TERM) ends the solve within an iteration: the states that are done are written,\n\
                  the exit code is 130. A second Ctrl-C leaves at once.\n\
                  Example: fe-datagen solve scenes/flat-press.toml --out out/flat-press"
)]
pub(super) struct Args {
    /// Scene file (see scenes/ and docs/reference/scenes.md).
    scene: PathBuf,
    /// Folder for the results.
    #[arg(long)]
    out: PathBuf,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

/// What `solve` says of a scene.
#[derive(Serialize)]
struct Summary {
    scene: Scene,
    plan: Plan,
    unknowns: usize,
    elements: usize,
    factor_entries: usize,
    atlas_hash: Option<String>,
    setup_s: f64,
    solve_s: f64,
    effort: Effort,
    /// Error of SED at the interface on this mesh, relative L2, and where it was measured; absent for
    /// what is no fingertip.
    #[serde(skip_serializing_if = "Option::is_none")]
    sed_error: Option<(SedError, &'static str)>,
    /// What was done to meshes to make bodies of them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    mended: Vec<String>,
    /// What may be a mistake.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    doubts: Vec<String>,
    /// True if it was told to end before its last state.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    stopped: bool,
    increments: Vec<Increment>,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let stop = signals::interrupt()?;
    let scene = Scene::read(&args.scene)?;
    let clock = Instant::now();
    let mut setup = Simulation::new(&scene)?;
    let mended = setup.approach.shape.mended();
    for done in &mended {
        eprintln!("{}: {done}", args.scene.display());
    }
    let doubts = doubts(&scene, &setup)?;
    for doubt in &doubts {
        eprintln!("{}: {doubt}", args.scene.display());
    }
    let maps = FingerMaps::new(&mut setup.body)?;
    let mapped = scene.writes(Output::Maps) || scene.writes(Output::Pictures);
    let body = &setup.body;
    let mut solver = body.solver(Options::default())?;
    solver.stop_when(Some(Arc::clone(&stop)));
    let setup_s = clock.elapsed().as_secs_f64();
    atomic::create_folder(&args.out)?;
    let clock = Instant::now();
    let fields = scene.writes(Output::Fields).then_some(&args.out);
    let (pressed, solved) = press(&setup, &mut solver, &stop, fields, args.json)?;
    let records: Vec<_> = pressed.iter().map(|p| p.record.clone()).collect();
    if let (Some(maps), true) = (&maps, mapped) {
        maps::write(&args.out, &scene, maps, &records)?;
    } else if body.plane {
        super::lines::write(&args.out, &scene, &setup, &records)?;
    }
    let summary = Summary {
        plan: setup.plan,
        unknowns: body.problem.system.dofs.count,
        elements: body.problem.mesh.element_count(),
        factor_entries: body.problem.system.factor_entries(),
        atlas_hash: maps.as_ref().filter(|_| mapped).map(|m| m.atlas.hash().to_owned()),
        setup_s,
        solve_s: clock.elapsed().as_secs_f64(),
        effort: pressed.iter().fold(Effort::default(), |sum, p| sum.plus(&p.report.effort)),
        sed_error: SedError::of(&scene.geometry),
        mended,
        doubts,
        stopped: matches!(solved, Err(SimulationError::Halted)),
        increments: pressed.iter().map(|p| Increment::of(p, maps.as_ref())).collect(),
        scene,
    };
    atomic::write_json(&args.out.join("summary.json"), &summary)?;
    if summary.stopped {
        return stopped(&summary, setup.drive.len(), args);
    }
    if solved.is_err() && summary.scene.writes(Output::Fields) {
        eprintln!("{} shows the last equilibrium", args.out.join(LAST_STATE).display());
    }
    solved?;
    print(&summary, args.json, || human(&summary, &args.out))?;
    let clean = summary.increments.iter().all(|i| i.fault.is_none());
    Ok(if clean { ExitCode::SUCCESS } else { ExitCode::from(CHECKS_FAILED) })
}

/// Says what is kept of a solve that was told to end.
fn stopped(summary: &Summary, states: usize, args: &Args) -> anyhow::Result<ExitCode> {
    let kept = summary.increments.len();
    if kept > 0 {
        print(summary, args.json, || human(summary, &args.out))?;
    }
    let out = args.out.display();
    eprintln!("stopped: {kept} of {states} states are done and written to {out}");
    Ok(ExitCode::from(INTERRUPTED))
}

fn human(s: &Summary, out: &Path) -> String {
    let mut text = format!(
        "{} unknowns, {} elements, {} factor entries; set-up {:.1} s, solve {:.1} s \
         (assembly {:.1}, factorization {:.1}, linear solves {:.1})\n",
        s.unknowns,
        s.elements,
        s.factor_entries,
        s.setup_s,
        s.solve_s,
        s.effort.assemble_s,
        s.effort.factor_s,
        s.effort.solve_s,
    );
    text +=
        "depth mm   force N   pressure kPa   SED dermis J/m3   iterations   energy against work\n";
    for i in &s.increments {
        let force = papilla_vector::norm(i.force_n);
        text += &format!(
            "{:8.3} {:9.4} {:14.3} {:>17} {:12} {:19.2} %{}\n",
            i.depth_mm,
            force,
            i.pressure_pa_max / 1e3,
            i.sed_dermis_j_per_m3_max.map_or("-".into(), |v| format!("{v:.2}")),
            i.checks.newton_iterations,
            100.0 * i.checks.energy_vs_work,
            i.fault.as_ref().map_or(String::new(), |f| format!("  FAILED: {f}")),
        );
        if i.contact == ContactRule::Gauss {
            text += "         contact within faces: the indenter is too narrow for their nodes\n";
        }
        if i.outside_calibration > 0.0 {
            let percent = 100.0 * i.outside_calibration;
            text += &format!("         {percent:.2} % of the volume beyond calibrated stretches\n");
        }
    }
    if let Some((error, source)) = s.sed_error {
        text += &format!("error of SED on this mesh: {} ({source})", error.words());
        if better(&s.scene.geometry).is_some() {
            text += &format!("; {BETTER} it is small: `fe-datagen explain` says at which price");
        }
        text += "\n";
    }
    text + &format!("written to {}", out.display())
}
