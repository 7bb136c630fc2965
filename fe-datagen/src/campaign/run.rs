//! Solving the indentations of a campaign in parallel.

use super::assemble::manifest;
use super::state::{IndentationState, Outcome, Workspace};
use super::{BoxError, CampaignError, CampaignReport};
use papilla_atlas::Atlas;
use papilla_dataset as dataset;
use papilla_dataset::{Sample, TriangleOnLattice};
use papilla_fingertip::campaign::{CampaignSpec, Indentation, indentations};
use papilla_output::atomic;
use papilla_progress::Progress;
use std::any::Any;
use std::num::NonZero;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

/// Solves one indentation after another; each worker thread has its own.
pub trait IndentationSolver {
    /// Indentations to each of the depths and returns one equilibrium per depth, with
    /// values at the vertices of the campaign's atlas. Equal indentations have to give
    /// equal records (`seconds` apart), whatever was solved before.
    ///
    /// # Errors
    /// What did not converge and where; it is recorded in the manifest.
    fn solve(&mut self, press: &Indentation) -> Result<Vec<Sample>, BoxError>;
}

/// How to run, as opposed to what.
#[derive(Clone, Debug)]
pub struct RunOptions {
    /// Indentations solved at a time; `None`: one per core.
    pub threads: Option<NonZero<usize>>,
    /// Show on standard error how far it is.
    pub progress: bool,
    /// Try indentations again that failed in an earlier run.
    pub retry_failed: bool,
}

impl Default for RunOptions {
    fn default() -> Self {
        Self { threads: None, progress: true, retry_failed: true }
    }
}

/// Runs a campaign, or goes on with one that was interrupted, and writes its
/// dataset into `folder`. `solver` builds one solver per worker thread, with
/// values on `atlas`, or on cells of a lattice on which its triangles lie.
///
/// # Errors
/// [`CampaignError`] when the campaign makes no sense, the folder belongs to
/// another one or is in use, no solver can be built, a file cannot be written,
/// or every indentation failed. Single failures are in the report and the manifest.
pub fn run<S: IndentationSolver>(
    spec: &CampaignSpec,
    (atlas, lattice): (&Atlas, Option<&[TriangleOnLattice]>),
    solver: impl Fn() -> Result<S, BoxError> + Sync,
    folder: &Path,
    options: &RunOptions,
) -> Result<CampaignReport, CampaignError> {
    let start = Instant::now();
    spec.validate()?;
    let workspace = Workspace::open(folder, spec, atlas)?;
    dataset::write_atlas(folder, atlas, lattice)?;
    let (mut done, mut todo) = (Vec::new(), Vec::new());
    for press in indentations(spec) {
        match workspace.load(&press) {
            Some(state) if !(options.retry_failed && is_failed(&state)) => done.push(state),
            _ => todo.push(press),
        }
    }
    let reused = done.len();
    let cores = options.threads.or_else(|| std::thread::available_parallelism().ok());
    let threads = cores.map_or(1, NonZero::get).min(todo.len().max(1));
    let progress = Progress::new("indentations", spec.presses, reused, !options.progress);
    let queue = Queue {
        vertex_count: atlas.vertex_count(),
        workspace: &workspace,
        todo: &todo,
        next: AtomicUsize::new(0),
        stop: AtomicBool::new(false),
        progress: &progress,
        results: Mutex::new(Vec::new()),
    };
    std::thread::scope(|scope| {
        for _ in 0..threads {
            // Room for the recursion of sparse factorizations; not touched if not needed.
            let builder = std::thread::Builder::new().stack_size(16 << 20);
            let spawned = builder.spawn_scoped(scope, || queue.work(&solver));
            if let Err(error) = spawned {
                queue.fail(CampaignError::Simulation(error.into()));
            }
        }
    });
    let results = queue.results;
    drop(progress);
    for result in results.into_inner().unwrap_or_else(|poison| poison.into_inner()) {
        done.push(result?);
    }
    done.sort_by_key(|state| state.press.id);
    let manifest = manifest(spec, atlas, &done)?;
    atomic::write_json(&workspace.folder().join("manifest.json"), &manifest)?;
    Ok(CampaignReport {
        name: spec.name.clone(),
        folder: folder.to_path_buf(),
        presses: spec.presses,
        solved: todo.len()
            - done.iter().filter(|s| is_failed(s) && is_in(&todo, s.press.id)).count(),
        reused,
        samples: manifest.presses.iter().map(|p| p.samples).sum(),
        samples_due: spec.samples(),
        failed: manifest.failed,
        dropped: manifest.dropped,
        pressure_max_pa: manifest.pressure_max_pa,
        sed_max_j_per_m3: manifest.sed_max_j_per_m3,
        dataset_sha256: manifest.dataset_sha256,
        threads,
        seconds: start.elapsed().as_secs_f64(),
        solver_seconds: done.iter().map(|s| s.seconds).sum(),
    })
}

fn is_failed(state: &IndentationState) -> bool {
    matches!(state.outcome, Outcome::Failed { .. })
}

