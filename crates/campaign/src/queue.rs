//! Worker threads that take one indentation after another.

use crate::beat::{Beat, Event, Running};
use crate::state::{Found, IndentationState, Outcome, Workspace};
use crate::{BoxError, CampaignError, Checkpoints, IndentationSolver, PressError, RunOptions};
use papilla_dataset as dataset;
use papilla_dataset::Sample;
use papilla_fingertip::campaign::Indentation;
use papilla_processor::thread_s;
use papilla_progress::Progress;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::time::Instant;

/// What need not be solved any more.
pub(crate) fn settled(found: Found, retry_failed: bool) -> Option<IndentationState> {
    match found {
        Found::Vouched(state) => (!(retry_failed && state.is_failed())).then_some(*state),
        Found::Absent | Found::Untrusted(_) => None,
    }
}

/// What a worker made of an indentation.
pub(crate) enum Settled {
    Now(IndentationState),
    /// Another process was quicker.
    Elsewhere(IndentationState),
    /// It was asked to stop.
    Not,
}

/// The indentations still to be solved, shared by the workers.
pub(crate) struct Queue<'a> {
    pub vertex_count: usize,
    pub workspace: &'a Workspace,
    pub todo: &'a [&'a Indentation],
    pub next: AtomicUsize,
    /// An error ends it for all.
    pub halt: AtomicBool,
    pub options: &'a RunOptions,
    pub progress: &'a Progress,
    pub results: Mutex<Vec<Result<Settled, CampaignError>>>,
}

impl Queue<'_> {
    pub(crate) fn run<S: IndentationSolver>(
        &self,
        threads: usize,
        build: &(impl Fn() -> Result<S, BoxError> + Sync),
        beat: &mut Beat,
    ) {
        std::thread::scope(|scope| {
            let (sender, events) = channel();
            for _ in 0..threads {
                let sender = sender.clone();
                // Room for the recursion of sparse factorizations; not touched if not needed.
                let builder = std::thread::Builder::new().stack_size(16 << 20);
                let spawned = builder.spawn_scoped(scope, move || self.work(build, &sender));
                if let Err(error) = spawned {
                    self.fail(CampaignError::Simulation(error.into()));
                }
            }
            drop(sender);
            beat.follow(self.workspace.folder(), &events);
        });
    }

    /// One worker: takes the next indentation until none is left, it is asked to stop, or one
    /// worker met an error that stops all.
    fn work<S: IndentationSolver>(
        &self,
        build: &(impl Fn() -> Result<S, BoxError> + Sync),
        events: &Sender<Event>,
    ) {
        let mut solver = None;
        let is_over =
            || self.halt.load(Ordering::Relaxed) || self.options.stop.load(Ordering::Relaxed);
        while !is_over() {
            let Some(press) = self.todo.get(self.next.fetch_add(1, Ordering::Relaxed)) else {
                return;
            };
            // A slice of another division may have it by now.
            let elsewhere = settled(self.workspace.load(press), self.options.retry_failed);
            match elsewhere.map_or_else(
                || self.press(press, &mut solver, build, events),
                |state| Ok(Settled::Elsewhere(state)),
            ) {
                Ok(settled) => {
                    if let Settled::Now(state) | Settled::Elsewhere(state) = &settled {
                        self.options.count.settle(state);
                    }
                    self.push(Ok(settled));
                }
                Err(error) => self.fail(error),
            }
            // Who listens ends after this.
            let _ = events.send(Event::Done(press.id));
            self.progress.inc();
        }
    }

    /// Keeps an error that ends the campaign and lets the workers stop.
    fn fail(&self, error: CampaignError) {
        self.halt.store(true, Ordering::Relaxed);
        self.push(Err(error));
    }

    fn push(&self, result: Result<Settled, CampaignError>) {
        self.results.lock().unwrap_or_else(|poison| poison.into_inner()).push(result);
    }

    fn press<S: IndentationSolver>(
        &self,
        press: &Indentation,
        solver: &mut Option<S>,
        build: &(impl Fn() -> Result<S, BoxError> + Sync),
        events: &Sender<Event>,
    ) -> Result<Settled, CampaignError> {
        let mut ready = match solver.take() {
            Some(ready) => ready,
            None => build().map_err(CampaignError::Simulation)?,
        };
        let (start, processor_start_s) = (Instant::now(), thread_s());
        let id = press.id;
        let states_due = press.states().count();
        let reached = |states| {
            let _ = events.send(Event::Reached(Running { press: id, states, states_due }));
        };
        reached(0);
        let store = |bytes: &[u8]| self.workspace.store_standing(id, bytes);
        let stored = self.workspace.standing(id);
        let whole = stored.is_none();
        let when = (&*self.options.stop, self.options.checkpoint_every);
        let mut checkpoints = Checkpoints::new(states_due, stored, &store, &reached, when);
        // One bad indentation must not cost the others; a solver that panicked may be
        // in any state and is not used again.
        let solving = AssertUnwindSafe(|| ready.solve(press, &mut checkpoints));
        let solved = match catch_unwind(solving) {
            Ok(solved) => {
                *solver = Some(ready);
                solved
            }
            Err(panic) => {
                let text = panic_text(panic.as_ref());
                Err(PressError::Failed(format!("the solver panicked: {text}").into()))
            }
        };
        let solved = match solved {
            Ok(records) => complete(press, records),
            Err(PressError::Failed(error)) => Err(chain(error.as_ref())),
            Err(PressError::Interrupted) => return Ok(Settled::Not),
            Err(PressError::Output(error)) => return Err(error.into()),
        };
        let seconds = start.elapsed().as_secs_f64();
        let processor_s = whole.then(|| thread_s() - processor_start_s);
        let (outcome, shard) = match solved {
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
        let fingerprint = None;
        let press = press.clone();
        let mut state = IndentationState { press, seconds, processor_s, outcome, fingerprint };
        self.workspace.store(&mut state, shard.as_deref())?;
        Ok(Settled::Now(state))
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
    let due: Vec<f64> = press.states().map(|(depth_mm, _)| depth_mm).collect();
    // A depth that is no number is left to the sample's own checks.
    let fit = |r: &Sample, d: &f64| r.depth_mm.is_nan() || (r.depth_mm - d).abs() <= 1e-9;
    let fits = records.len() == due.len() && records.iter().zip(&due).all(|(r, d)| fit(r, d));
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
