//! What every route and session shares.

use std::{
    sync::Arc,
    sync::atomic::{AtomicU64, Ordering},
};

use papilla_proto::{ErrorCode, Problem};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};

use crate::{
    config::{Config, Timeouts},
    metrics::Metrics,
    models::Catalogue,
    pool::Entrance,
    problem,
};

/// The shared state.
pub(crate) struct App {
    pub(crate) catalogue: Arc<Catalogue>,
    pub(crate) metrics: Arc<Metrics>,
    pub(crate) entrance: Entrance,
    pub(crate) timeouts: Timeouts,
    /// True once the server drains. Whoever must be waited for holds a receiver.
    pub(crate) drain: Arc<watch::Sender<bool>>,
    sessions: Arc<Semaphore>,
    requests: Arc<Semaphore>,
    next_session: AtomicU64,
}

impl App {
    pub(crate) fn new(
        config: &Config,
        catalogue: Arc<Catalogue>,
        metrics: Arc<Metrics>,
        entrance: Entrance,
        drain: Arc<watch::Sender<bool>>,
    ) -> Self {
        Self {
            catalogue,
            metrics,
            entrance,
            timeouts: config.timeouts(),
            drain,
            sessions: Arc::new(Semaphore::new(config.max_sessions.get())),
            requests: Arc::new(Semaphore::new(config.max_requests.get())),
            next_session: AtomicU64::new(1),
        }
    }

    /// Whether new work is refused.
    pub(crate) fn is_draining(&self) -> bool {
        *self.drain.borrow()
    }

    /// A place for one session.
    ///
    /// # Errors
    /// All are taken, or the server drains.
    pub(crate) fn admit_session(&self) -> Result<OwnedSemaphorePermit, Problem> {
        self.admit(&self.sessions, "session")
    }

    /// A place for one posted map.
    ///
    /// # Errors
    /// All are taken, or the server drains.
    pub(crate) fn admit_request(&self) -> Result<OwnedSemaphorePermit, Problem> {
        self.admit(&self.requests, "request")
    }

    fn admit(&self, places: &Arc<Semaphore>, what: &str) -> Result<OwnedSemaphorePermit, Problem> {
        if self.is_draining() {
            return Err(problem::shutting_down());
        }
        Arc::clone(places).try_acquire_owned().map_err(|_| {
            let message = format!("every {what} place is taken; try again in a moment");
            Problem::new(ErrorCode::Overloaded, message)
        })
    }

    /// A number no other session of this run has.
    pub(crate) fn session_number(&self) -> u64 {
        self.next_session.fetch_add(1, Ordering::Relaxed)
    }

    /// Index of the tier called `name`.
    ///
    /// # Errors
    /// There is none.
    pub(crate) fn tier_named(&self, name: &str) -> Result<usize, Problem> {
        self.catalogue.find(name).ok_or_else(|| {
            let message = format!("no tier '{name}'; there are {}", self.catalogue.names());
            Problem::new(ErrorCode::UnknownTier, message).at("tier")
        })
    }
}

/// Waits for the drain to begin; at once if the server is gone.
pub(crate) async fn begun(drain: &mut watch::Receiver<bool>) {
    // The guard this returns holds a lock: let go of it before anything else.
    let _ = drain.wait_for(|drain| *drain).await.is_ok();
}
