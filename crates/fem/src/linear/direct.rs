//! A direct solver for many right-hand sides: one f64 Cholesky factor, blocks of
//! columns.
//!
//! A solve reads the whole factor once, whatever the number of columns, so a block of
//! some tens costs little more than one. It takes twice the memory of the f32 factor
//! that preconditions an indentation, and is accurate to rounding without iteration.

use super::FactorError;
use super::symbolic::{SymbolicSystem, SymmetricMatrix};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::cholesky::LltRef;
use faer::{Conj, MatMut, Par, Side, Spec};

/// An f64 Cholesky factor and memory for solving `columns_max` systems at a time.
pub struct Direct<'a> {
    system: &'a SymbolicSystem,
    factor: Vec<f64>,
    memory: MemBuffer,
    columns_max: usize,
}

impl<'a> Direct<'a> {
    /// Factorizes `matrix`, whose pattern is that of `structure`.
    ///
    /// # Errors
    /// [`FactorError::NotPositiveDefinite`], or [`FactorError::Memory`].
    pub fn new(
        system: &'a SymbolicSystem,
        matrix: &SymmetricMatrix,
        columns_max: usize,
    ) -> Result<Self, FactorError> {
        let s = &system.symbolic;
        let scratch = s
            .factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default())
            .or(s.solve_in_place_scratch::<f64>(columns_max, Par::Seq));
        let too_large = |_| FactorError::Memory(system.factor_entries());
        let mut memory = MemBuffer::try_new(scratch).map_err(too_large)?;
        let mut factor = vec![0.0; s.len_val()];
        s.factorize_numeric_llt(
            &mut factor,
            system.lower(&matrix.values),
            Side::Lower,
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut memory),
            Spec::default(),
        )
        .map_err(|_| FactorError::NotPositiveDefinite)?;
        // A NaN in the matrix passes the pivot test of some kernels.
        if factor.iter().any(|v| !v.is_finite()) {
            return Err(FactorError::NotPositiveDefinite);
        }
        Ok(Self { system, factor, memory, columns_max })
    }

    /// Solves in place: `x` holds up to `columns_max` right-hand sides, one after the
    /// other, and then their solutions.
    pub fn solve(&mut self, x: &mut [f64]) {
        let n = self.system.dofs.count;
        for block in x.chunks_mut(n * self.columns_max) {
            let columns = block.len() / n;
            LltRef::new(&self.system.symbolic, &self.factor).solve_in_place_with_conj(
                Conj::No,
                MatMut::from_column_major_slice_mut(block, n, columns),
                Par::Seq,
                MemStack::new(&mut self.memory),
            );
        }
    }
}
