//! `generate`: a campaign of presses into a dataset.

use super::{CHECKS_FAILED, print};
use crate::campaign::{self, BoxError, CampaignSpec, PressSolver, RunOptions};
use crate::dataset::BALANCE_RELATIVE_MAX;
use crate::press::body::Body;
use crate::press::drive::{Approach, Drive};
use crate::press::record::{IncrementRecord, Pose};
use crate::solve::{Options, Solver, StepReport};
use anyhow::Context as _;
use std::num::NonZero;
use std::path::PathBuf;
use std::process::ExitCode;

/// Run a campaign of presses, one per core, into a dataset.
///
/// Can be killed at any moment and started again: every press is one shard,
/// written whole or not at all, and the bytes depend on the campaign alone.
#[derive(clap::Args)]
#[command(after_help = "Example: fe-datagen generate campaigns/s1.toml --out out/s1")]
pub(super) struct Args {
    /// Campaign file (see campaigns/ and docs/dataset.md).
    campaign: PathBuf,
    /// Folder of the dataset.
    #[arg(long)]
    out: PathBuf,
    /// Presses solved at a time [default: one per core].
    #[arg(long)]
    threads: Option<NonZero<usize>>,
    /// Print the report as JSON.
    #[arg(long)]
    json: bool,
}

struct PlateSolver<'a> {
    finger: &'a Body,
    solver: Solver<'a>,
    plate: Approach,
}

impl PressSolver for PlateSolver<'_> {
    fn solve(&mut self, pose: Pose, depths_mm: &[f64]) -> Result<Vec<IncrementRecord>, BoxError> {
        let mut records = Vec::with_capacity(depths_mm.len());
        // The states are the same on a finer path; the work integral, which is
        // one of their checks, is better.
        for refinement in [1, 2, 4] {
            records.clear();
            let mut keep =
                |_: &Solver<'_>, r: &IncrementRecord, _: &StepReport| records.push(r.clone());
            let approach = Approach { pose, ..self.plate.clone() };
            let drive = Drive::Depths(depths_mm.to_vec());
            self.finger.press(&mut self.solver, &approach, &drive, refinement, &mut keep)?;
            if records.iter().all(|r| r.checks.energy_vs_work <= BALANCE_RELATIVE_MAX) {
                break;
            }
        }
        Ok(records)
    }
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let spec = CampaignSpec::read(&args.campaign)?;
    let finger = Body::usual(spec.density)?;
    let (atlas, _) = finger.atlas().context("a fingertip has an atlas patch")??;
    let options = RunOptions { threads: args.threads, ..RunOptions::default() };
    let folder = args.campaign.parent().unwrap_or(std::path::Path::new(""));
    let plate = Approach {
        shape: spec.indenter.build(folder)?,
        top_mm: spec.indenter.top_mm(),
        ..Approach::plate(Pose::default())
    };
    let solver = || -> Result<PlateSolver<'_>, BoxError> {
        let solver = finger.solver(Options::default())?;
        Ok(PlateSolver { finger: &finger, solver, plate: plate.clone() })
    };
    let report = campaign::run(&spec, &atlas, solver, &args.out, &options)?;
    print(&report, args.json, || report.to_string())?;
    Ok(if report.is_complete() { ExitCode::SUCCESS } else { ExitCode::from(CHECKS_FAILED) })
}
