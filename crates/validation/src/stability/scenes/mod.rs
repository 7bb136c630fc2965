//! Random scenes of a campaign's distribution, by the thousand.
//!
//! One line of JSON a scene goes to `scenes.jsonl` as soon as it is solved; a run that was
//! cut off goes on with the scenes that have none, and a longer run with the same seed goes
//! on from a shorter one. A scene that failed is tried again and its first line stays: what the
//! record proves is counted by first lines.

mod ending;
mod queue;
mod record;
mod report;
mod share;
mod table;

pub use ending::{Ending, How, SceneRecord};
pub use record::{Head, MendedOn};
pub use report::{Count, ScenesReport};
pub use table::Row;

use papilla_fingertip::campaign::{CampaignSpec, Indentation, Slice, SpecError, indentations};
use papilla_fingertip::mesh::fingertip::Density;
use papilla_fingertip::simulation::body::SimulationError;
use papilla_output::OutputError;
use queue::{Finger, Queue};
use record::{Contents, Record};
use report::count;
use std::collections::HashMap;
use std::num::NonZero;
use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicUsize;
use std::thread::ScopedJoinHandle;

/// How many scenes, and how.
#[derive(Clone, Copy, Debug)]
pub struct ScenesOptions {
    /// Scenes in all.
    pub count: NonZero<usize>,
    /// Seed of the draw.
    pub seed: u64,
    /// Mesh of the finger.
    pub density: Density,
    /// Scenes solved at a time.
    pub threads: NonZero<usize>,
    /// The part of them; others may solve other parts into the same folder.
    pub slice: Slice,
}

/// What a run tells of how far it is.
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    /// Called once with the scenes that an earlier run has solved.
    pub begun: &'a dyn Fn(usize),
    /// Called after each scene.
    pub solved: &'a (dyn Fn() + Sync),
}

/// Why no scenes could be solved.
#[derive(Debug, thiserror::Error)]
pub enum ScenesError {
    /// The campaign makes no sense.
    #[error(transparent)]
    Campaign(#[from] SpecError),
    /// The body or an indenter cannot be set up.
    #[error(transparent)]
    Press(#[from] SimulationError),
    /// A file cannot be read or written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The record is of other scenes.
    #[error(
        "{} is the record of other scenes ({found}; wanted: {wanted}): choose another --out",
        path.display()
    )]
    Other {
        /// The record.
        path: PathBuf,
        /// What it says it is.
        found: String,
        /// What was asked for.
        wanted: String,
    },
    /// A line of the record makes no sense.
    #[error(
        "{}:{line} cannot be read as {}: {source}; restore the file, or choose another --out",
        path.display(),
        if *line == 1 { "a record's head" } else { "a scene" }
    )]
    Unreadable {
        /// The record.
        path: PathBuf,
        /// Number of the line.
        line: usize,
        /// What is wrong with it.
        source: serde_json::Error,
    },
    /// Another process writes there now.
    #[error("another process is writing {}: wait for it or choose another --out", .0.display())]
    Busy(PathBuf),
}

/// The campaign whose indentations are the scenes.
fn drawn(spec: &CampaignSpec, count: NonZero<usize>, seed: u64, density: Density) -> CampaignSpec {
    CampaignSpec { presses: count.get(), seed, density, ..spec.clone() }
}

/// The head of a record of the scenes that are drawn so.
fn head(spec: &CampaignSpec) -> Head {
    let CampaignSpec { name, seed, density, .. } = spec;
    Head { campaign: name.clone(), seed: *seed, density: *density, mended_on: None }
}

/// The scenes: indentations to their deepest states.
fn scenes(spec: &CampaignSpec) -> Vec<Indentation> {
    let deepest = |p: Indentation| {
        let depths_mm = p.depths_mm.last().copied().into_iter().collect();
        Indentation { depths_mm, ..p }
    };
    indentations(spec).into_iter().map(deepest).collect()
}

/// The lines of each scene that the record has, oldest first, and the scenes to solve: those
/// without a line and those whose last line failed.
fn split(
    all: Vec<Indentation>,
    lines: Vec<SceneRecord>,
) -> (Vec<Vec<SceneRecord>>, Vec<Indentation>) {
    let mut known: HashMap<_, Vec<_>> = HashMap::new();
    for line in lines {
        known.entry(line.press.id).or_default().push(line);
    }
    let (mut found, mut todo) = (Vec::new(), Vec::new());
    for press in all {
        let mut own = known.remove(&press.id).unwrap_or_default();
        own.retain(|line| line.press == press);
        if !own.last().is_some_and(SceneRecord::balances) {
            todo.push(press);
        }
        if !own.is_empty() {
            found.push(own);
        }
    }
    (found, todo)
}

/// Draws and presses a slice of the scenes, each to its deepest state.
///
/// # Errors
/// [`ScenesError`]; a scene that does not converge is none.
pub fn run(
    spec: &CampaignSpec,
    folder: &Path,
    options: &ScenesOptions,
    Watch { begun, solved }: Watch<'_>,
) -> Result<ScenesReport, ScenesError> {
    let spec = drawn(spec, options.count, options.seed, options.density);
    spec.validate()?;
    let (record, Contents { head, lines }) = Record::open(folder, &head(&spec), options.slice)?;
    let own = options.slice.range(options.count.get());
    let mut all = scenes(&spec);
    all.retain(|press| own.contains(&press.id));
    let (mut records, todo) = split(all, lines);
    let reused = own.len() - todo.len();
    begun(reused);
    let finger = Finger::new(&spec)?;
    let next = AtomicUsize::new(0);
    let queue = Queue { finger: &finger, todo: &todo, next, record: &record, solved };
    let solved = std::thread::scope(|scope| {
        // Room for the recursion of sparse factorizations; not touched if not needed.
        let room = || std::thread::Builder::new().stack_size(16 << 20);
        let start = |_| room().spawn_scoped(scope, || queue.work());
        let threads: Vec<_> = (0..options.threads.get()).map(start).collect();
        let end = |thread: std::io::Result<ScopedJoinHandle<'_, _>>| {
            let thread = thread.map_err(OutputError::io("start a thread for", folder))?;
            thread.join().unwrap_or_else(|panic| resume_unwind(panic))
        };
        threads.into_iter().map(end).collect::<Result<Vec<_>, ScenesError>>()
    });
    for line in solved?.into_iter().flatten() {
        match records.iter_mut().find(|lines| lines[0].press.id == line.press.id) {
            Some(lines) => lines.push(line),
            None => records.push(vec![line]),
        }
    }
    Ok(count(head, &records, reused))
}

#[cfg(test)]
mod tests;
