//! `convergence`: SED at the interface on ever finer meshes.

use super::{CHECKS_FAILED, print, refuse_unknown};
use papilla_fingertip::mesh::named::MESHES;
use papilla_progress::Progress;
use papilla_validation::convergence::{self, CASES};
use std::path::PathBuf;
use std::process::ExitCode;

/// Press the finger with a plate, a ball, bars, punches, an edge and a dot of Braille on
/// meshes that differ in spacing, layers and element, and compare SED at the dermis-epidermis
/// interface and pressure at the same points.
///
/// The last of the meshes is the reference. Writes convergence.json, convergence.svg and a
/// file a solution; see docs/concepts/accuracy.md.
///
/// Can be killed at any moment and started again: what is solved is not solved again.
#[derive(clap::Args)]
#[command(
    after_help = "The reference takes some 4 GB and a quarter of an hour a state; coarse-graded takes seconds.\n\
                        Example: fe-datagen convergence --case ball --mesh medium-linear --mesh medium-graded \
                        --out out/convergence"
)]
pub(super) struct Args {
    /// Only these indentations.
    #[arg(long)]
    case: Vec<String>,
    /// Only these meshes; the last of the list in the help's order is what others are compared with.
    #[arg(long)]
    mesh: Vec<String>,
    /// Stored states of each indentation.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=20))]
    states: u32,
    /// Folder for convergence.json, the plot and what a restart needs.
    #[arg(long)]
    out: PathBuf,
    /// Print the report as JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    refuse_unknown(&args.case, &CASES.map(|c| c.name))?;
    refuse_unknown(&args.mesh, &MESHES.map(|m| m.name))?;
    let wanted = |only: &[String], name: &str| only.is_empty() || only.iter().any(|o| o == name);
    let cases: Vec<_> = CASES.iter().filter(|c| wanted(&args.case, c.name)).collect();
    let meshes: Vec<_> = MESHES.into_iter().filter(|m| wanted(&args.mesh, m.name)).collect();
    papilla_output::atomic::create_folder(&args.out)?;
    let progress = Progress::new("solutions", cases.len() * meshes.len(), 0, args.json);
    let tell = &mut |what: &str, done: usize, _: usize| {
        progress.set_position(done);
        progress.set_message(what);
    };
    let report = convergence::run(&cases, &meshes, args.states as usize, &args.out, tell)?;
    drop(progress);
    print(&report, args.json, || report.human())?;
    let clean = report.rows.iter().all(|r| r.faults.is_empty());
    Ok(if clean { ExitCode::SUCCESS } else { ExitCode::from(CHECKS_FAILED) })
}
