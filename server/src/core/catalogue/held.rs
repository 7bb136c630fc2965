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
    /// A model that is there.
    pub(crate) fn loaded(model: Arc<dyn Model>) -> Arc<Self> {
        Arc::new(Self { model: OnceLock::from(model), failed: Mutex::default() })
    }

    /// The model; none before its first use.
    pub(crate) fn model(&self) -> Option<&Arc<dyn Model>> {
        self.model.get()
    }

    /// From here on the model answers: every thread has a session of it.
    pub(crate) fn open(&self, model: Arc<dyn Model>) {
        // Err: it is there already, and is the same.
        let _ = self.model.set(model);
    }

    /// Why it could not be loaded a moment ago.
    pub(crate) fn failed_lately(&self) -> Option<Problem> {
        let failed = self.failed();
        let (when, problem) = failed.as_ref()?;
        (when.elapsed() < RETRY_AFTER).then(|| problem.clone())
    }

    /// It could not be loaded.
    pub(crate) fn fail(&self, problem: Problem) {
        *self.failed() = Some((Instant::now(), problem));
    }

    /// It may be tried again at once.
    pub(crate) fn forgive(&self) {
        *self.failed() = None;
    }

    fn failed(&self) -> MutexGuard<'_, Option<(Instant, Problem)>> {
        // What is written is written whole, so a poisoned lock is usable.
        self.failed.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