fn is_in(todo: &[Indentation], id: usize) -> bool {
    todo.binary_search_by_key(&id, |press| press.id).is_ok()
}

/// The indentations still to be solved, shared by the workers.
struct Queue<'a> {
    vertex_count: usize,
    workspace: &'a Workspace,
    todo: &'a [Indentation],
    next: AtomicUsize,
    stop: AtomicBool,
    progress: &'a Progress,
    results: Mutex<Vec<Result<IndentationState, CampaignError>>>,
}

impl Queue<'_> {
    /// One worker: takes the next indentation until none is left or one worker met
    /// an error that stops all.
    fn work<S: IndentationSolver>(&self, build: &(impl Fn() -> Result<S, BoxError> + Sync)) {
        let mut solver = None;
        while !self.stop.load(Ordering::Relaxed) {
            let Some(press) = self.todo.get(self.next.fetch_add(1, Ordering::Relaxed)) else {
                return;
            };
            match self.press(press, &mut solver, build) {
                Ok(state) => self.push(Ok(state)),
                Err(error) => self.fail(error),
            }
            self.progress.inc();
        }
    }

    /// Keeps an error that ends the campaign and lets the workers stop.
    fn fail(&self, error: CampaignError) {
        self.stop.store(true, Ordering::Relaxed);
        self.push(Err(error));
    }

    fn push(&self, result: Result<IndentationState, CampaignError>) {
        self.results.lock().unwrap_or_else(|poison| poison.into_inner()).push(result);
    }

    fn press<S: IndentationSolver>(
        &self,
        press: &Indentation,
        solver: &mut Option<S>,
        build: &(impl Fn() -> Result<S, BoxError> + Sync),
    ) -> Result<IndentationState, CampaignError> {
        let mut ready = match solver.take() {
            Some(ready) => ready,
            None => build().map_err(CampaignError::Simulation)?,
        };
        let start = Instant::now();
        let id = press.id;
        // One bad indentation must not cost the others; a solver that panicked may be
        // in any state and is not used again.
        let solved = match catch_unwind(AssertUnwindSafe(|| ready.solve(press))) {
            Ok(solved) => {
                *solver = Some(ready);
                solved.map_err(|e| chain(e.as_ref()))
            }
            Err(panic) => Err(format!("the solver panicked: {}", panic_text(panic.as_ref()))),
        };
        let seconds = start.elapsed().as_secs_f64();
        let (outcome, shard) = match solved.and_then(|records| complete(press, records)) {
            Ok(records) => self.encode(&records)?,
            Err(error) => (Outcome::Failed { error }, None),
        };
        match &outcome {
            Outcome::Failed { error } => {
                tracing::warn!(press = id, seconds, error, "indentation failed");
                self.progress.suspend(|| eprintln!("indentation {id} failed: {error}"));
            }
            Outcome::Solved { samples, .. } => {
                tracing::info!(press = id, seconds, samples, "indentation solved");
            }
        }
        let state = IndentationState { press: press.clone(), seconds, outcome };
        self.workspace.store(&state, shard.as_deref())?;
        Ok(state)
    }

    fn encode(&self, records: &[Sample]) -> Result<(Outcome, Option<Vec<u8>>), CampaignError> {
        let finite = |(depth, reason): (f64, String)| (depth.is_finite().then_some(depth), reason);
        Ok(match dataset::encode(records, self.vertex_count)? {
            Ok(encoded) => {
                let outcome = Outcome::Solved {
                    sha256: dataset::sha256_hex(&encoded.bytes),
                    samples: encoded.samples,
                    checks: encoded.checks,
                    pressure_max_pa: encoded.pressure_max_pa,
                    sed_max_j_per_m3: encoded.sed_max_j_per_m3,
                    dropped: encoded.dropped.into_iter().map(finite).collect(),
                };
                (outcome, Some(encoded.bytes))
            }
            Err(dropped) => {
                let list: Vec<String> =
                    dropped.iter().map(|(depth, reason)| format!("{depth} mm: {reason}")).collect();
                let error = format!("no sample passed its checks ({})", list.join("; "));
                (Outcome::Failed { error }, None)
            }
        })
    }
}

/// Each depth has to have its record, in order.
fn complete(press: &Indentation, records: Vec<Sample>) -> Result<Vec<Sample>, String> {
    let due = &press.depths_mm;
    // A depth that is no number is left to the sample's own checks.
    let fit = |r: &Sample, d: &f64| r.depth_mm.is_nan() || (r.depth_mm - d).abs() <= 1e-9;
    let fits = records.len() == due.len() && records.iter().zip(due).all(|(r, d)| fit(r, d));
    let found: Vec<f64> = records.iter().map(|r| r.depth_mm).collect();
    let message = || format!("the solver returned depths {found:?} mm where {due:?} are due");
    if fits { Ok(records) } else { Err(message()) }
}

/// An error's text with those of its causes.
fn chain(error: &(dyn std::error::Error + 'static)) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(inner) = cause {
        text.push_str(": ");
        text.push_str(&inner.to_string());
        cause = inner.source();
    }
    text
}

fn panic_text(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no message")
}
