//! The threads that move bytes.

use std::{
    io,
    sync::{
        atomic::{AtomicUsize, Ordering},
        mpsc::sync_channel,
    },
    time::Duration,
};

use tokio::runtime::{Builder, EnterGuard, Handle, Runtime};

use crate::priority::{Priorities, Role};

/// However few cores there are: one slow turn never stops all sessions.
const THREADS: usize = 2;

/// Threads for work that would hold one of those up, each of it bounded in number elsewhere.
const BLOCKING_MAX: usize = 16;

/// Turns of tasks between two looks at what the system has ready. A turn of a session is bounded
/// (`session::limits`), and this many of them are what a quiet session waits beside busy ones.
const TURNS_BETWEEN_POLLS: u32 = 7;

/// Longest wait for the system to start a thread.
const START_MAX: Duration = Duration::from_secs(10);

/// A tokio runtime of the service's own. Whoever starts and drains the service waits elsewhere, and
/// so is not starved by clients.
pub(crate) struct IoRuntime {
    handle: Handle,
    /// Taken out when it is dropped.
    runtime: Option<Runtime>,
}

impl IoRuntime {
    /// Starts the threads; returns once each has its place among the others.
    ///
    /// # Errors
    /// The system starts none.
    pub(crate) fn start(priorities: &Priorities) -> io::Result<Self> {
        let (priorities, count) = (priorities.clone(), AtomicUsize::new(0));
        let (report, reports) = sync_channel(THREADS);
        // The first threads are those that move bytes: nobody can ask for another kind before this
        // returns.
        let enter = move || {
            if count.fetch_add(1, Ordering::Relaxed) < THREADS {
                priorities.enter(Role::Reading);
                let _ = report.try_send(());
            } else {
                priorities.enter(Role::Other);
            }
        };
        let runtime = Builder::new_multi_thread()
            .worker_threads(THREADS)
            .max_blocking_threads(BLOCKING_MAX)
            .event_interval(TURNS_BETWEEN_POLLS)
            .thread_name("papilla-io")
            .on_thread_start(enter)
            .enable_all()
            .build()?;
        for _ in 0..THREADS {
            reports.recv_timeout(START_MAX).map_err(io::Error::other)?;
        }
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
