//! Solves campaigns on the meshes that they name.

use crate::{
    BoxError, CampaignError, CampaignReport, Checkpoints, IndentationSolver, PressError,
    RunOptions, SliceReport, merge, solve,
};
use papilla_dataset::{BALANCE_RELATIVE_MAX, Sample};
use papilla_fem::solve::{Options, Solver, StepReport};
use papilla_fingertip::campaign::{CampaignSpec, Candidate, Indentation};
use papilla_fingertip::indenter::IndenterError;
use papilla_fingertip::mesh::fingertip::Order;
use papilla_fingertip::simulation::balanced::{AtState, Stoppable};
use papilla_fingertip::simulation::body::{Body, SimulationError};
use papilla_fingertip::simulation::drive::Approach;
use papilla_fingertip::simulation::record::IncrementRecord;
use papilla_fingertip::simulation::{Simulation, maps, sample};
use serde::Serialize;
use std::path::Path;
use std::sync::Arc;

/// What a run says of itself.
#[derive(Clone, Debug, Serialize)]
pub struct Generated {
    /// Of its slice.
    pub slice: SliceReport,
    /// Of the dataset. Absent where others solve a part of it, or the run was asked to stop.
    pub dataset: Option<CampaignReport>,
}

impl Generated {
    /// Did every sample make it?
    pub fn is_complete(&self) -> bool {
        self.slice.is_complete() && self.dataset.as_ref().is_none_or(CampaignReport::is_complete)
    }

    /// For people.
    pub fn human(&self) -> String {
        let Self { slice, dataset } = self;
        format!("{slice}{}", dataset.as_ref().map_or(String::new(), ToString::to_string))
    }
}

/// Solves a slice of a campaign into `folder`, or goes on with it; and merges the dataset, if the
/// slice is the whole campaign and nothing is left.
///
/// # Errors
/// As [`solve`] and [`merge`].
pub fn generate(
    spec: &CampaignSpec,
    folder: &Path,
    options: &RunOptions,
) -> Result<Generated, CampaignError> {
    let slice = solved(spec, folder, options)?;
    let whole = options.slice.is_whole() && slice.left == 0;
    let dataset = whole.then(|| merge(spec, folder)).transpose()?;
    Ok(Generated { slice, dataset })
}

fn solved(
    spec: &CampaignSpec,
    folder: &Path,
    options: &RunOptions,
) -> Result<SliceReport, CampaignError> {
    spec.validate()?;
    let candidates = spec.candidates();
    let first = candidates.first().ok_or(CampaignError::Lacks("an indenter"))?;
    let shape = |of: &Candidate| {
        let built = of.indenter.build(&spec.folder).map_err(IndenterError::from);
        built.map_err(|error| CampaignError::Simulation(error.into()))
    };
    let shapes = candidates.iter().map(shape).collect::<Result<Vec<_>, _>>()?;
    for (candidate, shape) in candidates.iter().zip(&shapes) {
        for done in shape.mended() {
            tracing::warn!(indenter = candidate.name, "{done}");
        }
    }
    let Simulation { body, approach, .. } = Simulation::new(&spec.scene(first))?;
    let (atlas, _) = body
        .atlas()
        .ok_or(CampaignError::Lacks("an atlas patch"))?
        .map_err(|error| CampaignError::Simulation(error.into()))?;
    if spec.order == Order::Graded {
        let lattice = maps::lattice(&body);
        let solver = || Ok(OwnMesh { spec, candidates: &candidates });
        return solve(spec, (&atlas, lattice.as_deref()), solver, folder, options);
    }
    let approaches: Vec<_> = candidates
        .iter()
        .zip(shapes)
        .map(|(candidate, shape)| Approach {
            shape,
            top_mm: candidate.indenter.top_mm(),
            ..approach.clone()
        })
        .collect();
    let solver = || -> Result<OneMesh<'_>, BoxError> {
        let solver = body.solver(Options::default())?;
        Ok(OneMesh { body: &body, solver, approaches: &approaches })
    };
    solve(spec, (&atlas, None), solver, folder, options)
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
