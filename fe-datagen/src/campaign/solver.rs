//! The solver of a simulation as the campaign sees it, and the options of a run.

use super::{Checkpoints, PressError};
use papilla_dataset::Sample;
use papilla_fingertip::campaign::{Indentation, Slice};
use std::num::NonZero;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
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

/// How to run, as opposed to what.
#[derive(Clone, Debug)]
pub struct RunOptions {
    /// The part of the campaign.
    pub slice: Slice,
    /// Indentations solved at a time; `None`: one per core.
    pub threads: Option<NonZero<usize>>,
    /// Show on standard error how far it is.
    pub progress: bool,
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
            retry_failed: true,
            stop: Arc::default(),
            checkpoint_every: Duration::from_secs(300),
        }
    }
}
