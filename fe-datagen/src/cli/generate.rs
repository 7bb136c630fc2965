//! `generate`: a campaign of indentations into a dataset.

use super::{CHECKS_FAILED, print};
use crate::campaign::{self, BoxError, IndentationSolver, RunOptions};
use anyhow::Context as _;
use papilla_dataset::{BALANCE_RELATIVE_MAX, Cells, Sample, TriangleOnLattice};
use papilla_fem::solve::{Options, Solver, StepReport};
use papilla_fingertip::campaign::{CampaignSpec, Candidate, Indentation};
use papilla_fingertip::indenter::IndenterError;
use papilla_fingertip::mesh::fingertip::{Leaf, Order, Vertices};
use papilla_fingertip::scene::Motion;
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::body::Body;
use papilla_fingertip::simulation::drive::{Approach, Drive};
use papilla_fingertip::simulation::record::IncrementRecord;
use papilla_validation::acceptance;
use std::num::NonZero;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

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

/// Solves on one mesh, whatever presses.
struct OneMesh<'a> {
    body: &'a Body,
    solver: Solver<'a>,
    approaches: &'a [Approach],
}

impl IndentationSolver for OneMesh<'_> {
    fn solve(&mut self, indentation: &Indentation) -> Result<Vec<Sample>, BoxError> {
        let approach = Approach {
            pose: indentation.pose,
            offset_mm: indentation.offset_mm,
            ..self.approaches[indentation.candidate].clone()
        };
        pressed(self.body, &mut self.solver, &approach, indentation, None)
    }
}

/// Solves each on a mesh of its own, whose cells are split under the indenter.
struct OwnMesh<'a> {
    spec: &'a CampaignSpec,
    candidates: &'a [Candidate],
}

impl IndentationSolver for OwnMesh<'_> {
    fn solve(&mut self, indentation: &Indentation) -> Result<Vec<Sample>, BoxError> {
        let deepest_mm = indentation.depths_mm.last().copied().unwrap_or_default();
        let mut scene = self.spec.scene(&self.candidates[indentation.candidate]);
        scene.motion = Motion {
            offset_mm: indentation.offset_mm,
            ..Motion::to_depth(deepest_mm, 1, indentation.pose)
        };
        let Simulation { mut body, approach, .. } = Simulation::new(&scene)?;
        let vertices = body.read_on_cells().ok_or("a fingertip has a patch")?;
        let cells = Arc::new(cells(&vertices));
        pressed(&body, &mut body.solver(Options::default())?, &approach, indentation, Some(&cells))
    }
}

fn cells(vertices: &Vertices) -> Cells {
    let place = |(leaf, _): &(Leaf, [u32; 9])| {
        let ([row, column], [rows, columns]) = (leaf.first, leaf.size);
        [leaf.side as u32, row, column, rows, columns]
    };
    Cells {
        place: vertices.cells.iter().map(place).collect(),
        nodes: vertices.cells.iter().map(|(_, nodes)| *nodes).collect(),
    }
}

fn pressed(
    body: &Body,
    solver: &mut Solver<'_>,
    approach: &Approach,
    indentation: &Indentation,
    cells: Option<&Arc<Cells>>,
) -> Result<Vec<Sample>, BoxError> {
    let keep = &mut |_, _: &Solver<'_>, record: &IncrementRecord, _: &StepReport| Sample {
        cells: cells.cloned(),
        ..acceptance::sample(record)
    };
    let drive = Drive::Depths(indentation.depths_mm.clone());
    let found = body.press_balanced(solver, approach, &drive, BALANCE_RELATIVE_MAX, keep);
    found.pressed?;
    Ok(found.kept)
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let spec = CampaignSpec::read(&args.campaign)?;
    let candidates = spec.candidates();
    let first = candidates.first().context("a campaign has an indenter")?;
    let Simulation { body, approach, .. } = Simulation::new(&spec.scene(first))?;
    let (atlas, _) = body.atlas().context("a fingertip has an atlas patch")??;
    let options = RunOptions { threads: args.threads, ..RunOptions::default() };
    let report = if spec.order == Order::Graded {
        let vertices = body.patch.as_ref().and_then(|p| p.patch.vertices.as_ref());
        let corners = vertices.map_or(&[][..], |v| &v.corners).iter();
        let on = |&(side, place): &_| TriangleOnLattice { side: side as u32, place };
        let lattice: Vec<TriangleOnLattice> = corners.map(on).collect();
        let solver = || Ok(OwnMesh { spec: &spec, candidates: &candidates });
        campaign::run(&spec, (&atlas, Some(&lattice)), solver, &args.out, &options)?
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
        campaign::run(&spec, (&atlas, None), solver, &args.out, &options)?
    };
    print(&report, args.json, || report.to_string())?;
    Ok(if report.is_complete() { ExitCode::SUCCESS } else { ExitCode::from(CHECKS_FAILED) })
}
