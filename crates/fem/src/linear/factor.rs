//! Numeric factorization on a shared symbolic one.
//!
//! The usual factor is an f32 Cholesky that preconditions conjugate gradients
//! in f64: half the memory and time, and it stays useful while the tangent
//! drifts. Where the tangent is indefinite, `L B L^T` in f64 solves directly.

use super::symbolic::{SymbolicSystem, SymmetricMatrix};
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
    /// A pivot vanishes.
    #[error("the system of displacement and fluid pressure is singular")]
    Singular,
    /// Out of memory.
    #[error("out of memory: the factor needs {0} entries")]
    Memory(usize),
}

fn scratch(system: &SymbolicSystem) -> StackReq {
    let s = &system.symbolic;
    s.factorize_numeric_llt_scratch::<f32>(Par::Seq, Spec::default())
        .or(s.factorize_numeric_intranode_lblt_scratch::<f64>(Par::Seq, Spec::default()))
        .or(s.solve_in_place_scratch::<f64>(1, Par::Seq))
}

/// Memory for one numeric factor. It becomes a [`NumericFactor`] and comes back from it
/// ([`NumericFactor::release`]): to factorize anew allocates nothing. Nothing can be solved with
/// it.
pub struct FactorMemory(Box<Buffers>);

struct Buffers {
    single: Vec<f32>,
    single_matrix: Vec<f32>,
    double: Vec<f64>,
    subdiagonal: Vec<f64>,
    pivot: [Vec<usize>; 2],
    scratch: MemBuffer,
    right_hand_side: Vec<f32>,
}

impl FactorMemory {
    /// Memory for factors on `structure`.
    ///
    /// # Errors
    /// [`FactorError::Memory`].
    pub fn new(system: &SymbolicSystem) -> Result<Self, FactorError> {
        let scratch = MemBuffer::try_new(scratch(system))
            .map_err(|_| FactorError::Memory(system.factor_entries()))?;
        Ok(Self(Box::new(Buffers {
            single: vec![0.0; system.symbolic.len_val()],
            single_matrix: vec![0.0; system.row.len()],
            double: Vec::new(),
            subdiagonal: Vec::new(),
            pivot: [Vec::new(), Vec::new()],
            scratch,
            right_hand_side: vec![0.0; system.dofs.count],
        })))
    }

    /// What it takes on `structure`, bytes, with an f32 factor.
    #[must_use]
    pub fn bytes(system: &SymbolicSystem) -> usize {
        scratch(system).unaligned_bytes_required()
            + 4 * (system.factor_entries() + system.row.len() + system.dofs.count)
    }

    /// Factorizes by f32 Cholesky.
    ///
    /// # Errors
    /// Gives the memory back where the matrix is not positive definite.
    pub fn cholesky(
        mut self,
        system: &SymbolicSystem,
        matrix: &SymmetricMatrix,
    ) -> Result<NumericFactor, Self> {
        for (s, v) in self.0.single_matrix.iter_mut().zip(&matrix.values) {
            *s = *v as f32;
        }
        self.cholesky_of_held(system)
    }

    /// Factorizes again what [`NumericFactor::matrix`] gave: the same bits.
    ///
    /// # Errors
    /// Gives the memory back where the matrix is not positive definite or of another length.
    pub fn cholesky_again(
        mut self,
        system: &SymbolicSystem,
        matrix: &[f32],
    ) -> Result<NumericFactor, Self> {
        if matrix.len() != self.0.single_matrix.len() {
            return Err(self);
        }
        self.0.single_matrix.copy_from_slice(matrix);
        self.cholesky_of_held(system)
    }

    fn cholesky_of_held(mut self, system: &SymbolicSystem) -> Result<NumericFactor, Self> {
        let b = &mut *self.0;
        let result = system.symbolic.factorize_numeric_llt(
            &mut b.single,
            system.lower(&b.single_matrix),
            Side::Lower,
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut b.scratch),
            Spec::default(),
        );
        // An overflow or a NaN in the matrix passes the pivot test of some kernels.
        if result.is_err() || b.single.iter().any(|v| !v.is_finite()) {
            return Err(self);
        }
        Ok(NumericFactor { kind: FactorKind::Preconditioner, buffers: self.0 })
    }

    /// Factorizes an indefinite matrix as `L B L^T` in f64 (pivoting inside
    /// supernodes only).
    #[must_use]
    pub fn indefinite(
        mut self,
        system: &SymbolicSystem,
        matrix: &SymmetricMatrix,
    ) -> NumericFactor {
        let n = system.dofs.count;
        let b = &mut *self.0;
        b.double.resize(system.symbolic.len_val(), 0.0);
        b.subdiagonal.resize(n, 0.0);
        for p in &mut b.pivot {
            p.resize(n, 0);
        }
        let [forward, inverse] = &mut b.pivot;
        system.symbolic.factorize_numeric_intranode_lblt(
            &mut b.double,
            &mut b.subdiagonal,
            forward,
            inverse,
            system.lower(&matrix.values),
            Side::Lower,
            Par::Seq,
            MemStack::new(&mut b.scratch),
            Spec::default(),
        );
        NumericFactor { kind: FactorKind::Indefinite, buffers: self.0 }
    }
}

impl Default for FactorMemory {
    /// None at all: what stands where memory has been taken from. To factorize with it panics.
    fn default() -> Self {
        Self(Box::new(Buffers {
            single: Vec::new(),
            single_matrix: Vec::new(),
            double: Vec::new(),
            subdiagonal: Vec::new(),
            pivot: [Vec::new(), Vec::new()],
            scratch: MemBuffer::new(StackReq::EMPTY),
            right_hand_side: Vec::new(),
        }))
    }
}

