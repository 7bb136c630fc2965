//! `fit`: constants that come closest to people's fingers.

use papilla_fe_datagen::cli::{print, refuse_unknown};
use papilla_progress::Progress;
use papilla_studies::people::fit::{self, Options, PARTS};
use papilla_studies::people::measured::Measured;
use std::path::PathBuf;
use std::process::ExitCode;

/// Fit the constants of skin and fat, within printed values, to what plates measure on people's
/// fingers, then the shares of relaxation to the energy lost in a tap.
///
/// Writes fit.json, fit.md, materials.toml (tables for a scene) and a file a press; see
/// studies/reports/fit.md. No chance in it: the same measurements give the same constants. Can be killed
/// at any moment and started again: what is pressed is not pressed again.
#[derive(clap::Args)]
#[command(after_help = "Example: papilla-studies fit --out out/fit")]
pub(super) struct Args {
    /// Only this part (plates, taps, maps; plates are pressed in any case); may be given several times.
    #[arg(long, value_name = "PART")]
    only: Vec<String>,
    /// Evaluations at most, two presses each.
    #[arg(long, default_value_t = 40, value_parser = clap::value_parser!(u16).range(1..=1000))]
    evaluations: u16,
    /// Measurements in the place of those that come with the program.
    #[arg(long, value_name = "FILE")]
    measured: Option<PathBuf>,
    /// Folder for the report and what a restart needs.
    #[arg(long)]
    out: PathBuf,
    /// Also write the page to this file.
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
    /// Print the fit as JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    refuse_unknown(&args.only, &PARTS)?;
    let measured = match &args.measured {
        Some(file) => Measured::read(file)?,
        None => Measured::shipped()?,
    };
    let options = Options { evaluations: args.evaluations.into(), only: args.only.clone() };
    let progress = Progress::new("evaluations", args.evaluations.into(), 0, args.json);
    let tell = &mut |what: &str, done: usize, all: usize| {
        progress.set_length(all);
        progress.set_position(done);
        progress.set_message(what);
    };
    let fit = fit::run(&measured, &options, &args.out, tell)?;
    drop(progress);
    if let Some(page) = &args.markdown {
        fit.write_page(page)?;
    }
    print(&fit, args.json, || fit.human())?;
    Ok(ExitCode::SUCCESS)
}
