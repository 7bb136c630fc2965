//! The threads that move bytes.

use std::io;

use tokio::runtime::{Builder, EnterGuard, Handle, Runtime};

/// However few cores there are: one slow turn never stops all sessions.
const THREADS: usize = 2;

/// Turns of tasks between two looks at what the system has ready. A turn of a session is bounded
/// (`session::limits`), and this many of them are what a quiet session waits beside busy ones.
const TURNS_BETWEEN_POLLS: u32 = 7;

/// A tokio runtime of the service's own. Whoever starts and drains the service waits elsewhere, and
/// so is not starved by clients.
pub(crate) struct IoRuntime {
    handle: Handle,
    /// Taken out when it is dropped.
    runtime: Option<Runtime>,
}

impl IoRuntime {
    pub(crate) fn start() -> io::Result<Self> {
        let runtime = Builder::new_multi_thread()
            .worker_threads(THREADS)
            .event_interval(TURNS_BETWEEN_POLLS)
            .thread_name("papilla-io")
            .enable_all()
            .build()?;
        Ok(Self { handle: runtime.handle().clone(), runtime: Some(runtime) })
    }

    /// What is opened while the guard lives belongs to these threads.
    pub(crate) fn enter(&self) -> EnterGuard<'_> {
        self.handle.enter()
    }

    /// Where tasks are run.
    pub(crate) fn handle(&self) -> &Handle {
        &self.handle
    }
}

impl Drop for IoRuntime {
    fn drop(&mut self) {
        // A runtime that is dropped waits for its threads, which no async caller may.
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}
