//! Numeric factorization on a shared symbolic one.
//!
//! The usual factor is an f32 Cholesky that preconditions conjugate gradients
//! in f64: half the memory and time, and it stays useful while the tangent
//! drifts. Where the tangent is indefinite, `L B L^T` in f64 solves directly.

use super::structure::{Structure, SymmetricMatrix};
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{IntranodeLbltRef, LltRef};
use faer::{Conj, MatMut, Par, Side, Spec};

/// Why a factorization failed.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum FactorError {
    /// A pivot is not positive: the matrix is not positive definite.
    #[error("the tangent is not positive definite")]
    NotPositiveDefinite,
    /// Out of memory.
    #[error("out of memory: the factor needs {0} entries")]
    Memory(usize),
}

fn scratch(structure: &Structure) -> StackReq {
    let s = &structure.symbolic;
    s.factorize_numeric_llt_scratch::<f32>(Par::Seq, Spec::default())
        .or(s.factorize_numeric_intranode_lblt_scratch::<f64>(Par::Seq, Spec::default()))
        .or(s.solve_in_place_scratch::<f64>(1, Par::Seq))
}

/// Owns the memory of one numeric factor; re-used by every factorization.
pub struct Factorizer {
    single: Vec<f32>,
    single_matrix: Vec<f32>,
    double: Vec<f64>,
    subdiagonal: Vec<f64>,
    pivot: [Vec<usize>; 2],
    memory: MemBuffer,
    kind: Option<Kind>,
    right_hand_side: Vec<f32>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Cholesky,
    Lblt,
}

/// How a matrix was factorized.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Factor {
    /// f32 Cholesky: a preconditioner.
    Preconditioner,
    /// f64 `L B L^T` of an indefinite matrix: a direct solver.
    Indefinite,
}

impl Factorizer {
    /// Memory for factors on `structure`.
    ///
    /// # Errors
    /// [`FactorError::Memory`].
    pub fn new(structure: &Structure) -> Result<Self, FactorError> {
        let s = &structure.symbolic;
        let memory = MemBuffer::try_new(scratch(structure))
            .map_err(|_| FactorError::Memory(structure.factor_entries()))?;
        Ok(Self {
            single: vec![0.0; s.len_val()],
            single_matrix: vec![0.0; structure.row.len()],
            double: Vec::new(),
            subdiagonal: Vec::new(),
            pivot: [Vec::new(), Vec::new()],
            memory,
            kind: None,
            right_hand_side: vec![0.0; structure.equations.count],
        })
    }

    /// Memory that a factorizer takes on `structure`, bytes, with an f32 factor.
    #[must_use]
    pub fn bytes(structure: &Structure) -> usize {
        scratch(structure).unaligned_bytes_required()
            + 4 * (structure.factor_entries() + structure.row.len() + structure.equations.count)
    }

    /// What the held factor is, if there is one.
    #[must_use]
    pub fn held(&self) -> Option<Factor> {
        self.kind
            .map(|k| if k == Kind::Cholesky { Factor::Preconditioner } else { Factor::Indefinite })
    }

