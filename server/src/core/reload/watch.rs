//! Reloading when the folder of models changes.

use std::{path::Path, sync::Arc, time::Duration};

use notify::{
    Event, EventKind, RecommendedWatcher, RecursiveMode, Watcher,
    event::{AccessKind, AccessMode},
};
use tokio::{
    sync::mpsc,
    task::spawn_blocking,
    time::{Instant, timeout},
};

use super::{Reloader, Turn};
use crate::drain::begun;

/// A folder must be quiet for so long: files are copied one after the other.
const QUIET: Duration = Duration::from_millis(700);

/// A folder that never gets quiet is read after so long all the same.
const WAIT_MAX: Duration = Duration::from_secs(10);

/// Watches `folder` until the drain begins.
///
/// # Errors
/// The system cannot watch it.
pub(crate) fn watch(reloader: Arc<Reloader>, folder: &Path) -> notify::Result<()> {
    // One place is enough: it says that something has changed since it was last emptied.
    let (changed, changes) = mpsc::channel(1);
    let mut watcher = notify::recommended_watcher(move |event: notify::Result<Event>| {
        // An error is a lost event: better to look.
        if event.map_or(true, |event| is_change(event.kind)) {
            let _ = changed.try_send(());
        }
    })?;
    watcher.watch(folder, RecursiveMode::NonRecursive)?;
    tokio::spawn(follow(reloader, changes, watcher));
    Ok(())
}

/// Reading a file is an event too, and a reload reads them all.
fn is_change(kind: EventKind) -> bool {
    match kind {
        EventKind::Access(kind) => matches!(kind, AccessKind::Close(AccessMode::Write)),
        _ => true,
    }
}

async fn follow(
    reloader: Arc<Reloader>,
    mut changes: mpsc::Receiver<()>,
    watcher: RecommendedWatcher,
) {
    loop {
        // Held no longer than the wait: a drain waits for whoever holds one.
        let mut drain = reloader.drain.subscribe();
        tokio::select! {
            () = begun(&mut drain) => break,
            change = changes.recv() => if change.is_none() { break },
        }
        drop(drain);
        let first = Instant::now();
        while first.elapsed() < WAIT_MAX
            && matches!(timeout(QUIET, changes.recv()).await, Ok(Some(())))
        {}
        once(Arc::clone(&reloader)).await;
    }
    // It lives as long as the loop.
    drop(watcher);
}

/// Loads the models anew once it is its turn, unless the drain begins before. What came of it is in
/// the log and in the metrics.
pub(crate) async fn once(reloader: Arc<Reloader>) {
    if let Some(turn) = turn(&reloader).await {
        // Err: it panicked, and the log says so.
        let _ = spawn_blocking(move || reloader.reload(turn)).await;
    }
}

/// The turn to reload: the one under way may have read the folder before it changed. None: the
/// drain began.
async fn turn(reloader: &Reloader) -> Option<Turn> {
    match reloader.try_begin() {
        Ok(turn) => Some(turn),
        Err(busy) => {
            tracing::info!("{busy}; the folder is read again after it");
            let mut drain = reloader.drain.subscribe();
            tokio::select! {
                () = begun(&mut drain) => None,
                turn = reloader.begin() => Some(turn),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reading_is_no_change() {
        assert!(!is_change(EventKind::Access(AccessKind::Open(AccessMode::Any))));
        assert!(!is_change(EventKind::Access(AccessKind::Close(AccessMode::Read))));
        assert!(is_change(EventKind::Access(AccessKind::Close(AccessMode::Write))));
        assert!(is_change(EventKind::Any));
    }
}
