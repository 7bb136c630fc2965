//! How far the slices of a campaign are, read from the files that they leave.

use crate::beat::{BEAT, Beat};
use crate::state::{Found, IndentationState, Outcome, Workspace};
use crate::{CampaignError, Failure};
use papilla_fingertip::campaign::{CampaignSpec, Indentation, indentations};
use papilla_output::OutputError;
use papilla_progress::clock;
use serde::Serialize;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::fmt;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A process whose slice is not done, and when it was last heard of.
#[derive(Clone, Debug, Serialize)]
pub struct Heard {
    /// Its last word.
    #[serde(flatten)]
    pub beat: Beat,
    /// How long ago that was by this machine's clock, s.
    pub heard_s: f64,
    /// It has been silent for so long that it may be lost.
    pub silent: bool,
}

/// How far a campaign is.
#[derive(Clone, Debug, Serialize)]
pub struct Status {
    /// Name of the campaign.
    pub name: String,
    /// Its folder.
    pub folder: PathBuf,
    /// Indentations in all.
    pub presses: usize,
    /// Indentations with a record and a shard.
    pub solved: usize,
    /// Those that failed.
    pub failed: Vec<Failure>,
    /// Those being solved, by processes that were heard of lately.
    pub running: usize,
    /// Those that were begun and will be gone on with from a stored state.
    pub standing: usize,
    /// Neither solved nor failed, the running ones among them.
    pub unsolved: usize,
    /// Those whose record cannot be trusted, and why; they will be solved again.
    pub untrusted: Vec<String>,
    /// Processes whose slices are not done.
    pub processes: Vec<Heard>,
    /// Solver time of an indentation so far, s.
    pub seconds_per_press: Option<f64>,
    /// What is left, if it takes as long and as many are solved at a time as now; without any,
    /// one at a time.
    pub hours_left: Option<f64>,
    /// Is there a manifest?
    pub merged: bool,
}

impl Status {
    /// Nothing is left to be solved.
    pub fn is_over(&self) -> bool {
        self.unsolved == 0
    }
}

/// Reads how far a campaign is, each record once.
pub struct StatusReader {
    name: String,
    workspace: Workspace,
    planned: Vec<Indentation>,
    known: BTreeMap<usize, IndentationState>,
}

impl StatusReader {
    /// For the campaign in `folder`.
    ///
    /// # Errors
    /// [`CampaignError`] when the folder is of no campaign or of another.
    pub fn new(spec: &CampaignSpec, folder: &Path) -> Result<Self, CampaignError> {
        spec.validate()?;
        let (workspace, _) = Workspace::begun(folder, spec)?;
        let (name, planned) = (spec.name.clone(), indentations(spec));
        Ok(Self { name, workspace, planned, known: BTreeMap::new() })
    }

    /// How far it is now. Shards are looked for, but not read: `merge` does.
    ///
    /// # Errors
    /// [`CampaignError::Output`] when the folder cannot be listed.
    pub fn read(&mut self) -> Result<Status, CampaignError> {
        let folder = self.workspace.folder().to_path_buf();
        let shards = names(&folder.join("shards"))?;
        let progress = names(&folder.join("progress"))?;
        let (mut untrusted, mut standing) = (Vec::new(), 0);
        for press in &self.planned {
            let (id, name) = (press.id, format!("press-{:05}", press.id));
            let failed = self.known.get(&id).is_some_and(IndentationState::is_failed);
            if failed
                || (!self.known.contains_key(&id) && progress.contains(&(name.clone() + ".json")))
            {
                match self.workspace.record(press) {
                    Found::Vouched(state) => drop(self.known.insert(id, *state)),
                    Found::Absent => {}
                    Found::Untrusted(why) => untrusted.push(format!("{id}: {why}")),
                }
            }
            let solved = self.known.get(&id).is_some_and(|state| !state.is_failed());
            if solved && !shards.contains(&(name.clone() + ".npz")) {
                untrusted.push(format!("{id}: its shard is not there"));
                self.known.remove(&id);
            }
            let open = !self.known.contains_key(&id);
            standing += usize::from(open && progress.contains(&(name + ".state")));
        }
        let processes = self.processes()?;
        let lively = processes.iter().filter(|p| !p.silent && p.beat.ended.is_none());
        let running = lively.map(|p| p.beat.running.len()).sum();
        let (seconds_per_press, left_s) = self.seconds();
        Ok(Status {
            name: self.name.clone(),
            presses: self.planned.len(),
            solved: self.known.values().filter(|s| !s.is_failed()).count(),
            failed: self.known.values().filter_map(failure).collect(),
            running,
            standing,
            unsolved: self.planned.len() - self.known.len(),
            untrusted,
            processes,
            seconds_per_press,
            hours_left: left_s.map(|s| s / 3600.0 / running.max(1) as f64),
            merged: folder.join("manifest.json").exists(),
            folder,
        })
    }

