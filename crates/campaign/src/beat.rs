//! What a process writes about its progress into `DIR/progress`, for `dataset status`. No decision
//! depends on it.

use papilla_fingertip::campaign::Slice;
use papilla_output::{OutputError, atomic};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant, SystemTime};

/// Longest time without a word.
pub(crate) const BEAT: Duration = Duration::from_secs(60);
/// Shortest time between two: thousands of processes tell one file system.
const BEAT_MIN: Duration = Duration::from_secs(30);

/// An indentation that is being solved.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Running {
    /// Its number.
    pub press: usize,
    /// Depths stored.
    pub states: usize,
    /// Depths in all.
    pub states_due: usize,
}

/// How a process left its slice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ended {
    /// Everything is solved, or failed.
    Done,
    /// It was asked to stop before.
    Stopped,
    /// An error ended it.
    Error,
}

/// The last word of a process.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Beat {
    /// What it works on.
    pub slice: Slice,
    /// The machine.
    pub node: String,
    /// The process' number there.
    pub process: u32,
    /// The job of the cluster's scheduler.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub job: Option<String>,
    /// What it is solving.
    pub running: Vec<Running>,
    /// `None` while it works.
    pub ended: Option<Ended>,
}

/// What happens to an indentation.
pub(crate) enum Event {
    Reached(Running),
    Done(usize),
}

impl Beat {
    pub(crate) fn new(slice: Slice) -> Self {
        let job = std::env::var("SLURM_JOB_ID").ok();
        let (node, process) = (node(), std::process::id());
        Self { slice, node, process, job, running: Vec::new(), ended: None }
    }

    fn take(&mut self, event: Event) {
        let (Event::Done(id) | Event::Reached(Running { press: id, .. })) = &event;
        self.running.retain(|r| r.press != *id);
        if let Event::Reached(running) = event {
            self.running.push(running);
        }
    }

    /// The file of a slice's last word.
    fn path(folder: &Path, slice: Slice) -> PathBuf {
        let name = format!("slice-{:05}-of-{:05}.json", slice.index(), slice.count());
        folder.join("progress").join(name)
    }

    /// Another process that has just been heard of at the same slice.
    pub(crate) fn other(&self, folder: &Path) -> Option<(Self, Duration)> {
        let path = Self::path(folder, self.slice);
        let found: Self = atomic::read_json(&path).ok()?;
        let heard = age(&path)?;
        let lives = found.ended.is_none() && heard < 2 * BEAT;
        let same = (&found.node, found.process) == (&self.node, self.process);
        (lives && !same).then_some((found, heard))
    }

    fn write(&self, folder: &Path) {
        // Work goes on untold.
        if let Err(error) = atomic::write_json(&Self::path(folder, self.slice), self) {
            tracing::warn!(%error, "cannot tell how far this slice is");
        }
    }

    /// Tells of everything that happens until nothing can any more.
    pub(crate) fn follow(&mut self, folder: &Path, events: &Receiver<Event>) {
        let (mut last, mut news) = (None::<Instant>, false);
        loop {
            match events.recv_timeout(if news { BEAT_MIN } else { BEAT }) {
                Ok(event) => {
                    self.take(event);
                    news = true;
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
            let due = if news { BEAT_MIN } else { BEAT };
            if last.is_none_or(|last| last.elapsed() >= due) {
                self.write(folder);
                (last, news) = (Some(Instant::now()), false);
            }
        }
    }

    /// The last word.
    pub(crate) fn end(&mut self, folder: &Path, ended: Ended) {
        self.running.clear();
        self.ended = Some(ended);
        self.write(folder);
    }

    /// The last words in a folder, and how long ago they were written.
    pub(crate) fn all(folder: &Path) -> Result<Vec<(Self, Duration)>, OutputError> {
        let progress = folder.join("progress");
        let entries = std::fs::read_dir(&progress).map_err(OutputError::io("list", &progress))?;
        let mut all = Vec::new();
        for entry in entries {
            let path = entry.map_err(OutputError::io("list", &progress))?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if name.starts_with("slice-") && name.ends_with(".json") {
                // One that is replaced at this moment will be read the next time.
                all.extend(atomic::read_json(&path).ok().zip(age(&path)));
            }
        }
        all.sort_by_key(|(beat, _): &(Self, _)| (beat.slice.count(), beat.slice.index()));
        Ok(all)
    }
}

/// How long ago a file was written; nothing where this clock is behind.
fn age(path: &Path) -> Option<Duration> {
    let written = std::fs::metadata(path).and_then(|m| m.modified()).ok()?;
    Some(SystemTime::now().duration_since(written).unwrap_or_default())
}

/// The machine's name.
fn node() -> String {
    #[cfg(unix)]
    return rustix::system::uname().nodename().to_string_lossy().into_owned();
    #[cfg(not(unix))]
    std::env::var("COMPUTERNAME").unwrap_or_default()
}
