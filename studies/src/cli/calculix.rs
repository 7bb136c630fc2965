//! `calculix`: the same problems in CalculiX.

use anyhow::{Context, bail};
use papilla_fe_datagen::cli::{CHECKS_FAILED, print, refuse_unknown};
use papilla_studies::calculix::{self, CASES, Ccx};
use papilla_validation::verify::Row;
use std::path::PathBuf;
use std::process::ExitCode;

/// Solve the same problems in CalculiX and compare.
///
/// Prints one line a quantity: this code, CalculiX, how far they are apart and
/// how far they may be. Says so and stops if there is no CalculiX.
#[derive(clap::Args)]
#[command(
    after_help = "Exit code 3 if any row is past its tolerance. studies/reports/calculix.md says what each row \
                  shows.\nExample: papilla-studies calculix --only sphere --keep out/calculix"
)]
pub(super) struct Args {
    /// CalculiX' solver [default: ccx on the PATH].
    #[arg(long, value_name = "PATH")]
    ccx: Option<PathBuf>,
    /// Run only this case; may be given several times.
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// Smaller meshes, for a test run.
    #[arg(long)]
    quick: bool,
    /// Keep decks and results in this folder.
    #[arg(long, value_name = "DIR")]
    keep: Option<PathBuf>,
    /// Print the rows as JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let names: Vec<_> = CASES.iter().map(|c| c.name).collect();
    refuse_unknown(&args.only, &names)?;
    let Some(ccx) = Ccx::find(args.ccx.as_deref()) else {
        if let Some(path) = &args.ccx {
            bail!("there is no program at {}", path.display());
        }
        println!("not run: ccx not installed (Debian: apt-get install calculix-ccx)");
        return Ok(ExitCode::SUCCESS);
    };
    let scratch = tempfile::tempdir().context("cannot create a folder for the decks")?;
    let folder = args.keep.as_deref().unwrap_or(scratch.path());
    papilla_output::atomic::create_folder(folder)?;
    let wanted = |c: &calculix::Case| args.only.is_empty() || args.only.iter().any(|n| n == c.name);
    if !args.json {
        println!("{}", Row::heading());
    }
    let report = calculix::run(&ccx, folder, args.quick, &wanted, &mut |_, rows| {
        for row in rows.into_iter().flatten().filter(|_| !args.json) {
            println!("{}", row.line());
        }
    });
    print(&report, args.json, || report.summary())?;
    Ok(if report.passed() { ExitCode::SUCCESS } else { ExitCode::from(CHECKS_FAILED) })
}