    /// Factorizes by f32 Cholesky.
    ///
    /// # Errors
    /// [`FactorError::NotPositiveDefinite`]; no factor is held then.
    pub fn cholesky(
        &mut self,
        structure: &Structure,
        matrix: &SymmetricMatrix,
    ) -> Result<(), FactorError> {
        for (s, v) in self.single_matrix.iter_mut().zip(&matrix.values) {
            *s = *v as f32;
        }
        self.kind = None;
        let result = structure.symbolic.factorize_numeric_llt(
            &mut self.single,
            structure.lower(&self.single_matrix),
            Side::Lower,
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut self.memory),
            Spec::default(),
        );
        result.map_err(|_| FactorError::NotPositiveDefinite)?;
        // An overflow or a NaN in the matrix passes the pivot test of some kernels.
        if self.single.iter().any(|v| !v.is_finite()) {
            return Err(FactorError::NotPositiveDefinite);
        }
        self.kind = Some(Kind::Cholesky);
        Ok(())
    }

    /// Factorizes an indefinite matrix as `L B L^T` in f64 (pivoting inside
    /// supernodes only).
    pub fn indefinite(&mut self, structure: &Structure, matrix: &SymmetricMatrix) {
        let n = structure.equations.count;
        self.double.resize(structure.symbolic.len_val(), 0.0);
        self.subdiagonal.resize(n, 0.0);
        for p in &mut self.pivot {
            p.resize(n, 0);
        }
        let [forward, inverse] = &mut self.pivot;
        structure.symbolic.factorize_numeric_intranode_lblt(
            &mut self.double,
            &mut self.subdiagonal,
            forward,
            inverse,
            structure.lower(&matrix.values),
            Side::Lower,
            Par::Seq,
            MemStack::new(&mut self.memory),
            Spec::default(),
        );
        self.kind = Some(Kind::Lblt);
    }

    /// A lower bound of the condition number of the matrix that was last factorized by
    /// Cholesky, from its factor's diagonal: `(max l / min l)^2`. A triangular matrix's least
    /// singular value is at most its least diagonal entry, its largest at least the largest.
    /// `None` without a Cholesky factor.
    #[must_use]
    pub fn condition_at_least(&self, structure: &Structure) -> Option<f64> {
        if self.kind != Some(Kind::Cholesky) {
            return None;
        }
        let (mut least, mut largest) = (f32::INFINITY, 0.0f32);
        structure.visit_diagonal(&mut |at| {
            least = least.min(self.single[at]);
            largest = largest.max(self.single[at]);
        });
        Some((f64::from(largest) / f64::from(least)).powi(2))
    }

    /// Solves in place with the held factor; without one, leaves `x` as it is.
    pub fn solve(&mut self, structure: &Structure, x: &mut [f64]) {
        let n = x.len();
        match self.kind {
            None => {}
            Some(Kind::Cholesky) => {
                // Scaled to unit size: f32 has a small range of exponents.
                let scale = x.iter().fold(0.0f64, |m, v| m.max(v.abs()));
                if scale == 0.0 {
                    return;
                }
                for (s, v) in self.right_hand_side.iter_mut().zip(&*x) {
                    *s = (*v / scale) as f32;
                }
                LltRef::new(&structure.symbolic, &self.single).solve_in_place_with_conj(
                    Conj::No,
                    MatMut::from_column_major_slice_mut(&mut self.right_hand_side, n, 1),
                    Par::Seq,
                    MemStack::new(&mut self.memory),
                );
                for (s, v) in self.right_hand_side.iter().zip(x) {
                    *v = f64::from(*s) * scale;
                }
            }
            Some(Kind::Lblt) => {
                let [forward, inverse] = &self.pivot;
                IntranodeLbltRef::new(
                    &structure.symbolic,
                    &self.double,
                    &self.subdiagonal,
                    PermRef::new_checked(forward, inverse, n),
                )
                .solve_in_place_with_conj(
                    Conj::No,
                    MatMut::from_column_major_slice_mut(x, n, 1),
                    Par::Seq,
                    MemStack::new(&mut self.memory),
                );
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::ElementKind;
    use crate::linear::Elimination;
    use crate::mesh::lattice::cube;
    use crate::mesh::supports::hold;

    #[test]
    fn the_condition_of_a_diagonal_matrix_is_exact() {
        use Elimination::{CuthillMckee, Natural, NestedDissection};
        // Few unknowns are factorized simplicially, many by supernodes.
        for (cells, elimination) in [
            (1, Natural),
            (2, CuthillMckee),
            (6, Natural),
            (6, CuthillMckee),
            (6, NestedDissection),
        ] {
            let mesh = cube(ElementKind::Hex8, cells, |p| p);
            let fixed = hold(&mesh, &[("z_min", [true; 3])]);
            let structure = Structure::eliminated(&mesh, &fixed, elimination).unwrap();
            let mut matrix = structure.zeros();
            let count = structure.equations.count;
            for c in 0..count {
                matrix.values[structure.column_start[c]] = 1.0 + c as f64;
            }
            let mut factorizer = Factorizer::new(&structure).unwrap();
            assert_eq!(factorizer.condition_at_least(&structure), None);
            factorizer.cholesky(&structure, &matrix).unwrap();
            let found = factorizer.condition_at_least(&structure).unwrap();
            assert!((found / count as f64 - 1.0).abs() < 1e-5, "{found} {count}");
        }
    }
}
