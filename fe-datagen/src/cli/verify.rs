//! `verify`: compares the solver with closed forms, with published values and with itself.

use super::{CHECKS_FAILED, print};
use anyhow::Context;
use papilla_progress::Progress;
use papilla_validation::verify::{self, CASES, Row};
use std::path::PathBuf;
use std::process::ExitCode;

/// Check the solver: patch test, closed forms, benchmarks, balances, symmetry.
///
/// Prints one line a quantity: this code, the reference, where that comes
/// from, how far apart they are and how far they may be.
#[derive(clap::Args)]
#[command(
    after_help = "Exit code 3 if any row is past its tolerance. docs/reports/verification.md says what each case \
                        shows.\nExample: fe-datagen verify --only hertz --only cook"
)]
pub(super) struct Args {
    /// Run only this case; may be given several times.
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// Smaller meshes and indentations, without the cases that have no small form: for a test run.
    #[arg(long)]
    quick: bool,
    /// Also write the cases as Markdown to this file, and all rows beside it as .csv.
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
    /// Print the rows as JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let names: Vec<_> = CASES.iter().map(|c| c.name).collect();
    super::refuse_unknown(&args.only, &names)?;
    let wanted = |c: &verify::Case| {
        (c.quick || !args.quick) && (args.only.is_empty() || args.only.iter().any(|n| n == c.name))
    };
    let all = CASES.iter().filter(|c| wanted(c)).count();
    let progress = Progress::new("cases", all, 0, args.json);
    if !args.json {
        println!("{}", Row::heading());
    }
    let report = verify::run(args.quick, &wanted, &mut |case, rows| match rows {
        None => progress.set_message(case.name),
        Some(rows) => {
            progress.suspend(|| {
                for row in rows.iter().filter(|_| !args.json) {
                    println!("{}", row.line());
                }
            });
            progress.inc();
        }
    });
    drop(progress);
    if let Some(path) = &args.markdown {
        let table = path.with_extension("csv");
        for (path, text) in [(path, report.markdown()), (&table, report.csv())] {
            std::fs::write(path, text)
                .with_context(|| format!("cannot write {}", path.display()))?;
        }
    }
    print(&report, args.json, || report.summary())?;
    Ok(if report.passed() { ExitCode::SUCCESS } else { ExitCode::from(CHECKS_FAILED) })
}
