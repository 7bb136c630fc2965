//! Random scenes of a campaign's distribution, by the thousand.
//!
//! One line of JSON a scene goes to `scenes.jsonl` as soon as it is solved; a run that was
//! cut off goes on with the scenes that have none, and a longer run with the same seed goes
//! on from a shorter one.

mod record;
mod report;

pub use report::{Ending, SceneRecord, ScenesReport};

use super::panic_text;
use crate::campaign::{CampaignError, CampaignSpec, Press, presses};
use crate::dataset::{BALANCE_RELATIVE_MAX, fault};
use crate::mesh::fingertip::Density;
use crate::output::OutputError;
use crate::press::body::{Body, PressError};
use crate::press::drive::{Approach, Drive};
use crate::press::setup::Setup;
use crate::processor;
use crate::solve::{Options, Solver};
use record::Record;
use report::count;
use std::num::NonZero;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

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

/// Why no scenes could be solved.
#[derive(Debug, thiserror::Error)]
pub enum ScenesError {
    /// The campaign makes no sense.
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// The body or an indenter cannot be set up.
    #[error(transparent)]
    Press(#[from] PressError),
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

/// Draws and presses scenes, each to its deepest state, on the coarse finger.
///
/// # Errors
/// [`ScenesError`]; a scene that does not converge is none.
pub fn run(
    spec: &CampaignSpec,
    folder: &Path,
    options: &ScenesOptions,
) -> Result<ScenesReport, ScenesError> {
    let mut spec = spec.clone();
    spec.presses = options.count.get();
    spec.seed = options.seed;
    spec.density = Density::Coarse;
    spec.validate()?;
    let drawn_from = format!("{}, seed {}", spec.name, spec.seed);
    let (record, known) = Record::open(folder, &drawn_from)?;
    let candidates = spec.candidates();
    let mut shapes = Vec::new();
    for candidate in &candidates {
        let shape = candidate.indenter.build(&spec.folder).map_err(PressError::from)?;
        shapes.push((shape, candidate.indenter.top_mm()));
    }
    let Setup { body, approach, .. } = Setup::new(&spec.scene(&candidates[0]))?;
    let deepest = |mut p: Press| {
        p.depths_mm = p.depths_mm.last().copied().into_iter().collect();
        p
    };
    let all: Vec<_> = presses(&spec).into_iter().map(deepest).collect();
    let is_known = |p: &Press| known.iter().any(|k| k.press == *p);
    let reused: Vec<_> = all.iter().filter(|p| is_known(p)).map(|p| p.id).collect();
    let todo: Vec<_> = all.iter().filter(|p| reused.binary_search(&p.id).is_err()).collect();
    let next = AtomicUsize::new(0);
    let failed = Mutex::new(None);
    let work = || -> Result<Vec<SceneRecord>, ScenesError> {
        let mut solver = body.solver(Options::default())?;
        let mut done = Vec::new();
        while let Some(&press) = todo.get(next.fetch_add(1, Ordering::Relaxed)) {
            let (shape, top_mm) = shapes[press.candidate].clone();
            let (pose, offset_mm) = (press.pose, press.offset_mm);
            let approach = Approach { shape, top_mm, pose, offset_mm, ..approach.clone() };
            let found = solve(&body, &mut solver, &approach, press);
            if matches!(found.ending, Ending::Panicked(_)) {
                // It may be in any state.
                solver = body.solver(Options::default())?;
            }
            record.add(&found)?;
            done.push(found);
        }
        Ok(done)
    };
    let mut records: Vec<_> =
        known.into_iter().filter(|k| reused.binary_search(&k.press.id).is_ok()).collect();
    std::thread::scope(|scope| {
        // Room for the recursion of sparse factorizations; not touched if not needed.
        let spawn = || std::thread::Builder::new().stack_size(16 << 20).spawn_scoped(scope, work);
        let threads: Vec<_> = (0..options.threads.get()).map(|_| spawn()).collect();
        for thread in threads {
            let outcome = match thread {
                Ok(handle) => handle.join().ok(),
                Err(source) => {
                    Some(Err(OutputError::io("start a thread for", folder)(source).into()))
                }
            };
            match outcome {
                Some(Ok(done)) => records.extend(done),
                Some(Err(error)) => *failed.lock().unwrap_or_else(|p| p.into_inner()) = Some(error),
                None => {}
            }
        }
    });
    match failed.into_inner().unwrap_or_else(|p| p.into_inner()) {
        Some(error) => Err(error),
        None => Ok(count(drawn_from, records, reused.len())),
    }
}

fn solve(body: &Body, solver: &mut Solver<'_>, approach: &Approach, press: &Press) -> SceneRecord {
    let began_s = processor::thread_s();
    let drive = Drive::Depths(press.depths_mm.clone());
    let vertices = body.patch.as_ref().map_or(0, |p| p.patch.skin.len());
    let (mut iterations, mut cuts, mut j_min) = (0, 0, None);
    let solved = catch_unwind(AssertUnwindSafe(|| {
        body.press_balanced(solver, approach, &drive, BALANCE_RELATIVE_MAX, &mut |_, _, r, s| {
            (fault(r, vertices), r.checks.j_min, s.effort)
        })
    }));
    let ending = match solved {
        Err(panic) => Ending::Panicked(panic_text(panic.as_ref()).into()),
        Ok((kept, pressed)) => {
            for (_, j, effort) in &kept {
                (iterations, cuts) = (effort.newton_iterations, effort.cuts);
                j_min = Some(*j);
            }
            let missed = kept.into_iter().find_map(|(fault, ..)| fault);
            match (pressed, missed) {
                (Err(error), _) => Ending::Refused(error.to_string()),
                (Ok(()), Some(fault)) => Ending::Unbalanced(fault),
                (Ok(()), None) => Ending::Balanced,
            }
        }
    };
    let seconds = processor::thread_s() - began_s;
    SceneRecord {
        press: press.clone(),
        ending,
        newton_iterations: iterations,
        cuts,
        j_min,
        seconds,
    }
}
