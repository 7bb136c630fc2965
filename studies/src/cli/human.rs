//! `human`: the finger beside what was measured on people's.

use super::people::OfPeople;
use papilla_fe_datagen::cli::{CHECKS_FAILED, choices, print, refuse_unknown};
use papilla_fingertip::scene::{Finger, FingerError};
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
    /// Laws and constants of the tissues; with `--finger` the laws that take its constants, unless its file says
    /// that they need Ogden's.
    #[arg(long, value_enum, default_value_t = Materials::NeoHookean)]
    materials: Materials,
    /// A finger of your own: its folder, its finger.toml, or its name in fingers/.
    #[arg(long, value_name = "FINGER")]
    finger: Option<PathBuf>,
    #[command(flatten)]
    people: OfPeople,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    refuse_unknown(&args.only, &PARTS)?;
    let people = &args.people;
    let measured = people.measured()?;
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
    let report =
        people.told("presses", 0, |told| study::run(&measured, &options, &people.out, told))?;
    if let Some(page) = &people.markdown {
        report.write_page(page)?;
    }
    print(&report, people.json, || report.human())?;
    Ok(if report.passed() { ExitCode::SUCCESS } else { ExitCode::from(CHECKS_FAILED) })
}
