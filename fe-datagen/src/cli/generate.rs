//! `generate`: solves a campaign into a dataset, or one slice of it.

use super::campaign_file::CampaignFile;
use super::signals::{self, REQUEUE};
use super::slice::SliceOption;
use super::{CHECKS_FAILED, print, wrong_usage};
use papilla_campaign::{RunOptions, generate};
use std::num::NonZero;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

/// Run a campaign of indentations, one per core, into a dataset.
///
/// Can be killed at any moment and started again: every indentation is one shard,
/// written whole or not at all, and the bytes depend on the campaign alone. A campaign
/// that asks for more `presses` than before takes over those that are solved. With
/// --slice, or as a task of a Slurm job array (SLURM_ARRAY_TASK_ID), solves its part only;
/// any number of them may share the folder, and `dataset merge` makes the dataset.
#[derive(clap::Args)]
#[command(
    after_help = "USR1 and TERM: store where each indentation stands at its next depth, and leave with exit code\n\
                  75, which asks to be started again; it goes on from there. A second TERM leaves at once.\n\
                  Examples: fe-datagen generate campaigns/broad-graded.toml --out out/broad\n          \
                  fe-datagen generate campaigns/broad-graded.toml --slice 3/100 --out /shared/broad\n          \
                  fe-datagen generate campaigns/final.toml --mesh medium-graded --out data/rungs/medium-graded"
)]
pub(super) struct Args {
    #[command(flatten)]
    campaign: CampaignFile,
    /// Folder of the dataset.
    #[arg(long)]
    out: PathBuf,
    #[command(flatten)]
    slice: SliceOption,
    /// Indentations solved at a time [default: one per core].
    #[arg(long)]
    threads: Option<NonZero<usize>>,
    /// Seconds after which to store where an indentation stands, against a lost node.
    #[arg(long, value_name = "SECONDS", default_value_t = 300)]
    checkpoint_s: u64,
    /// Print the report as JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let slice = match args.slice.slice() {
        Ok(slice) => slice,
        Err(error) => return Ok(wrong_usage(&error)),
    };
    let stop = signals::stop()?;
    let spec = args.campaign.read()?;
    // A task that its scheduler starts again has tried what failed.
    let again = std::env::var("SLURM_RESTART_COUNT").is_ok_and(|count| count != "0");
    let options = RunOptions {
        slice,
        threads: args.threads,
        retry_failed: !again,
        stop,
        checkpoint_every: Duration::from_secs(args.checkpoint_s),
        ..RunOptions::default()
    };
    let report = generate(&spec, &args.out, &options)?;
    print(&report, args.json, || report.human())?;
    Ok(match (report.slice.left, report.is_complete()) {
        (1.., _) => ExitCode::from(REQUEUE),
        (0, true) => ExitCode::SUCCESS,
        (0, false) => ExitCode::from(CHECKS_FAILED),
    })
}
