//! `stability`: a suite of hard cases with names, and thousands of random scenes.

use super::slice::SliceOption;
use super::{CHECKS_FAILED, choices, print, wrong_usage};
use anyhow::Context as _;
use papilla_fingertip::campaign::CampaignSpec;
use papilla_output::atomic;
use papilla_progress::Progress;
use papilla_validation::stability::scenes::{self, ScenesOptions, Watch};
use papilla_validation::stability::{self, CASES, Extent};
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::OnceLock;

/// Run the hard cases: each converges to a right answer or is refused with a typed error.
///
/// Prints one line a variant: how it ended, how hard it was (iterations, cuts, smallest J,
/// condition, balances) and the check that came nearest to its tolerance. With --scenes,
/// solves random scenes of a campaign's distribution instead; with --slice a part of them, which
/// the same command without it takes over.
#[derive(clap::Args)]
#[command(
    after_help = "Exit code 3 if any case breaks its promise. docs/reports/stability.md is the report.\n\
                  Examples: fe-datagen stability --case snap-through\n          \
                  fe-datagen stability --scenes 10000 --seed 5 --threads 2 --out data/scenes"
)]
pub(super) struct Args {
    /// Run only this case; may be given several times.
    #[arg(long = "case", value_name = "NAME")]
    cases: Vec<String>,
    /// List the cases with their promises.
    #[arg(long)]
    list: bool,
    /// Only the cheapest variants of each case, as `./test` runs them.
    #[arg(long)]
    quick: bool,
    /// Finer meshes and more problems.
    #[arg(long, conflicts_with = "quick")]
    long: bool,
    /// Print the lines as JSON.
    #[arg(long)]
    json: bool,
    /// Write stability.md, .csv and .json into this folder; with --scenes the scenes'
    /// record, by which a later run goes on.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Also write the report as Markdown to this file, and all variants beside it as .csv.
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
    /// Press this many random scenes of --campaign, to their deepest state.
    #[arg(long, value_name = "N", requires = "out")]
    scenes: Option<NonZero<usize>>,
    #[command(flatten)]
    slice: SliceOption,
    /// Seed of the random scenes.
    #[arg(long, default_value_t = 5)]
    seed: u64,
    /// Mesh of the random scenes.
    #[arg(long, value_enum, default_value_t = choices::Density::Coarse)]
    density: choices::Density,
    /// Scenes solved at a time.
    #[arg(long, default_value = "1")]
    threads: NonZero<usize>,
    /// Campaign whose distribution the scenes are drawn from.
    #[arg(long, value_name = "FILE", default_value = "campaigns/broad.toml")]
    campaign: PathBuf,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    if let Some(folder) = &args.out {
        atomic::create_folder(folder)?;
    }
    if args.list {
        for case in CASES {
            println!("{:<18} {}", case.name, case.promise);
        }
        return Ok(ExitCode::SUCCESS);
    }
    match (args.scenes, &args.out) {
        (Some(count), Some(out)) => {
            let slice = match args.slice.slice() {
                Ok(slice) => slice,
                Err(error) => return Ok(wrong_usage(&error)),
            };
            let spec = CampaignSpec::read(&args.campaign)?;
            let options = ScenesOptions {
                count,
                seed: args.seed,
                density: args.density.into(),
                threads: args.threads,
                slice,
            };
            let progress = OnceLock::new();
            let due = slice.range(count.get()).len();
            let begun = |reused| {
                progress.get_or_init(|| Progress::new("scenes", due, reused, args.json));
            };
            let solved = || progress.get().into_iter().for_each(Progress::inc);
            let told = Watch { begun: &begun, solved: &solved };
            let report = scenes::run(&spec, out, &options, told)?;
            drop(progress);
            if let Some(path) = &args.markdown {
                write(path, &report.markdown())?;
            }
            print(&report, args.json, || report.to_string())?;
            Ok(if report.passed() { ExitCode::SUCCESS } else { ExitCode::from(CHECKS_FAILED) })
        }
        _ if args.slice.is_given() => {
            eprintln!("error: --slice is a part of --scenes");
            Ok(ExitCode::from(2))
        }
        _ => suite(args),
    }
}

fn suite(args: &Args) -> anyhow::Result<ExitCode> {
    let names: Vec<_> = CASES.iter().map(|c| c.name).collect();
    super::refuse_unknown(&args.cases, &names)?;
    let wanted =
        |c: &stability::Case| args.cases.is_empty() || args.cases.iter().any(|n| n == c.name);
    let extent = match (args.quick, args.long) {
        (true, _) => Extent::Quick,
        (_, true) => Extent::Long,
        _ => Extent::Usual,
    };
    let all = CASES.iter().filter(|c| wanted(c)).count();
    let progress = Progress::new("cases", all, 0, args.json);
    let report = stability::run(extent, &wanted, &mut |case, lines| {
        let Some(lines) = lines else { return progress.set_message(case.name) };
        progress.suspend(|| {
            for line in lines.iter().filter(|_| !args.json) {
                println!("{}", line.text());
            }
        });
        progress.inc();
    });
    drop(progress);
    if let Some(folder) = &args.out {
        atomic::create_folder(folder)?;
        atomic::write_json(&folder.join("stability.json"), &report)?;
        write(&folder.join("stability.md"), &report.markdown())?;
        write(&folder.join("stability.csv"), &report.csv())?;
    }
    if let Some(path) = &args.markdown {
        write(path, &report.markdown())?;
        write(&path.with_extension("csv"), &report.csv())?;
    }
    print(&report, args.json, || report.summary())?;
    Ok(if report.passed() { ExitCode::SUCCESS } else { ExitCode::from(CHECKS_FAILED) })
}

fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    std::fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))
}