/// How a matrix was factorized.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FactorKind {
    /// f32 Cholesky: a preconditioner.
    Preconditioner,
    /// f64 `L B L^T` of an indefinite matrix: a direct solver.
    Indefinite,
}

/// A factorized matrix.
pub struct NumericFactor {
    kind: FactorKind,
    buffers: Box<Buffers>,
}

impl NumericFactor {
    /// How the matrix was factorized.
    #[must_use]
    pub const fn kind(&self) -> FactorKind {
        self.kind
    }

    /// The entries that a preconditioner is the factor of.
    #[must_use]
    pub fn matrix(&self) -> Option<&[f32]> {
        (self.kind == FactorKind::Preconditioner).then_some(&self.buffers.single_matrix)
    }

    /// Gives the factor up for its memory.
    #[must_use]
    pub fn release(self) -> FactorMemory {
        FactorMemory(self.buffers)
    }

    /// A lower bound of the condition number of a matrix factorized by Cholesky, from its
    /// factor's diagonal: `(max l / min l)^2`. A triangular matrix's least
    /// singular value is at most its least diagonal entry, its largest at least the largest.
    /// `None` for an indefinite matrix.
    #[must_use]
    pub fn condition_at_least(&self, system: &SymbolicSystem) -> Option<f64> {
        if self.kind != FactorKind::Preconditioner {
            return None;
        }
        let (mut least, mut largest) = (f32::INFINITY, 0.0f32);
        system.visit_diagonal(&mut |at| {
            least = least.min(self.buffers.single[at]);
            largest = largest.max(self.buffers.single[at]);
        });
        Some((f64::from(largest) / f64::from(least)).powi(2))
    }

    /// Solves in place.
    pub fn solve(&mut self, system: &SymbolicSystem, x: &mut [f64]) {
        let n = x.len();
        let b = &mut *self.buffers;
        match self.kind {
            FactorKind::Preconditioner => {
                // Scaled to unit size: f32 has a small range of exponents.
                let scale = x.iter().fold(0.0f64, |m, v| m.max(v.abs()));
                if scale == 0.0 {
                    return;
                }
                for (s, v) in b.right_hand_side.iter_mut().zip(&*x) {
                    *s = (*v / scale) as f32;
                }
                LltRef::new(&system.symbolic, &b.single).solve_in_place_with_conj(
                    Conj::No,
                    MatMut::from_column_major_slice_mut(&mut b.right_hand_side, n, 1),
                    Par::Seq,
                    MemStack::new(&mut b.scratch),
                );
                for (s, v) in b.right_hand_side.iter().zip(x) {
                    *v = f64::from(*s) * scale;
                }
            }
            FactorKind::Indefinite => {
                let [forward, inverse] = &b.pivot;
                IntranodeLbltRef::new(
                    &system.symbolic,
                    &b.double,
                    &b.subdiagonal,
                    PermRef::new_checked(forward, inverse, n),
                )
                .solve_in_place_with_conj(
                    Conj::No,
                    MatMut::from_column_major_slice_mut(x, n, 1),
                    Par::Seq,
                    MemStack::new(&mut b.scratch),
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
            let system = SymbolicSystem::eliminated(&mesh, &fixed, elimination).unwrap();
            let mut matrix = system.zeros();
            let count = system.dofs.count;
            for c in 0..count {
                matrix.values[system.column_start[c]] = 1.0 + c as f64;
            }
            let memory = FactorMemory::new(&system).unwrap();
            let Ok(factor) = memory.cholesky(&system, &matrix) else { panic!("it is definite") };
            let found = factor.condition_at_least(&system).unwrap();
            assert!((found / count as f64 - 1.0).abs() < 1e-5, "{found} {count}");
        }
    }

    /// The memory of a failed try, and of a factor that is given up, serves the next.
    #[test]
    fn memory_goes_from_try_to_try() {
        let mesh = cube(ElementKind::Hex8, 2, |p| p);
        let fixed = hold(&mesh, &[("z_min", [true; 3])]);
        let system = SymbolicSystem::new(&mesh, &fixed).unwrap();
        let mut matrix = system.zeros();
        let count = system.dofs.count;
        let diagonal = |matrix: &mut SymmetricMatrix, value: &dyn Fn(usize) -> f64| {
            for c in 0..count {
                matrix.values[system.column_start[c]] = value(c);
            }
        };
        let solved = |factor: &mut NumericFactor| {
            let mut x = vec![1.0; count];
            factor.solve(&system, &mut x);
            x
        };
        diagonal(&mut matrix, &|c| if c == 1 { -2.0 } else { 1.0 + c as f64 });
        let memory = FactorMemory::new(&system).unwrap();
        let Err(memory) = memory.cholesky(&system, &matrix) else { panic!("it is indefinite") };
        let mut factor = memory.indefinite(&system, &matrix);
        assert_eq!(factor.kind(), FactorKind::Indefinite);
        assert_eq!(factor.condition_at_least(&system), None);
        assert!((solved(&mut factor)[1] + 0.5).abs() < 1e-12);
        diagonal(&mut matrix, &|_| 4.0);
        let Ok(mut factor) = factor.release().cholesky(&system, &matrix) else {
            panic!("it is definite")
        };
        assert_eq!(factor.kind(), FactorKind::Preconditioner);
        assert!(solved(&mut factor).iter().all(|x| (x - 0.25).abs() < 1e-6));
    }
}
