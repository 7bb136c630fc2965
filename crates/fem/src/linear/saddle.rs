//! Symmetric saddle-point systems of displacement and pressure, solved directly.
//!
//! `[A B^T; B -C]` with A positive definite and C at least semi-definite is quasi-definite, and
//! `L D L^T` without pivoting exists in every order of elimination (Vanderbei 1995). Its pivots
//! are tiny where a pressure goes before what it presses and C nearly vanishes, as it does in
//! short time steps. So each pressure is eliminated right after the last displacement that it acts
//! on: its pivot is then what `B A^-1 B^T` gives it. Displacements keep the order that the mesh's
//! own system has.

use super::FactorError;
use super::symbolic::{SymbolicError, SymbolicSystem, SymmetricMatrix};
use super::{DofMap, dot};
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::ldlt::factor::LdltRegularization;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LdltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};
use std::collections::BTreeSet;

/// Equations of an element: [`DofMap::FIXED`] for what is prescribed.
#[derive(Clone, Debug)]
pub struct Coupling {
    /// Equations of its displacements in the mesh's own system.
    pub displacement: Vec<u32>,
    /// Numbers of its pressures.
    pub pressure: Vec<u32>,
}

/// Pattern (lower triangle, columns), places of elements' entries and symbolic factorization.
/// Pressures are numbered after all displacements.
pub struct SaddleSystem {
    displacements: usize,
    pressures: usize,
    column_start: Vec<usize>,
    row: Vec<usize>,
    /// Of each coupling, row-major: pressure by displacement, then the pressures' upper triangle.
    scatter: Vec<Vec<u32>>,
    symbolic: SymbolicCholesky<usize>,
}

impl SaddleSystem {
    /// The system of `system`'s displacements and so many `pressures`.
    ///
    /// # Errors
    /// [`SymbolicError`] if faer refuses the pattern.
    pub fn new(
        system: &SymbolicSystem,
        couplings: &[Coupling],
        pressures: usize,
    ) -> Result<Self, SymbolicError> {
        let displacements = system.dofs.count;
        let n = displacements + pressures;
        let mut below = vec![BTreeSet::new(); n];
        for c in couplings {
            let known = |list: &[u32]| -> Vec<usize> {
                list.iter().filter(|&&e| e != DofMap::FIXED).map(|&e| e as usize).collect()
            };
            let rows: Vec<usize> = known(&c.pressure).iter().map(|p| displacements + p).collect();
            for column in known(&c.displacement) {
                below[column].extend(&rows);
            }
            for &column in &rows {
                below[column].extend(rows.iter().filter(|&&r| r >= column));
            }
        }
        let (mut column_start, mut row) = (vec![0], Vec::new());
        for (column, with_pressure) in below.iter().enumerate() {
            if column < displacements {
                row.extend_from_slice(
                    &system.row[system.column_start[column]..system.column_start[column + 1]],
                );
            }
            row.extend(with_pressure);
            column_start.push(row.len());
        }
        let (order, inverse) = order(system, &below);
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &column_start, None, &row);
        let symbolic = factorize_symbolic_cholesky(
            pattern,
            Side::Lower,
            SymmetricOrdering::Custom(PermRef::new_checked(&order, &inverse, n)),
            CholeskySymbolicParams::default(),
        )
        .map_err(|e| SymbolicError::Symbolic(format!("{e:?}")))?;
        let scatter =
            couplings.iter().map(|c| scatter(c, displacements, &column_start, &row)).collect();
        Ok(Self { displacements, pressures, column_start, row, scatter, symbolic })
    }

    /// Number of unknowns.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.displacements + self.pressures
    }

    /// Whether there is no unknown.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Entries of the lower triangle.
    #[must_use]
    pub const fn entries(&self) -> usize {
        self.row.len()
    }

    /// Entries of the factor.
    #[must_use]
    pub fn factor_entries(&self) -> usize {
        self.symbolic.len_val()
    }

    /// Memory of pattern, places and symbolic factorization, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let places: usize = self.scatter.iter().map(Vec::len).sum();
        8 * (self.row.len() + self.column_start.len() + 2 * self.len()) + 4 * places
    }

    /// Multiplications and additions of one factorization.
    #[must_use]
    pub fn factor_flops(&self) -> f64 {
        super::symbolic::factor_flops(&self.symbolic)
    }

    /// A matrix of zeros.
    #[must_use]
    pub fn zeros(&self) -> SymmetricMatrix {
        SymmetricMatrix { values: vec![0.0; self.row.len()] }
    }

    /// Clears `matrix` and puts the displacements' own entries in.
    pub fn set_displacements(
        &self,
        system: &SymbolicSystem,
        own: &SymmetricMatrix,
        matrix: &mut SymmetricMatrix,
    ) {
        matrix.values.fill(0.0);
        for c in 0..self.displacements {
            let from = system.column_start[c]..system.column_start[c + 1];
            let at = self.column_start[c];
            matrix.values[at..at + from.len()].copy_from_slice(&own.values[from]);
        }
    }

    /// Adds an element's entries: `coupled` pressure by displacement, row-major, `between` pressure
    /// by pressure, whole.
    pub fn add(
        &self,
        matrix: &mut SymmetricMatrix,
        coupling: usize,
        coupled: &[f64],
        between: &[f64],
    ) {
        let map = &self.scatter[coupling];
        let size = between.len().isqrt();
        let upper = (0..size).flat_map(|a| &between[a * size + a..(a + 1) * size]);
        for (&target, v) in map.iter().zip(coupled.iter().chain(upper)) {
            if target != DofMap::FIXED {
                matrix.values[target as usize] += v;
            }
        }
    }

    /// `y = b - A x`.
    pub(crate) fn residual(&self, matrix: &SymmetricMatrix, b: &[f64], x: &[f64], y: &mut [f64]) {
        y.copy_from_slice(b);
        for c in 0..self.len() {
            let range = self.column_start[c]..self.column_start[c + 1];
            for (&r, &v) in self.row[range.clone()].iter().zip(&matrix.values[range]) {
                y[r] -= v * x[c];
                if r != c {
                    y[c] -= v * x[r];
                }
            }
        }
    }
}

