//! A solver between two equilibria, to go on from in another process.

use super::newton::Preconditioner;
use super::state::{Mark, State};
use super::stepping::Solver;
use serde::{Deserialize, Serialize};

/// All that the equilibria to come depend on, beside problem and loading: where the body is, what
/// work was done, and the factor that preconditions. A solver that resumes from it finds the same
/// bits as one that was never stopped.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Snapshot {
    mark: Mark,
    time_step: Option<f64>,
    preconditioner: Preconditioner,
}

/// A snapshot does not fit the solver.
#[derive(Clone, Copy, Debug, thiserror::Error, PartialEq, Eq)]
#[error("the stored state is of another mesh, loading or program: remove it to start over")]
pub struct SnapshotError;

impl Solver<'_> {
    /// Everything to go on from here with [`Self::resume`].
    #[must_use]
    pub fn snapshot(&self) -> Snapshot {
        Snapshot {
            mark: self.mark(),
            time_step: self.time_step,
            preconditioner: self.newton.preconditioner(),
        }
    }

    /// Goes on from a snapshot of the loading that was just [started](Self::start).
    ///
    /// # Errors
    /// [`SnapshotError`] where it is of another problem; the solver has to be started again then.
    pub fn resume(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let fits = |s: &State| {
            s.u.len() == self.state.u.len()
                && s.independent.len() == self.state.independent.len()
                && s.multipliers.len() == self.state.multipliers.len()
                && s.history.len() == self.state.history.len()
                && s.friction.points.len() == self.state.friction.points.len()
                && s.fluid.as_ref().map(|f| f.pressure_mpa.len())
                    == self.state.fluid.as_ref().map(|f| f.pressure_mpa.len())
        };
        let Snapshot { mark, time_step, preconditioner } = snapshot;
        if !fits(&mark.state)
            || !mark.before.iter().all(fits)
            || !self.newton.precondition(preconditioner)
        {
            return Err(SnapshotError);
        }
        self.restore(mark);
        self.time_step = *time_step;
        self.settle();
        Ok(())
    }
}
