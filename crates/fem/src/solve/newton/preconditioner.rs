//! The factor that is carried from one equilibrium to the next, as what it can be made of again.

use super::{Held, Newton};
use serde::{Deserialize, Serialize};

/// What decides how the next linear systems are solved.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(in crate::solve) struct Preconditioner {
    /// Entries whose factor preconditions; `None`: the next system is factorized afresh.
    matrix: Option<Vec<f32>>,
    condition: f64,
}

impl Newton<'_> {
    pub(in crate::solve) fn preconditioner(&self) -> Preconditioner {
        let matrix = match &self.held {
            Held::Factor(factor) if !self.stale => factor.matrix().map(<[f32]>::to_vec),
            _ => None,
        };
        Preconditioner { matrix, condition: self.condition }
    }

    /// Makes the factor again; `false` if the entries are not of this problem.
    pub(in crate::solve) fn precondition(&mut self, by: &Preconditioner) -> bool {
        self.condition = by.condition;
        self.stale = by.matrix.is_none();
        let Some(matrix) = &by.matrix else { return true };
        let memory = self.held.take().release();
        let made = memory.cholesky_again(&self.problem.system, matrix);
        self.stale = made.is_err();
        self.held = match made {
            Ok(factor) => Held::Factor(factor),
            Err(memory) => Held::Memory(memory),
        };
        !self.stale
    }
}
