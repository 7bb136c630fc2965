//! How tasks learn that the service drains: that it accepts nothing new and is about to end.

use tokio::sync::watch;

/// Waits for the drain to begin; at once if the server is gone.
pub(crate) async fn begun(drain: &mut watch::Receiver<bool>) {
    // The guard this returns holds a lock: let go of it before anything else.
    let _ = drain.wait_for(|drain| *drain).await.is_ok();
}
