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

/// How long nothing may change in a folder before it is read, since files are copied one after
/// another.
const QUIET: Duration = Duration::from_millis(700);

/// After this time a folder is read even if it goes on changing.
const WAIT_MAX: Duration = Duration::from_secs(10);

/// Watches the folder that the path `folder` leads to, until the drain begins.
///
/// # Errors
/// The watching thread cannot be started.
pub(crate) fn watch(reloader: Arc<Reloader>, folder: &Path) -> io::Result<()> {
    // A capacity of one is enough: a message means that something has changed since the last one
    // was received.
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
        // Dropped right after the wait, since a drain waits until nobody holds a receiver.
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
    // This ends the watching thread.
    drop(looking);
}

/// Reloads the models when it is its turn, unless the drain begins before. The result is in the log
/// and in the metrics.
pub(crate) async fn once(reloader: Arc<Reloader>) {
    if let Some(turn) = turn(&reloader).await {
        // Fails if the reload panicked, which the log shows.
        let _ = spawn_blocking(move || reloader.reload(turn)).await;
    }
}

/// Waits for the turn to reload. A reload that is under way may have read the folder before it
/// changed, so another follows. None: the drain began.
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
