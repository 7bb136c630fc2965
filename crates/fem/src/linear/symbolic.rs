//! A mesh's matrix: its pattern and symbolic factor, sums and products on them.

use super::DofMap;
use super::ordering::{Elimination, OrderingError, elimination_order};
use super::pattern::{entry, node_graph, pattern, scatter_maps};
use crate::mesh::hanging::HangingInElement;
use crate::mesh::{Block, Mesh};
use faer::Side;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};

/// Why a system's structure could not be built.
#[derive(Debug, thiserror::Error)]
pub enum SymbolicError {
    /// Every degree of freedom is prescribed.
    #[error("no unknowns: every degree of freedom is prescribed")]
    NoUnknowns,
    /// The ordering failed.
    #[error(transparent)]
    Ordering(#[from] OrderingError),
    /// faer's symbolic factorization failed.
    #[error("symbolic factorization failed: {0}")]
    Symbolic(String),
}

/// Pattern (lower triangle, columns), scatter maps and symbolic factorization.
pub struct SymbolicSystem {
    /// Unknowns.
    pub dofs: DofMap,
    /// First entry of each column; `n + 1` entries.
    pub column_start: Vec<usize>,
    /// Row of each entry, sorted in its column, starting with the diagonal.
    pub row: Vec<usize>,
    /// Per block: value index of every local pair `p <= q`, row-major upper
    /// triangle, [`DofMap::FIXED`] where a degree of freedom is prescribed.
    scatter: Vec<Vec<u32>>,
    /// Per block and element: its nodes that hang; empty without any in the mesh.
    hanging: Vec<Vec<Vec<HangingInElement>>>,
    pub(super) symbolic: SymbolicCholesky<usize>,
}

/// Values on a [`SymbolicSystem`]'s pattern.
#[derive(Clone, Debug)]
pub struct SymmetricMatrix {
    /// One value per entry of the lower triangle.
    pub values: Vec<f64>,
}

impl SymbolicSystem {
    /// SymbolicSystem of `mesh` with some degrees of freedom prescribed.
    ///
    /// # Errors
    /// See [`SymbolicError`].
    pub fn new(mesh: &Mesh, fixed: &[bool]) -> Result<Self, SymbolicError> {
        Self::eliminated(mesh, fixed, Elimination::default())
    }

    /// The same with a choice of the elimination order.
    ///
    /// # Errors
    /// See [`SymbolicError`].
    pub fn eliminated(
        mesh: &Mesh,
        fixed: &[bool],
        elimination: Elimination,
    ) -> Result<Self, SymbolicError> {
        let dofs = DofMap::new(fixed, &mesh.hanging);
        if dofs.count == 0 {
            return Err(SymbolicError::NoUnknowns);
        }
        let neighbours = node_graph(mesh);
        let (column_start, row) = pattern(&neighbours, &dofs);
        let n = dofs.count;
        let order = elimination_order(&neighbours, &dofs, elimination)?;
        let mut inverse = vec![0; n];
        for (k, &e) in order.iter().enumerate() {
            inverse[e] = k;
        }
        let a = SymbolicSparseColMatRef::new_checked(n, n, &column_start, None, &row);
        let symbolic = factorize_symbolic_cholesky(
            a,
            Side::Lower,
            SymmetricOrdering::Custom(PermRef::new_checked(&order, &inverse, n)),
            CholeskySymbolicParams::default(),
        )
        .map_err(|e| SymbolicError::Symbolic(format!("{e:?}")))?;
        let scatter = scatter_maps(mesh, &dofs, &column_start, &row);
        let of_block = |b: &Block| (0..b.len()).map(|e| mesh.hanging_in_element(b, e)).collect();
        let hanging = if mesh.hanging.is_empty() {
            Vec::new()
        } else {
            mesh.blocks.iter().map(of_block).collect()
        };
        Ok(Self { dofs, column_start, row, scatter, hanging, symbolic })
    }

    /// A matrix of zeros on this pattern.
    #[must_use]
    pub fn zeros(&self) -> SymmetricMatrix {
        SymmetricMatrix { values: vec![0.0; self.row.len()] }
    }

    /// Entries of the numeric factor.
    #[must_use]
    pub fn factor_entries(&self) -> usize {
        self.symbolic.len_val()
    }

    /// Multiplications and additions of one numeric factorization.
    #[must_use]
    pub fn factor_flops(&self) -> f64 {
        factor_flops(&self.symbolic)
    }

    /// Visits the place of every diagonal entry among the factor's values.
    pub(super) fn visit_diagonal(&self, visit: &mut dyn FnMut(usize)) {
        match self.symbolic.raw() {
            SymbolicCholeskyRaw::Simplicial(s) => {
                let starts = s.col_ptr();
                starts[..starts.len() - 1].iter().for_each(|&at| visit(at));
            }
            SymbolicCholeskyRaw::Supernodal(s) => {
                for k in 0..s.n_supernodes() {
                    let width = s.supernode_end()[k] - s.supernode_begin()[k];
                    // Dense columns of the triangle and of the rows below it.
                    let rows = width + s.supernode(k).pattern().len();
                    (0..width).for_each(|c| visit(s.col_ptr_for_val()[k] + c * (rows + 1)));
                }
            }
        }
    }

