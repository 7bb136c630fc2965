//! Solves the simulations of a slice in parallel.

use crate::beat::{Beat, Ended};
use crate::queue::{Queue, Settled, settled};
use crate::state::{Found, Workspace};
use crate::{BoxError, CampaignError, IndentationSolver, RunOptions, SliceReport};
use papilla_atlas::Atlas;
use papilla_dataset as dataset;
use papilla_dataset::TriangleOnLattice;
use papilla_fingertip::campaign::{CampaignSpec, indentations_in};
use papilla_progress::{Progress, clock};
use std::num::NonZero;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize};
use std::time::Instant;

/// Solves a slice of a campaign into `folder`, which many slices may share, or goes on with it;
/// [`merge`](crate::merge) makes the dataset. `solver` builds one solver per worker thread, with
/// values on `atlas`, or on cells of a lattice on which its triangles lie.
///
/// # Errors
/// [`CampaignError`] when the campaign makes no sense, the folder belongs to
/// another one, no solver can be built or a file cannot be written. Single failures are in the
/// report.
pub fn solve<S: IndentationSolver>(
    spec: &CampaignSpec,
    (atlas, lattice): (&Atlas, Option<&[TriangleOnLattice]>),
    solver: impl Fn() -> Result<S, BoxError> + Sync,
    folder: &Path,
    options: &RunOptions,
) -> Result<SliceReport, CampaignError> {
    let start = Instant::now();
    spec.validate()?;
    let workspace = Workspace::open(folder, spec, atlas)?;
    dataset::write_atlas(folder, atlas, lattice)?;
    let (mut known, mut todo) = (Vec::new(), Vec::new());
    let planned = indentations_in(spec, options.slice.range(spec.presses));
    for press in &planned {
        let found = workspace.load(press);
        if let Found::Untrusted(why) = &found {
            eprintln!("indentation {} is solved again: {why}", press.id);
        }
        match settled(found, options.retry_failed) {
            Some(state) => known.push(state),
            None => todo.push(press),
        }
    }
    let reused = known.len();
    options.count.begin(planned.len(), &known);
    let cores = options.threads.or_else(|| std::thread::available_parallelism().ok());
    let threads = cores.map_or(1, NonZero::get).min(todo.len().max(1));
    let progress = Progress::new("indentations", reused + todo.len(), reused, !options.progress);
    let queue = Queue {
        vertex_count: atlas.vertex_count(),
        workspace: &workspace,
        todo: &todo,
        next: AtomicUsize::new(0),
        halt: AtomicBool::new(false),
        options,
        progress: &progress,
        results: Mutex::new(Vec::new()),
    };
    let mut beat = Beat::new(options.slice);
    if let Some((other, heard)) = beat.other(folder) {
        eprintln!(
            "warning: process {} on {} works on slice {} too, heard of {} ago: what both solve is \
             solved twice, to the same bytes",
            other.process,
            other.node,
            other.slice,
            clock(heard)
        );
    }
    queue.run(threads, &solver, &mut beat);
    let results = queue.results.into_inner().unwrap_or_else(|poison| poison.into_inner());
    drop(progress);
    let (mut solved, mut taken) = (Vec::new(), Vec::new());
    for result in results {
        match result {
            Ok(Settled::Now(state)) => solved.push(state),
            Ok(Settled::Elsewhere(state)) => taken.push(state),
            Ok(Settled::Not) => {}
            Err(error) => {
                beat.end(folder, Ended::Error);
                return Err(error);
            }
        }
    }
    let left = todo.len() - solved.len() - taken.len();
    beat.end(folder, if left == 0 { Ended::Done } else { Ended::Stopped });
    known.extend(taken);
    let seconds = start.elapsed().as_secs_f64();
    Ok(SliceReport::new(spec, folder, options.slice, (&known, &solved, left), threads, seconds))
}
