//! The model of a tier, which may not be loaded until a client names the tier.

use std::{
    sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError},
    time::{Duration, Instant},
};

use papilla_engine::Model;
use papilla_proto::Problem;

/// Time after a failure in which a model, or a finger, is not loaded again. Whoever names it in that
/// time gets the same error.
pub(crate) const RETRY_AFTER: Duration = Duration::from_secs(10);

/// A model, once it is loaded.
#[derive(Default)]
pub(crate) struct Held {
    model: OnceLock<Arc<dyn Model>>,
    failed: Mutex<Option<(Instant, Problem)>>,
}

impl Held {
    /// A model that is loaded already.
    pub(crate) fn loaded(model: Arc<dyn Model>) -> Arc<Self> {
        Arc::new(Self { model: OnceLock::from(model), failed: Mutex::default() })
    }

    /// The model; None while it is not loaded.
    pub(crate) fn model(&self) -> Option<&Arc<dyn Model>> {
        self.model.get()
    }

    /// Makes the model available. Every inference thread must have a session of it, or get one
    /// before its next job.
    pub(crate) fn open(&self, model: Arc<dyn Model>) {
        // Fails if it was set before, which was with the same model.
        let _ = self.model.set(model);
    }

    /// The problem of the last attempt, if that failed less than [`RETRY_AFTER`] ago.
    pub(crate) fn failed_lately(&self) -> Option<Problem> {
        let failed = self.failed();
        let (when, problem) = failed.as_ref()?;
        (when.elapsed() < RETRY_AFTER).then(|| problem.clone())
    }

    /// Notes that it could not be loaded.
    pub(crate) fn fail(&self, problem: Problem) {
        *self.failed() = Some((Instant::now(), problem));
    }

    /// Forgets a failure, so that loading may be tried again at once.
    pub(crate) fn forgive(&self) {
        *self.failed() = None;
    }

    fn failed(&self) -> MutexGuard<'_, Option<(Instant, Problem)>> {
        // The value is only ever replaced as a whole, so a poisoned lock is usable.
        self.failed.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
