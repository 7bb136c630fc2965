//! `wedge`: the wedge of Chen, Shuai & Zhu.

use papilla_fe_datagen::cli::{CHECKS_FAILED, choices, print};
use papilla_fingertip::mesh::fingertip::Density;
use papilla_output::atomic;
use papilla_studies::wedge::reading::Reading;
use papilla_studies::wedge::report::{Summary, readings_table, write};
use papilla_studies::wedge::run as simulate;
use std::path::PathBuf;
use std::process::ExitCode;

/// Reproduce the wedge of Chen, Shuai & Zhu (studies/reports/wedge.md).
///
/// Presses their wedge 1 mm into the section in 1 s and holds it for 10 s; writes
/// their figures 2(a), 2(b) and 3 as .svg and .csv, and s2.json. Exits with 3 if
/// something that they state does not hold.
#[derive(clap::Args)]
#[command(after_help = "Example: papilla-studies wedge --out out/wedge")]
pub(super) struct Args {
    /// Folder for figures and numbers.
    #[arg(long)]
    out: PathBuf,
    /// Density of the mesh.
    #[arg(long, value_enum, default_value_t = choices::Density::Medium)]
    density: choices::Density,
    /// How to read what the paper leaves open.
    #[arg(long, value_enum, default_value_t = Reading::Taken)]
    reading: Reading,
    /// Run every other reading too, for the table readings.md.
    #[arg(long)]
    all_readings: bool,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let (taken, density) = (args.reading, Density::from(args.density));
    atomic::create_folder(&args.out)?;
    let outcome = simulate(taken, density)?;
    let summary = Summary::from(&outcome);
    write(&args.out, &outcome, &summary)?;
    let reproduces = summary.reproduces();
    print(&summary, args.json, || format!("{}written to {}", summary.human(), args.out.display()))?;
    if args.all_readings {
        let mut rows = vec![(taken, Ok(summary))];
        for reading in Reading::ALL.into_iter().filter(|r| *r != taken) {
            rows.push((reading, simulate(reading, density).map(|o| Summary::from(&o))));
        }
        atomic::write(&args.out.join("readings.md"), readings_table(&rows).as_bytes())?;
    }
    Ok(if reproduces { ExitCode::SUCCESS } else { ExitCode::from(CHECKS_FAILED) })
}
