//! Noticing that a folder of models has changed: at once where the file system tells, within seconds
//! where it does not (NFS, 9p, FUSE, a link behind a link).

use std::{
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
        mpsc::{Receiver, RecvTimeoutError},
    },
    thread,
    time::Duration,
};

use notify::{
    Event, EventKind, RecommendedWatcher, RecursiveMode, Watcher,
    event::{AccessKind, AccessMode},
};
use papilla_metrics::Metrics;
use tokio::sync::mpsc::Sender;

use super::look::Look;

/// Time between two looks at the folder, which find what the file system does not report.
const LOOK_EVERY: Duration = Duration::from_secs(3);

/// Starts to watch the folder that `path` leads to, until `stop`'s sender is dropped. Each change
/// is sent to `changed`.
///
/// This runs on a thread of its own, so that a drive that does not answer blocks nothing else.
///
/// # Errors
/// The thread cannot be started.
pub(super) fn start(
    path: &Path,
    changed: Sender<()>,
    metrics: Arc<Metrics>,
    stop: Receiver<()>,
) -> std::io::Result<()> {
    let path = path.to_owned();
    let work = move || {
        let mut noticing = Noticing::new(path, changed);
        loop {
            metrics.models_looked_at();
            match stop.recv_timeout(LOOK_EVERY) {
                Err(RecvTimeoutError::Timeout) => noticing.look(),
                Ok(()) | Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    };
    thread::Builder::new().name("papilla-watch".to_owned()).spawn(work)?;
    Ok(())
}

/// What the last look found, and what the file system has reported since.
struct Noticing {
    path: PathBuf,
    last: Option<Look>,
    changed: Sender<()>,
    /// Whether the file system has reported a change since the last look.
    was_told: Arc<AtomicBool>,
    /// Reports changes of the folder and of the link that leads there; None if the file system
    /// cannot.
    watcher: Option<RecommendedWatcher>,
}

impl Noticing {
    fn new(path: PathBuf, changed: Sender<()>) -> Self {
        let was_told = Arc::default();
        let mut noticing = Self { path, last: None, changed, was_told, watcher: None };
        noticing.last = Look::at(&noticing.path).ok();
        noticing.watch();
        noticing
    }

    /// Resolves the path again and looks. Sends a change that the file system has not reported.
    fn look(&mut self) {
        let was_told = self.was_told.swap(false, Ordering::AcqRel);
        // A folder may be missing for a moment, as while a link is replaced; the next look finds
        // it.
        let Ok(look) = Look::at(&self.path) else { return };
        if self.last.as_ref() == Some(&look) {
            return;
        }
        let has_moved = self.last.as_ref().is_none_or(|last| last.folder != look.folder);
        self.last = Some(look);
        if has_moved {
            self.watch();
        }
        if !was_told || has_moved {
            let _ = self.changed.try_send(());
        }
    }

    /// Asks the file system to report changes in the folder that the path leads to now.
    fn watch(&mut self) {
        self.watcher = None;
        let Some(look) = &self.last else { return };
        match watcher(&self.path, &look.folder, self.changed.clone(), Arc::clone(&self.was_told)) {
            Ok(watcher) => self.watcher = Some(watcher),
            Err(error) => {
                let (folder, seconds) = (look.folder.display(), LOOK_EVERY.as_secs());
                tracing::info!(%folder, %error, "looked at every {seconds} s: changes are not told");
            }
        }
    }
}

fn watcher(
    path: &Path,
    folder: &Path,
    changed: Sender<()>,
    was_told: Arc<AtomicBool>,
) -> notify::Result<RecommendedWatcher> {
    let link = path.file_name().map(ToOwned::to_owned);
    let inside = folder.to_owned();
    let mut watcher = notify::recommended_watcher(move |event: notify::Result<Event>| {
        // After an error events may be lost, so it counts as a change.
        let is_ours = event.map_or(true, |event| {
            let is_there =
                |path: &PathBuf| path.starts_with(&inside) || path.file_name() == link.as_deref();
            is_change(event.kind) && (event.paths.is_empty() || event.paths.iter().any(is_there))
        });
        if is_ours {
            was_told.store(true, Ordering::Release);
            // A capacity of one is enough: a message means that something has changed since the
            // last one was received.
            let _ = changed.try_send(());
        }
    })?;
    watcher.watch(folder, RecursiveMode::NonRecursive)?;
    // In the folder that holds the link, only the link counts. If that folder cannot be watched,
    // the regular looks find a changed link.
    if let Some(parent) = path.parent() {
        let parent = if parent.as_os_str().is_empty() { Path::new(".") } else { parent };
        if watcher.watch(parent, RecursiveMode::NonRecursive).is_err() {
            tracing::debug!(parent = %parent.display(), "cannot be watched");
        }
    }
    Ok(watcher)
}

/// Whether an event is a change. Reading a file is an event too, and a reload reads all files.
fn is_change(kind: EventKind) -> bool {
    match kind {
        EventKind::Access(kind) => matches!(kind, AccessKind::Close(AccessMode::Write)),
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use tokio::sync::mpsc;

    use super::*;

    #[test]
    fn reading_is_no_change() {
        assert!(!is_change(EventKind::Access(AccessKind::Open(AccessMode::Any))));
        assert!(!is_change(EventKind::Access(AccessKind::Close(AccessMode::Read))));
        assert!(is_change(EventKind::Access(AccessKind::Close(AccessMode::Write))));
        assert!(is_change(EventKind::Any));
    }

    /// Behaves as on a file system that reports no changes.
    #[cfg(unix)]
    #[test]
    fn what_nobody_tells_is_found_by_the_next_look_and_told_once() {
        use std::os::unix::fs::symlink;
        let root = tempfile::tempdir().unwrap();
        let [v1, v2, link] = ["v1", "v2", "current"].map(|name| root.path().join(name));
        for folder in [&v1, &v2] {
            fs::create_dir(folder).unwrap();
        }
        symlink(&v1, &link).unwrap();
        let (changed, mut changes) = mpsc::channel(1);
        let mut noticing = Noticing::new(link.clone(), changed);
        let mut deaf = |noticing: &mut Noticing| {
            noticing.watcher = None;
            noticing.was_told.store(false, Ordering::Release);
            while changes.try_recv().is_ok() {}
            noticing.look();
            changes.try_recv().is_ok()
        };
        assert!(!deaf(&mut noticing), "nothing has changed");
        fs::write(v1.join("index.json"), "{}").unwrap();
        assert!(deaf(&mut noticing), "a file");
        assert!(!deaf(&mut noticing), "it is told once");
        fs::remove_file(&link).unwrap();
        assert!(!deaf(&mut noticing), "gone for now");
        symlink(&v2, &link).unwrap();
        assert!(deaf(&mut noticing), "the link");
        assert_eq!(noticing.last.as_ref().unwrap().folder, fs::canonicalize(&v2).unwrap());
        fs::write(v2.join("index.json"), "{}").unwrap();
        assert!(deaf(&mut noticing), "a file in the new folder");
    }
}
