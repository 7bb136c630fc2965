//! `generate`: a campaign of indentations into a dataset.

use super::{CHECKS_FAILED, print};
use crate::campaign::{self, BoxError, IndentationSolver, RunOptions};
use anyhow::Context as _;
use papilla_dataset::{BALANCE_RELATIVE_MAX, Sample};
use papilla_fem::solve::{Options, Solver};
use papilla_fingertip::campaign::{CampaignSpec, Indentation};
use papilla_fingertip::indenter::IndenterError;
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::body::Body;
use papilla_fingertip::simulation::drive::{Approach, Drive};
use papilla_validation::acceptance;
use std::num::NonZero;
use std::path::PathBuf;
use std::process::ExitCode;

/// Run a campaign of indentations, one per core, into a dataset.
///
/// Can be killed at any moment and started again: every indentation is one shard,
/// written whole or not at all, and the bytes depend on the campaign alone.
#[derive(clap::Args)]
#[command(after_help = "Example: fe-datagen generate campaigns/s1.toml --out out/s1")]
pub(super) struct Args {
    /// Campaign file (see campaigns/ and docs/reference/dataset.md).
    campaign: PathBuf,
    /// Folder of the dataset.
    #[arg(long)]
    out: PathBuf,
    /// Indentations solved at a time [default: one per core].
    #[arg(long)]
    threads: Option<NonZero<usize>>,
    /// Print the report as JSON.
    #[arg(long)]
    json: bool,
}

struct BodySolver<'a> {
    body: &'a Body,
    solver: Solver<'a>,
    approaches: &'a [Approach],
}

impl IndentationSolver for BodySolver<'_> {
    fn solve(&mut self, indentation: &Indentation) -> Result<Vec<Sample>, BoxError> {
        let approach = Approach {
            pose: indentation.pose,
            offset_mm: indentation.offset_mm,
            ..self.approaches[indentation.candidate].clone()
        };
        let drive = Drive::Depths(indentation.depths_mm.clone());
        let found = self.body.press_balanced(
            &mut self.solver,
            &approach,
            &drive,
            BALANCE_RELATIVE_MAX,
            &mut |_, _, record, _| acceptance::sample(record),
        );
        found.pressed?;
        Ok(found.kept)
    }
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let spec = CampaignSpec::read(&args.campaign)?;
    let candidates = spec.candidates();
    let first = candidates.first().context("a campaign has an indenter")?;
    let Simulation { body, approach, .. } = Simulation::new(&spec.scene(first))?;
    let (atlas, _) = body.atlas().context("a fingertip has an atlas patch")??;
    let options = RunOptions { threads: args.threads, ..RunOptions::default() };
    let mut approaches = Vec::new();
    for candidate in &candidates {
        approaches.push(Approach {
            shape: candidate.indenter.build(&spec.folder).map_err(IndenterError::from)?,
            top_mm: candidate.indenter.top_mm(),
            ..approach.clone()
        });
    }
    let solver = || -> Result<BodySolver<'_>, BoxError> {
        let solver = body.solver(Options::default())?;
        Ok(BodySolver { body: &body, solver, approaches: &approaches })
    };
    let report = campaign::run(&spec, &atlas, solver, &args.out, &options)?;
    print(&report, args.json, || report.to_string())?;
    Ok(if report.is_complete() { ExitCode::SUCCESS } else { ExitCode::from(CHECKS_FAILED) })
}