/// Order of elimination and its inverse: the displacements' own, each pressure after the last that
/// it acts on.
fn order(system: &SymbolicSystem, below: &[BTreeSet<usize>]) -> (Vec<usize>, Vec<usize>) {
    let displacements = system.dofs.count;
    let mut place = vec![(0, 0); below.len()];
    if let Some(own) = system.symbolic.perm() {
        for (k, &e) in own.arrays().0.iter().enumerate() {
            place[e] = (k, 0);
        }
    }
    for (e, pressures) in below[..displacements].iter().enumerate() {
        for &p in pressures {
            place[p] = place[p].max((place[e].0, 1));
        }
    }
    let mut order: Vec<usize> = (0..below.len()).collect();
    order.sort_by_key(|&e| place[e]);
    let mut inverse = vec![0; order.len()];
    for (k, &e) in order.iter().enumerate() {
        inverse[e] = k;
    }
    (order, inverse)
}

fn scatter(c: &Coupling, displacements: usize, start: &[usize], row: &[usize]) -> Vec<u32> {
    let mut map = Vec::new();
    let mut put = |p: u32, equation: usize| {
        map.push(if p == DofMap::FIXED || equation == DofMap::FIXED as usize {
            DofMap::FIXED
        } else {
            super::pattern::entry(start, row, displacements + p as usize, equation) as u32
        });
    };
    for &p in &c.pressure {
        c.displacement.iter().for_each(|&e| put(p, e as usize));
    }
    for (a, &p) in c.pressure.iter().enumerate() {
        for &q in &c.pressure[a..] {
            let equation = if q == DofMap::FIXED { q as usize } else { displacements + q as usize };
            put(p, equation);
        }
    }
    map
}

/// Memory for factors of a [`SaddleSystem`] and solutions with them.
pub struct SaddleSolver {
    factor: Vec<f64>,
    memory: MemBuffer,
    residual: Vec<f64>,
    /// Of the last solution.
    correction: Vec<f64>,
}

/// Steps of iterative refinement at most.
const REFINEMENTS_MAX: usize = 4;
/// Relative residual of a linear system that is good enough.
const RESIDUAL_ENOUGH: f64 = 1e-12;

fn scratch(system: &SaddleSystem) -> StackReq {
    let s = &system.symbolic;
    s.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Spec::default())
        .or(s.solve_in_place_scratch::<f64>(1, Par::Seq))
}

impl SaddleSolver {
    /// Memory for `system`.
    ///
    /// # Errors
    /// [`FactorError::Memory`].
    pub fn new(system: &SaddleSystem) -> Result<Self, FactorError> {
        let memory = MemBuffer::try_new(scratch(system))
            .map_err(|_| FactorError::Memory(system.factor_entries()))?;
        let vector = || vec![0.0; system.len()];
        Ok(Self {
            factor: vec![0.0; system.factor_entries()],
            memory,
            residual: vector(),
            correction: vector(),
        })
    }

    /// What it takes on `system`, bytes.
    #[must_use]
    pub fn bytes(system: &SaddleSystem) -> usize {
        scratch(system).unaligned_bytes_required()
            + 8 * (system.factor_entries() + 2 * system.len())
    }

    /// Factorizes `matrix`.
    ///
    /// # Errors
    /// [`FactorError::Singular`] where a pivot vanishes.
    pub fn factorize(
        &mut self,
        system: &SaddleSystem,
        matrix: &SymmetricMatrix,
    ) -> Result<(), FactorError> {
        let n = system.len();
        let (start, row) = (&system.column_start, &system.row);
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, start, None, row);
        system
            .symbolic
            .factorize_numeric_ldlt(
                &mut self.factor,
                SparseColMatRef::new(pattern, &matrix.values),
                Side::Lower,
                LdltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut self.memory),
                Spec::default(),
            )
            .map_err(|_| FactorError::Singular)?;
        if self.factor.iter().all(|v| v.is_finite()) { Ok(()) } else { Err(FactorError::Singular) }
    }

    /// Solves `A x = b` with the last factor and refines until `b - A x` is rounding or falls no
    /// more; gives its size over that of `b`.
    pub fn solve(
        &mut self,
        system: &SaddleSystem,
        matrix: &SymmetricMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> f64 {
        let size = dot(b, b).sqrt();
        x.fill(0.0);
        self.residual.copy_from_slice(b);
        let mut last = 1.0;
        for _ in 0..=REFINEMENTS_MAX {
            self.correction.copy_from_slice(&self.residual);
            LdltRef::new(&system.symbolic, &self.factor).solve_in_place_with_conj(
                Conj::No,
                MatMut::from_column_major_slice_mut(&mut self.correction, system.len(), 1),
                Par::Seq,
                MemStack::new(&mut self.memory),
            );
            x.iter_mut().zip(&self.correction).for_each(|(x, c)| *x += c);
            system.residual(matrix, b, x, &mut self.residual);
            let relative = dot(&self.residual, &self.residual).sqrt() / size;
            if !(relative < last) {
                // The last correction made it worse.
                x.iter_mut().zip(&self.correction).for_each(|(x, c)| *x -= c);
                break;
            }
            last = relative;
            if last <= RESIDUAL_ENOUGH {
                break;
            }
        }
        last
    }
}
