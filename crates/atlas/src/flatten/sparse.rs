//! Symmetric positive definite systems on `faer`.

use super::FlattenError;
use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMat, Triplet};
use faer::{MatMut, Side};

/// One entry of the lower triangle; entries at one place add up.
pub(super) type Entry = Triplet<usize, usize, f64>;

/// Factors matrices that all have the pattern of the first.
pub(super) struct Cholesky {
    step: &'static str,
    size: usize,
    symbolic: Option<SymbolicLlt<usize>>,
}

/// A factored matrix.
pub(super) struct Factor {
    size: usize,
    llt: Llt<usize, f64>,
}

impl Cholesky {
    /// For `size` unknowns; `step` names the system in errors.
    pub(super) fn new(step: &'static str, size: usize) -> Self {
        Self { step, size, symbolic: None }
    }

    /// Factors the matrix whose lower triangle is given.
    pub(super) fn factor(&mut self, lower: &[Entry]) -> Result<Factor, FlattenError> {
        let fail = |reason: String| FlattenError::Linear { step: self.step, reason };
        let matrix = SparseColMat::try_new_from_triplets(self.size, self.size, lower)
            .map_err(|e| fail(format!("{e:?}")))?;
        let symbolic = match &self.symbolic {
            Some(symbolic) => symbolic.clone(),
            None => SymbolicLlt::try_new(matrix.symbolic(), Side::Lower)
                .map_err(|e| fail(format!("{e:?}")))?,
        };
        let llt = Llt::try_new_with_symbolic(symbolic.clone(), matrix.as_ref(), Side::Lower)
            .map_err(|e| fail(format!("{e:?}")))?;
        self.symbolic = Some(symbolic);
        Ok(Factor { size: self.size, llt })
    }
}

impl Factor {
    /// Overwrites the right-hand side with the solution.
    pub(super) fn solve_in_place(&self, right: &mut [f64]) {
        self.llt.solve_in_place(MatMut::from_column_major_slice_mut(right, self.size, 1));
    }
}
