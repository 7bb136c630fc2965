//! `s2`: the wedge press of Chen, Shuai & Zhu.

use super::{CHECKS_FAILED, print};
use crate::mesh::fingertip::Density;
use crate::output::atomic;
use crate::s2::reading::Reading;
use crate::s2::report::{Summary, readings_table, write};
use crate::s2::run as press;
use std::path::PathBuf;
use std::process::ExitCode;

/// Reproduce the wedge press of Chen, Shuai & Zhu (docs/reports/wedge.md).
///
/// Presses their wedge 1 mm into the section in 1 s and holds it for 10 s; writes
/// their figures 2(a), 2(b) and 3 as .svg and .csv, and s2.json. Exits with 3 if
/// something that they state does not hold.
#[derive(clap::Args)]
#[command(name = "s2", after_help = "Example: fe-datagen s2 --out out/s2")]
pub(super) struct Args {
    /// Folder for figures and numbers.
    #[arg(long)]
    out: PathBuf,
    /// Density of the mesh.
    #[arg(long, value_enum, default_value_t = Density::Medium)]
    density: Density,
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
    let outcome = press(args.reading, args.density)?;
    let summary = Summary::from(&outcome);
    atomic::create_folder(&args.out)?;
    write(&args.out, &outcome, &summary)?;
    let reproduces = summary.reproduces();
    print(&summary, args.json, || format!("{}written to {}", summary.human(), args.out.display()))?;
    if args.all_readings {
        let mut rows = vec![(args.reading, Ok(summary))];
        for reading in Reading::ALL.into_iter().filter(|r| *r != args.reading) {
            rows.push((reading, press(reading, args.density).map(|o| Summary::from(&o))));
        }
        atomic::write(&args.out.join("readings.md"), readings_table(&rows).as_bytes())?;
    }
    Ok(if reproduces { ExitCode::SUCCESS } else { ExitCode::from(CHECKS_FAILED) })
}