    /// Memory of pattern, scatter maps and symbolic factorization, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let scatter: usize = self.scatter.iter().map(Vec::len).sum();
        let supernodes = match self.symbolic.raw() {
            SymbolicCholeskyRaw::Simplicial(s) => s.len_val(),
            SymbolicCholeskyRaw::Supernodal(s) => s.row_idx().len(),
        };
        8 * (self.row.len() + self.column_start.len() + 2 * self.dofs.count + supernodes)
            + 4 * (scatter + self.dofs.of_dof.len())
    }

    /// Adds an element's dense tangent (blocks `a <= b` of `3 n x 3 n`), of which nothing is kept.
    #[inline]
    pub fn add_element(
        &self,
        matrix: &mut SymmetricMatrix,
        block: usize,
        element: usize,
        dense: &mut [f64],
    ) {
        let size = dense.len().isqrt();
        let hanging = self.hanging.get(block).map_or(&[][..], |b| &b[element]);
        if !hanging.is_empty() {
            for p in 0..size {
                for q in 0..p {
                    dense[p * size + q] = dense[q * size + p];
                }
            }
            hanging.iter().for_each(|h| h.condense(dense));
        }
        let pairs = size * (size + 1) / 2;
        let map = &self.scatter[block][element * pairs..(element + 1) * pairs];
        let mut at = 0;
        for p in 0..size {
            let line = &dense[p * size..(p + 1) * size];
            for &v in &line[p..] {
                let target = map[at];
                at += 1;
                if target != DofMap::FIXED {
                    matrix.values[target as usize] += v;
                }
            }
        }
    }

    /// Adds a symmetric 3 x 3 block between the nodes of a point with their shape functions,
    /// `N_a N_b block`; see [`Mesh::free_support`].
    ///
    /// # Panics
    /// If the nodes are not all of one element.
    pub fn add_point(
        &self,
        matrix: &mut SymmetricMatrix,
        support: &[(u32, f64)],
        block: &[[f64; 3]; 3],
    ) {
        let equation = |node: u32, i: usize| self.dofs.of_dof[3 * node as usize + i];
        for &(b, vb) in support {
            for j in 0..3 {
                let column = equation(b, j);
                if column == DofMap::FIXED {
                    continue;
                }
                for &(a, va) in support {
                    for i in 0..3 {
                        let row = equation(a, i);
                        if row != DofMap::FIXED && row >= column {
                            let (row, column) = (row as usize, column as usize);
                            let at = entry(&self.column_start, &self.row, row, column);
                            matrix.values[at] += va * vb * block[i][j];
                        }
                    }
                }
            }
        }
    }

    /// The lower triangle with these entries, as the factorizations take it.
    pub(super) fn lower<'a, T>(&'a self, values: &'a [T]) -> SparseColMatRef<'a, usize, T> {
        let n = self.dofs.count;
        let pattern =
            SymbolicSparseColMatRef::new_checked(n, n, &self.column_start, None, &self.row);
        SparseColMatRef::new(pattern, values)
    }

    /// `y = A x` over the unknowns.
    pub fn multiply(&self, matrix: &SymmetricMatrix, x: &[f64], y: &mut [f64]) {
        y.fill(0.0);
        for c in 0..self.dofs.count {
            let range = self.column_start[c]..self.column_start[c + 1];
            let xc = x[c];
            let mut sum = 0.0;
            for (&r, &v) in self.row[range.clone()].iter().zip(&matrix.values[range]).skip(1) {
                y[r] += v * xc;
                sum += v * x[r];
            }
            y[c] += sum + matrix.values[self.column_start[c]] * xc;
        }
    }

    /// Norm of `|A| |x|`: times the machine's epsilon, how far rounding of `x` alone moves
    /// `A x`.
    #[must_use]
    pub fn absolute_product_norm(&self, matrix: &SymmetricMatrix, x: &[f64]) -> f64 {
        let mut y = vec![0.0; self.dofs.count];
        for c in 0..self.dofs.count {
            let range = self.column_start[c]..self.column_start[c + 1];
            for (&r, &v) in self.row[range.clone()].iter().zip(&matrix.values[range]) {
                y[r] += (v * x[c]).abs();
                if r != c {
                    y[c] += (v * x[r]).abs();
                }
            }
        }
        super::dot(&y, &y).sqrt()
    }
}

/// Multiplications and additions of a numeric factorization: `r^2` for a column of the factor with
/// `r` entries, its diagonal included.
pub(super) fn factor_flops(symbolic: &SymbolicCholesky<usize>) -> f64 {
    let column = |rows: usize| (rows as f64).powi(2);
    match symbolic.raw() {
        SymbolicCholeskyRaw::Simplicial(s) => {
            s.col_ptr().windows(2).map(|w| column(w[1] - w[0])).sum()
        }
        SymbolicCholeskyRaw::Supernodal(s) => (0..s.n_supernodes())
            .map(|k| {
                let width = s.supernode_end()[k] - s.supernode_begin()[k];
                let below = s.supernode(k).pattern().len();
                (1..=width).map(|c| column(below + c)).sum::<f64>()
            })
            .sum(),
    }
}