    /// Indenter, as a place among the campaign's, and processor time (s) of each indentation that
    /// [`Self::read`] has found solved by one process from its beginning.
    pub fn processor_s(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let solved = self.known.values().filter(|state| !state.is_failed());
        solved.filter_map(|state| Some((state.press.candidate, state.processor_s?)))
    }

    /// Processes that have not finished their slices.
    fn processes(&self) -> Result<Vec<Heard>, CampaignError> {
        let all = Beat::all(self.workspace.folder())?;
        let unfinished = all.into_iter().filter(|(beat, _)| {
            let own = beat.slice.range(self.planned.len());
            !own.into_iter().all(|id| self.known.contains_key(&id))
        });
        let heard = unfinished.map(|(beat, age)| Heard {
            silent: beat.ended.is_none() && age > 4 * BEAT,
            heard_s: age.as_secs_f64(),
            beat,
        });
        Ok(heard.collect())
    }

    /// Mean solver time of an indentation, and that of those to come by their indenters, s.
    fn seconds(&self) -> (Option<f64>, Option<f64>) {
        let mut by_candidate: HashMap<usize, (f64, f64)> = HashMap::new();
        for state in self.known.values() {
            let (sum, count) = by_candidate.entry(state.press.candidate).or_default();
            *sum += state.seconds;
            *count += 1.0;
        }
        let (sum, count) = by_candidate.values().fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
        if count < 1.0 {
            return (None, None);
        }
        let mean = |press: &Indentation| {
            by_candidate.get(&press.candidate).map_or(sum / count, |(s, n)| s / n)
        };
        let open = self.planned.iter().filter(|p| !self.known.contains_key(&p.id));
        (Some(sum / count), Some(open.map(mean).sum()))
    }
}

fn failure(state: &IndentationState) -> Option<Failure> {
    let Outcome::Failed { error } = &state.outcome else { return None };
    let press = &state.press;
    Some(Failure { id: press.id, indenter: press.indenter.clone(), error: error.clone() })
}

fn names(folder: &Path) -> Result<HashSet<String>, OutputError> {
    let entries = std::fs::read_dir(folder).map_err(OutputError::io("list", folder))?;
    entries
        .map(|entry| {
            let entry = entry.map_err(OutputError::io("list", folder))?;
            Ok(entry.file_name().to_string_lossy().into_owned())
        })
        .collect()
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "campaign {} in {}: {} indentations",
            self.name,
            self.folder.display(),
            self.presses
        )?;
        writeln!(f, "  solved    {:6}", self.solved)?;
        writeln!(f, "  failed    {:6}", self.failed.len())?;
        writeln!(f, "  running   {:6}", self.running)?;
        writeln!(f, "  unsolved  {:6}, {} with a stored state", self.unsolved, self.standing)?;
        for Heard { beat, heard_s, silent } in &self.processes {
            let ago = clock(Duration::from_secs_f64(*heard_s));
            let job = beat.job.as_ref().map_or(String::new(), |job| format!(", job {job}"));
            let what = match (beat.ended, silent) {
                (Some(_), _) => "stopped, to be started again".to_owned(),
                (None, true) => "silent: lost?".to_owned(),
                (None, false) => {
                    let at = |r: &crate::Running| {
                        format!("indentation {}, {} of {} states", r.press, r.states, r.states_due)
                    };
                    beat.running.iter().map(at).collect::<Vec<_>>().join("; ")
                }
            };
            let (slice, node, process) = (beat.slice, &beat.node, beat.process);
            writeln!(
                f,
                "  slice {slice} ({node}, process {process}{job}), heard {ago} ago: {what}"
            )?;
        }
        for Failure { id, indenter, error } in &self.failed {
            writeln!(f, "  FAILED indentation {id} ({indenter}): {error}")?;
        }
        for why in &self.untrusted {
            writeln!(f, "  NOT TRUSTED indentation {why}")?;
        }
        match (self.hours_left, self.merged, self.unsolved) {
            (_, true, 0) => writeln!(f, "  solved and merged"),
            (_, _, 0) => writeln!(f, "  all solved: `fe-datagen dataset merge` makes the dataset"),
            (Some(hours), ..) => writeln!(
                f,
                "  about {hours:.2} h left at {} at a time, {:.1} s an indentation",
                self.running.max(1),
                self.seconds_per_press.unwrap_or_default()
            ),
            (None, ..) => writeln!(f, "  none solved yet: no forecast"),
        }
    }
}
