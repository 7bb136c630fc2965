//! Random scenes of a campaign's distribution, by the thousand.
//!
//! One line of JSON a scene goes to `scenes.jsonl` as soon as it is solved; a run that was
//! cut off goes on with the scenes that have none, and a longer run with the same seed goes
//! on from a shorter one.

use super::panic_text;
use crate::campaign::{CampaignError, CampaignSpec, Press, presses};
use crate::dataset::{BALANCE_RELATIVE_MAX, fault};
use crate::mesh::fingertip::Density;
use crate::output::OutputError;
use crate::press::body::{Body, PressError};
use crate::press::drive::{Approach, Drive};
use crate::press::setup::Setup;
use crate::solve::{Options, Solver};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read as _, Write as _};
use std::num::NonZero;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

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

/// What became of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// In equilibrium, every balance of a dataset kept.
    Balanced,
    /// In equilibrium, a balance missed.
    Unbalanced(String),
    /// A typed error.
    Refused(String),
    /// A panic.
    Panicked(String),
}

/// One scene in the record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneRecord {
    /// What was pressed how.
    pub press: Press,
    /// What became of it.
    pub ending: Ending,
    /// Newton iterations.
    pub newton_iterations: u32,
    /// Halved load steps.
    pub cuts: u32,
    /// Smallest `J`; absent without an equilibrium.
    pub j_min: Option<f64>,
    /// Wall time, s.
    pub seconds: f64,
}

/// The scenes of a run, counted.
#[derive(Clone, Debug, Serialize)]
pub struct ScenesReport {
    /// Name of the campaign and seed.
    pub drawn_from: String,
    /// Scenes solved in this run and before.
    pub scenes: usize,
    /// Those in the record before.
    pub reused: usize,
    /// In equilibrium with every balance kept.
    pub balanced: usize,
    /// In equilibrium with a balance missed: number and what.
    pub unbalanced: Vec<(usize, String)>,
    /// Typed errors.
    pub refused: Vec<(usize, String)>,
    /// Panics.
    pub panicked: Vec<(usize, String)>,
    /// Scenes with a halved load step.
    pub with_cuts: usize,
    /// Most Newton iterations of a scene.
    pub newton_iterations_max: u32,
    /// Smallest `J` of a scene.
    pub j_min: Option<f64>,
    /// Mean wall time of a scene, s.
    pub seconds_per_scene: f64,
}

/// Share of the scenes that have to converge.
const CONVERGED_SHARE: f64 = 0.999;

impl ScenesReport {
    /// At least 99.9 % converge, each of those keeps its balances, the others are typed
    /// errors.
    #[must_use]
    pub fn passed(&self) -> bool {
        let refused = self.refused.len() as f64;
        self.unbalanced.is_empty()
            && self.panicked.is_empty()
            && refused <= (1.0 - CONVERGED_SHARE) * self.scenes as f64 + 1e-9
    }
}

impl fmt::Display for ScenesReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{}: {} scenes ({} from an earlier run), {} converged and balanced, {} out of balance, {} typed \
             errors, {} panics; {} with cut steps, at most {} Newton iterations, least J {:.4}; {:.2} s a scene",
            self.drawn_from,
            self.scenes,
            self.reused,
            self.balanced,
            self.unbalanced.len(),
            self.refused.len(),
            self.panicked.len(),
            self.with_cuts,
            self.newton_iterations_max,
            self.j_min.unwrap_or(f64::NAN),
            self.seconds_per_scene,
        )?;
        for (what, list) in [
            ("out of balance", &self.unbalanced),
            ("typed error", &self.refused),
            ("panic", &self.panicked),
        ] {
            for (scene, text) in list {
                writeln!(f, "  scene {scene}: {what}: {text}")?;
            }
        }
        Ok(())
    }
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
    let clock = Instant::now();
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
    let seconds = clock.elapsed().as_secs_f64();
    SceneRecord {
        press: press.clone(),
        ending,
        newton_iterations: iterations,
        cuts,
        j_min,
        seconds,
    }
}

fn count(drawn_from: String, records: Vec<SceneRecord>, reused: usize) -> ScenesReport {
    let scenes = records.len();
    let mut report = ScenesReport {
        drawn_from,
        scenes,
        reused,
        balanced: 0,
        unbalanced: Vec::new(),
        refused: Vec::new(),
        panicked: Vec::new(),
        with_cuts: records.iter().filter(|r| r.cuts > 0).count(),
        newton_iterations_max: records.iter().map(|r| r.newton_iterations).max().unwrap_or(0),
        j_min: records.iter().filter_map(|r| r.j_min).reduce(f64::min),
        seconds_per_scene: records.iter().map(|r| r.seconds).sum::<f64>() / scenes.max(1) as f64,
    };
    for SceneRecord { press, ending, .. } in records {
        match ending {
            Ending::Balanced => report.balanced += 1,
            Ending::Unbalanced(text) => report.unbalanced.push((press.id, text)),
            Ending::Refused(text) => report.refused.push((press.id, text)),
            Ending::Panicked(text) => report.panicked.push((press.id, text)),
        }
    }
    for list in [&mut report.unbalanced, &mut report.refused, &mut report.panicked] {
        list.sort_by_key(|(scene, _)| *scene);
    }
    report
}

