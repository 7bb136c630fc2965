//! `human`: the finger beside what was measured on people's.

use papilla_fe_datagen::cli::{CHECKS_FAILED, choices, print, refuse_unknown};
use papilla_fingertip::scene::{Finger, FingerError};
use papilla_progress::Progress;
use papilla_studies::people::measured::Measured;
use papilla_studies::people::study::{self, Materials, Options, PARTS};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Press the finger as people's were pressed, and compare: stiffness, contact area, pressure,
/// volume, energy lost, and the rates of SA1 afferents under spheres.
///
/// Writes human.json, human.md with tables and plots, and a file a simulation; see studies/reports/human.md. Can be killed
/// at any moment and started again: what is pressed is not pressed again.
#[derive(clap::Args)]
#[command(after_help = "Exit code 3 if a figure lies outside people's spread.\n\
                  Example: papilla-studies human --only sa1 --density coarse --out out/human")]
pub(super) struct Args {
    /// Only this part (sa1, mesh, cylinders, plates, shear, tangential, tap, relaxation); may be given several times.
    #[arg(long, value_name = "PART")]
    only: Vec<String>,
    /// Mesh of the spheres' states, cells split where they touch.
    #[arg(long, value_enum, default_value_t = choices::Density::Medium)]
    density: choices::Density,
    /// Laws and constants of the tissues; with `--finger` the laws that take its constants.
    #[arg(long, value_enum, default_value_t = Materials::NeoHookean)]
    materials: Materials,
    /// A finger of your own: its folder, its finger.toml, or its name in fingers/.
    #[arg(long, value_name = "FINGER")]
    finger: Option<PathBuf>,
    /// Measurements in the place of those that come with the program.
    #[arg(long, value_name = "FILE")]
    measured: Option<PathBuf>,
    /// Folder for the report, the plots and what a restart needs.
    #[arg(long)]
    out: PathBuf,
    /// Also write the page to this file, its plots into pictures/human beside it.
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
    /// Print the report as JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    refuse_unknown(&args.only, &PARTS)?;
    let measured = match &args.measured {
        Some(file) => Measured::read(file)?,
        None => Measured::shipped()?,
    };
    let named = |path: &PathBuf| {
        Ok::<_, FingerError>((path.display().to_string(), Finger::find(path, Path::new(""))?))
    };
    let finger = args.finger.as_ref().map(named).transpose()?;
    let options = Options {
        materials: args.materials,
        finger,
        density: args.density.into(),
        only: args.only.clone(),
    };
    papilla_output::atomic::create_folder(&args.out)?;
    let progress = Progress::new("presses", 0, 0, args.json);
    let tell = &mut |what: &str, done: usize, all: usize| {
        progress.set_length(all);
        progress.set_position(done);
        progress.set_message(what);
    };
    let report = study::run(&measured, &options, &args.out, tell)?;
    drop(progress);
    if let Some(page) = &args.markdown {
        report.write_page(page)?;
    }
    print(&report, args.json, || report.human())?;
    Ok(if report.passed() { ExitCode::SUCCESS } else { ExitCode::from(CHECKS_FAILED) })
}
