//! Random scenes of a campaign's distribution, by the thousand.
//!
//! One line of JSON a scene goes to `scenes.jsonl` as soon as it is solved; a run that was
//! cut off goes on with the scenes that have none, and a longer run with the same seed goes
//! on from a shorter one.

mod ending;
mod queue;
mod record;
mod report;
mod share;
mod table;

pub use ending::{Ending, SceneRecord};
pub use report::ScenesReport;
pub use table::Row;

use papilla_fingertip::campaign::{CampaignSpec, Indentation, SpecError, indentations};
use papilla_fingertip::mesh::fingertip::Density;
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::body::SimulationError;
use papilla_output::OutputError;
use queue::Queue;
use record::Record;
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
    /// Scenes solved at a time.
    pub threads: NonZero<usize>,
}

/// What a run tells of how far it is.
#[derive(Clone, Copy)]
pub struct Progress<'a> {
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
        "{} is the record of other scenes ({found}): choose another --out", path.display()
    )]
    Other {
        /// The record.
        path: PathBuf,
        /// What it says it is.
        found: String,
    },
    /// Another process writes there now.
    #[error("another process is writing {}: wait for it or choose another --out", .0.display())]
    Busy(PathBuf),
}

/// The campaign whose indentations are the scenes.
fn drawn(spec: &CampaignSpec, count: NonZero<usize>, seed: u64) -> CampaignSpec {
    let (presses, density) = (count.get(), Density::Coarse);
    CampaignSpec { presses, seed, density, ..spec.clone() }
}

/// What the record says its scenes are.
fn drawn_from(spec: &CampaignSpec) -> String {
    format!("{}, seed {}", spec.name, spec.seed)
}

/// The scenes: presses to their deepest states.
fn scenes(spec: &CampaignSpec) -> Vec<Indentation> {
    let deepest = |p: Indentation| {
        let depths_mm = p.depths_mm.last().copied().into_iter().collect();
        Indentation { depths_mm, ..p }
    };
    indentations(spec).into_iter().map(deepest).collect()
}

/// Splits the scenes into those that the record has, with what it says, and the others.
fn split(all: Vec<Indentation>, known: Vec<SceneRecord>) -> (Vec<SceneRecord>, Vec<Indentation>) {
    let mut known: HashMap<_, _> = known.into_iter().map(|k| (k.press.id, k)).collect();
    let (mut reused, mut todo) = (Vec::new(), Vec::new());
    for press in all {
        match known.remove(&press.id).filter(|k| k.press == press) {
            Some(record) => reused.push(record),
            None => todo.push(press),
        }
    }
    (reused, todo)
}

/// Draws and presses scenes, each to its deepest state, on the coarse finger.
///
/// # Errors
/// [`ScenesError`]; a scene that does not converge is none.
pub fn run(
    spec: &CampaignSpec,
    folder: &Path,
    options: &ScenesOptions,
    Progress { begun, solved }: Progress<'_>,
) -> Result<ScenesReport, ScenesError> {
    let spec = drawn(spec, options.count, options.seed);
    spec.validate()?;
    let (record, known) = Record::open(folder, &drawn_from(&spec))?;
    let (mut records, todo) = split(scenes(&spec), known);
    let reused = records.len();
    let Simulation { body, approach, .. } = Simulation::new(&spec.scene(&spec.candidates()[0]))?;
    begun(reused);
    let queue = Queue {
        body: &body,
        approaches: queue::approaches(&spec, &approach)?,
        todo: &todo,
        next: AtomicUsize::new(0),
        record: &record,
        solved,
    };
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
    records.extend(solved?.into_iter().flatten());
    Ok(count(drawn_from(&spec), records, reused))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Neither the record nor the report that the repository holds is edited by hand, and the
    /// campaign still draws those scenes.
    #[test]
    fn the_committed_report_is_of_the_committed_record() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let copy = tempfile::tempdir().unwrap();
        std::fs::copy(root.join("data/scenes/scenes.jsonl"), copy.path().join("scenes.jsonl"))
            .unwrap();
        let spec = CampaignSpec::read(&root.join("campaigns/broad.toml")).unwrap();
        let seed = 5;
        let (_, known) =
            Record::open(copy.path(), &drawn_from(&drawn(&spec, NonZero::<usize>::MIN, seed)))
                .unwrap();
        let spec = drawn(&spec, NonZero::new(known.len()).unwrap(), seed);
        let (records, todo) = split(scenes(&spec), known);
        assert_eq!(todo, [], "drawn differently, or not in the record");
        let report = count(drawn_from(&spec), records, 0);
        let told = std::fs::read_to_string(root.join("docs/reports/stability-scenes.md")).unwrap();
        assert_eq!(told, report.markdown());
        assert!(report.passed());
    }
}