/// The record's first line.
#[derive(Serialize, Deserialize)]
struct Head {
    drawn_from: String,
}

/// The file that scenes are added to.
struct Record {
    path: PathBuf,
    file: Mutex<File>,
}

impl Record {
    /// Opens the record in `folder` and reads the scenes it has; a last line that a kill has
    /// torn is dropped.
    fn open(folder: &Path, drawn_from: &str) -> Result<(Self, Vec<SceneRecord>), ScenesError> {
        std::fs::create_dir_all(folder).map_err(OutputError::io("create", folder))?;
        let path = folder.join("scenes.jsonl");
        let failed = |what| OutputError::io(what, &path);
        let mut file = OpenOptions::new()
            .read(true)
            .append(true)
            .create(true)
            .open(&path)
            .map_err(failed("open"))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(ScenesError::Busy(path)),
            Err(TryLockError::Error(e)) => return Err(failed("lock")(e).into()),
        }
        let mut text = String::new();
        file.read_to_string(&mut text).map_err(failed("read"))?;
        let whole = text.rfind('\n').map_or(0, |i| i + 1);
        file.set_len(whole as u64).map_err(failed("write"))?;
        let mut lines = text[..whole].lines();
        match lines.next() {
            None => {
                let head = Head { drawn_from: drawn_from.into() };
                write_line(&mut file, &head).map_err(failed("write"))?;
            }
            Some(line) => {
                let found = serde_json::from_str::<Head>(line)
                    .map_or_else(|_| line.into(), |h| h.drawn_from);
                if found != drawn_from {
                    return Err(ScenesError::Other { path, found });
                }
            }
        }
        let known = lines.filter_map(|l| serde_json::from_str(l).ok()).collect();
        Ok((Self { path, file: Mutex::new(file) }, known))
    }

    fn add(&self, record: &SceneRecord) -> Result<(), ScenesError> {
        let mut file = self.file.lock().unwrap_or_else(|p| p.into_inner());
        Ok(write_line(&mut file, record).map_err(OutputError::io("write", &self.path))?)
    }
}

/// One line in one write: what a kill leaves is a line or no line.
fn write_line<T: Serialize>(file: &mut File, value: &T) -> std::io::Result<()> {
    let mut line = serde_json::to_vec(value)?;
    line.push(b'\n');
    file.write_all(&line)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(id: usize, ending: Ending) -> SceneRecord {
        let press = Press {
            id,
            candidate: 0,
            indenter: "plate".into(),
            shape: "plate".into(),
            pose: Default::default(),
            offset_mm: [0.0; 2],
            depths_mm: vec![1.0],
        };
        SceneRecord { press, ending, newton_iterations: 7, cuts: 0, j_min: Some(0.5), seconds: 1.0 }
    }

    #[test]
    fn a_record_goes_on_where_it_was_torn() {
        let folder = tempfile::tempdir().unwrap();
        let (first, known) = Record::open(folder.path(), "broad, seed 5").unwrap();
        assert!(known.is_empty());
        let one = record(0, Ending::Balanced);
        first.add(&one).unwrap();
        assert!(matches!(Record::open(folder.path(), "broad, seed 5"), Err(ScenesError::Busy(_))));
        drop(first);
        let path = folder.path().join("scenes.jsonl");
        let torn = std::fs::read_to_string(&path).unwrap() + "{\"press\":{\"id\":1,";
        std::fs::write(&path, torn).unwrap();
        let (again, known) = Record::open(folder.path(), "broad, seed 5").unwrap();
        assert_eq!(known, [one]);
        let two = record(1, Ending::Refused("x".into()));
        again.add(&two).unwrap();
        drop(again);
        let (_, known) = Record::open(folder.path(), "broad, seed 5").unwrap();
        assert_eq!(known.len(), 2);
        let other = Record::open(folder.path(), "broad, seed 6").map(drop);
        assert!(matches!(other, Err(ScenesError::Busy(_) | ScenesError::Other { .. })));
    }

    #[test]
    fn one_scene_in_a_thousand_may_be_refused_none_out_of_balance() {
        let of = |refused: usize, unbalanced: usize| {
            let mut all: Vec<_> = (0..1000).map(|i| record(i, Ending::Balanced)).collect();
            all[..refused].iter_mut().for_each(|r| r.ending = Ending::Refused("x".into()));
            all[500..500 + unbalanced]
                .iter_mut()
                .for_each(|r| r.ending = Ending::Unbalanced("x".into()));
            count("test".into(), all, 0).passed()
        };
        assert!(of(0, 0) && of(1, 0) && !of(2, 0) && !of(0, 1));
    }
}
