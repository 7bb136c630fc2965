//! Reloading when the folder of models changes.

mod look;
mod notice;

use std::{io, path::Path, sync::Arc, sync::mpsc as threads, time::Duration};

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

/// Watches where `folder` leads until the drain begins.
///
/// # Errors
/// The thread that looks cannot be started.
pub(crate) fn watch(reloader: Arc<Reloader>, folder: &Path) -> io::Result<()> {
    // One place is enough: it says that something has changed since it was last emptied.
    let (changed, changes) = mpsc::channel(1);
    let (looking, stop) = threads::channel();
    notice::start(folder, changed, Arc::clone(&reloader.metrics), stop)?;
    tokio::spawn(follow(reloader, changes, looking));
    Ok(())
}

async fn follow(
    reloader: Arc<Reloader>,
    mut changes: mpsc::Receiver<()>,
    looking: threads::Sender<()>,
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
    // The thread that looks ends with it.
    drop(looking);
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
