//! `generate`: solves a campaign into a dataset, or one slice of it.

use super::campaign_file::CampaignFile;
use super::part::Part;
use super::signals::{self, REQUEUE};
use super::{CHECKS_FAILED, print, wrong_usage};
use crate::campaign::{
    self, BoxError, CampaignReport, Checkpoints, IndentationSolver, PressError, RunOptions,
    SliceReport,
};
use anyhow::Context as _;
use papilla_dataset::{BALANCE_RELATIVE_MAX, Sample};
use papilla_fem::solve::{Options, Solver, StepReport};
use papilla_fingertip::campaign::{CampaignSpec, Candidate, Indentation};
use papilla_fingertip::indenter::IndenterError;
use papilla_fingertip::mesh::fingertip::Order;
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::balanced::{AtState, Stoppable};
use papilla_fingertip::simulation::body::{Body, SimulationError};
use papilla_fingertip::simulation::drive::Approach;
use papilla_fingertip::simulation::record::IncrementRecord;
use papilla_fingertip::simulation::{maps, sample};
use serde::Serialize;
use std::num::NonZero;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
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
    part: Part,
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

/// What a run says of itself.
#[derive(Serialize)]
struct Report {
    slice: SliceReport,
    /// Absent where others solve a part of it.
    dataset: Option<CampaignReport>,
}

/// Solves on one mesh, whatever presses.
struct OneMesh<'a> {
    body: &'a Body,
    solver: Solver<'a>,
    approaches: &'a [Approach],
}

impl IndentationSolver for OneMesh<'_> {
    fn solve(
        &mut self,
        indentation: &Indentation,
        checkpoints: &mut Checkpoints<'_>,
    ) -> Result<Vec<Sample>, PressError> {
        let approach = Approach {
            pose: indentation.pose,
            offset_mm: indentation.offset_mm,
            ..self.approaches[indentation.candidate].clone()
        };
        pressed(self.body, &mut self.solver, &approach, indentation, checkpoints)
    }
}

/// Solves each on a mesh of its own, whose cells are split under the indenter.
struct OwnMesh<'a> {
    spec: &'a CampaignSpec,
    candidates: &'a [Candidate],
}

impl IndentationSolver for OwnMesh<'_> {
    fn solve(
        &mut self,
        indentation: &Indentation,
        checkpoints: &mut Checkpoints<'_>,
    ) -> Result<Vec<Sample>, PressError> {
        let mut scene = self.spec.scene(&self.candidates[indentation.candidate]);
        scene.motion = indentation.motion();
        let Simulation { mut body, approach, .. } = Simulation::new(&scene)?;
        let no_patch = || PressError::Failed("a fingertip has a patch".into());
        let cells = maps::read_at_cells(&mut body).ok_or_else(no_patch)?;
        let mut solver = body.solver(Options::default())?;
        let found = pressed(&body, &mut solver, &approach, indentation, checkpoints)?;
        let on_cells = |sample| Sample { cells: Some(Arc::clone(&cells)), ..sample };
        Ok(found.into_iter().map(on_cells).collect())
    }
}

fn pressed(
    body: &Body,
    solver: &mut Solver<'_>,
    approach: &Approach,
    indentation: &Indentation,
    checkpoints: &mut Checkpoints<'_>,
) -> Result<Vec<Sample>, PressError> {
    let states: Vec<_> = indentation.states().collect();
    let keep = &mut |state: usize, _: &Solver<'_>, record: &IncrementRecord, _: &StepReport| {
        let slide_mm = states.get(state).map_or([0.0; 2], |(_, slide_mm)| *slide_mm);
        Sample { slide_mm, ..sample::of(record) }
    };
    let drive = indentation.drive();
    let mut from = checkpoints.stored();
    loop {
        let at_state =
            &mut |at: &AtState<'_, Sample>| checkpoints.at_state(at.states(), || at.standing());
        let stoppable = Stoppable { from: from.take(), at_state };
        let balance = BALANCE_RELATIVE_MAX;
        let found = body.press_stoppable(solver, approach, &drive, balance, keep, stoppable);
        return match found.pressed {
            Ok(()) => Ok(found.kept),
            Err(SimulationError::Halted) => Err(checkpoints.interrupted()),
            Err(SimulationError::Snapshot(error)) => {
                tracing::warn!(press = indentation.id, %error, "solved from its beginning");
                continue;
            }
            Err(error) => Err(error.into()),
        };
    }
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let slice = match args.part.slice() {
        Ok(slice) => slice,
        Err(error) => return Ok(wrong_usage(&error)),
    };
    let stop = signals::stop()?;
    let spec = args.campaign.read()?;
    let candidates = spec.candidates();
    let first = candidates.first().context("a campaign has an indenter")?;
    let Simulation { body, approach, .. } = Simulation::new(&spec.scene(first))?;
    let (atlas, _) = body.atlas().context("a fingertip has an atlas patch")??;
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
    let solved = if spec.order == Order::Graded {
        let lattice = maps::lattice(&body);
        let solver = || Ok(OwnMesh { spec: &spec, candidates: &candidates });
        campaign::solve(&spec, (&atlas, lattice.as_deref()), solver, &args.out, &options)?
    } else {
        let mut approaches = Vec::new();
        for candidate in &candidates {
            approaches.push(Approach {
                shape: candidate.indenter.build(&spec.folder).map_err(IndenterError::from)?,
                top_mm: candidate.indenter.top_mm(),
                ..approach.clone()
            });
        }
        let solver = || -> Result<OneMesh<'_>, BoxError> {
            let solver = body.solver(Options::default())?;
            Ok(OneMesh { body: &body, solver, approaches: &approaches })
        };
        campaign::solve(&spec, (&atlas, None), solver, &args.out, &options)?
    };
    let whole = slice.is_whole() && solved.left == 0;
    let dataset = whole.then(|| campaign::merge(&spec, &args.out)).transpose()?;
    let report = Report { slice: solved, dataset };
    let Report { slice, dataset } = &report;
    let human =
        || format!("{slice}{}", dataset.as_ref().map_or(String::new(), ToString::to_string));
    print(&report, args.json, human)?;
    let complete = slice.is_complete() && dataset.as_ref().is_none_or(CampaignReport::is_complete);
    Ok(match (slice.left, complete) {
        (1.., _) => ExitCode::from(REQUEUE),
        (0, true) => ExitCode::SUCCESS,
        (0, false) => ExitCode::from(CHECKS_FAILED),
    })
}
