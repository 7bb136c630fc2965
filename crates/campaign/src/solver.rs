//! The solver of a simulation as the campaign sees it, and the options of a run.

use crate::state::IndentationState;
use crate::{Checkpoints, PressError};
use papilla_dataset::Sample;
use papilla_fingertip::campaign::{Indentation, Slice};
use std::num::NonZero;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

/// Solves one indentation after another; each worker thread has its own.
pub trait IndentationSolver {
    /// Indentations to each of the depths and returns one equilibrium per depth, with
    /// values at the vertices of the campaign's atlas. Equal indentations have to give
    /// equal records (`seconds` apart), whatever was solved before and wherever `checkpoints`
    /// let it begin.
    ///
    /// # Errors
    /// [`PressError::Failed`]: what did not converge and where; it is recorded in the manifest.
    fn solve(
        &mut self,
        press: &Indentation,
        checkpoints: &mut Checkpoints<'_>,
    ) -> Result<Vec<Sample>, PressError>;
}

/// How far a run is. The numbers only grow.
#[derive(Debug, Default)]
pub struct Count {
    due: AtomicUsize,
    done: AtomicUsize,
    failed: AtomicUsize,
}

impl Count {
    pub(crate) fn begin(&self, due: usize, known: &[IndentationState]) {
        self.due.store(due, Ordering::Relaxed);
        known.iter().for_each(|state| self.settle(state));
    }

    pub(crate) fn settle(&self, state: &IndentationState) {
        self.done.fetch_add(1, Ordering::Relaxed);
        self.failed.fetch_add(usize::from(state.is_failed()), Ordering::Relaxed);
    }

    /// Indentations of the slice; 0 until they have been planned.
    pub fn due(&self) -> usize {
        self.due.load(Ordering::Relaxed)
    }

    /// Of those, the ones that are solved or failed, in this run or before.
    pub fn done(&self) -> usize {
        self.done.load(Ordering::Relaxed)
    }

    /// Of those, the ones that failed.
    pub fn failed(&self) -> usize {
        self.failed.load(Ordering::Relaxed)
    }
}

/// How to run, as opposed to what.
#[derive(Clone, Debug)]
pub struct RunOptions {
    /// The part of the campaign.
    pub slice: Slice,
    /// Indentations solved at a time; `None`: one per core.
    pub threads: Option<NonZero<usize>>,
    /// Show on standard error how far it is.
    pub progress: bool,
    /// How far it is, for whoever asks while it runs.
    pub count: Arc<Count>,
    /// Try indentations again that failed in an earlier run.
    pub retry_failed: bool,
    /// Once it is true, every indentation is stored where it stands and the run ends.
    pub stop: Arc<AtomicBool>,
    /// How often to store where an indentation stands without being asked.
    pub checkpoint_every: Duration,
}

impl Default for RunOptions {
    fn default() -> Self {
        Self {
            slice: Slice::WHOLE,
            threads: None,
            progress: true,
            count: Arc::default(),
            retry_failed: true,
            stop: Arc::default(),
            checkpoint_every: Duration::from_secs(300),
        }
    }
}
