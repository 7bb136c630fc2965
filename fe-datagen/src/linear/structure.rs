//! Equation numbers, sparsity pattern and element scatter maps of a mesh.

use super::ordering::{OrderingError, cuthill_mckee, nested_dissection};
use crate::mesh::Mesh;
use faer::Side;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use std::collections::BTreeSet;

/// Which degrees of freedom are unknown.
#[derive(Clone, Debug)]
pub struct Equations {
    /// Equation of each degree of freedom `3 node + component`; [`Self::FIXED`] if prescribed.
    pub of_dof: Vec<u32>,
    /// Number of unknowns.
    pub count: usize,
}

impl Equations {
    /// Mark of a prescribed degree of freedom.
    pub const FIXED: u32 = u32::MAX;

    /// Numbers the degrees of freedom for which `fixed` is false.
    #[must_use]
    pub fn new(fixed: &[bool]) -> Self {
        let mut count = 0;
        let of_dof = fixed
            .iter()
            .map(|&f| {
                if f {
                    Self::FIXED
                } else {
                    count += 1;
                    count - 1
                }
            })
            .collect();
        Self { of_dof, count: count as usize }
    }
}

/// Why a system's structure could not be built.
#[derive(Debug, thiserror::Error)]
pub enum StructureError {
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
pub struct Structure {
    /// Unknowns.
    pub equations: Equations,
    /// First entry of each column; `n + 1` entries.
    pub column_start: Vec<usize>,
    /// Row of each entry, sorted in its column, starting with the diagonal.
    pub row: Vec<usize>,
    /// Per block: value index of every local pair `p <= q`, row-major upper
    /// triangle, [`Equations::FIXED`] where a degree of freedom is prescribed.
    scatter: Vec<Vec<u32>>,
    pub(super) symbolic: SymbolicCholesky<usize>,
}

/// Values on a [`Structure`]'s pattern.
#[derive(Clone, Debug)]
pub struct SymmetricMatrix {
    /// One value per entry of the lower triangle.
    pub values: Vec<f64>,
}

/// In which order unknowns are eliminated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Elimination {
    /// METIS' nested dissection of the nodes: the least fill.
    #[default]
    NestedDissection,
    /// Reverse Cuthill-McKee of the nodes: the least bandwidth.
    CuthillMckee,
    /// As the mesh numbers its nodes.
    Natural,
}

impl Structure {
    /// Structure of `mesh` with some degrees of freedom prescribed.
    ///
    /// # Errors
    /// See [`StructureError`].
    pub fn new(mesh: &Mesh, fixed: &[bool]) -> Result<Self, StructureError> {
        Self::eliminated(mesh, fixed, Elimination::default())
    }

    /// The same with a choice of the elimination order.
    ///
    /// # Errors
    /// See [`StructureError`].
    pub fn eliminated(
        mesh: &Mesh,
        fixed: &[bool],
        elimination: Elimination,
    ) -> Result<Self, StructureError> {
        let equations = Equations::new(fixed);
        if equations.count == 0 {
            return Err(StructureError::NoUnknowns);
        }
        let neighbours = node_graph(mesh);
        let (column_start, row) = pattern(&neighbours, &equations);
        let n = equations.count;
        let order = elimination_order(&neighbours, &equations, elimination)?;
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
        .map_err(|e| StructureError::Symbolic(format!("{e:?}")))?;
        let scatter = scatter_maps(mesh, &equations, &column_start, &row);
        Ok(Self { equations, column_start, row, scatter, symbolic })
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

    /// Multiplications and additions of one numeric factorization: `r^2` for a
    /// column of the factor with `r` entries, its diagonal included.
    #[must_use]
    pub fn factor_flops(&self) -> f64 {
        let column = |rows: usize| (rows as f64).powi(2);
        match self.symbolic.raw() {
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
        8 * (self.row.len() + self.column_start.len() + 2 * self.equations.count + supernodes)
            + 4 * (scatter + self.equations.of_dof.len())
    }

    /// Adds an element's dense tangent (blocks `a <= b` of `3 n x 3 n`).
    #[inline]
    pub fn add_element(
        &self,
        matrix: &mut SymmetricMatrix,
        block: usize,
        element: usize,
        dense: &[f64],
    ) {
        let size = dense.len().isqrt();
        let pairs = size * (size + 1) / 2;
        let map = &self.scatter[block][element * pairs..(element + 1) * pairs];
        let mut at = 0;
        for p in 0..size {
            let line = &dense[p * size..(p + 1) * size];
            for &v in &line[p..] {
                let target = map[at];
                at += 1;
                if target != Equations::FIXED {
                    matrix.values[target as usize] += v;
                }
            }
        }
    }

    /// Adds a symmetric 3 x 3 block between the nodes of a point with shape functions
    /// `values`, `N_a N_b block`; they have to be of one element.
    pub fn add_point(
        &self,
        matrix: &mut SymmetricMatrix,
        nodes: &[u32],
        values: &[f64],
        block: &[[f64; 3]; 3],
    ) {
        let equation = |node: u32, i: usize| self.equations.of_dof[3 * node as usize + i];
        for (&b, vb) in nodes.iter().zip(values) {
            for j in 0..3 {
                let column = equation(b, j);
                if column == Equations::FIXED {
                    continue;
                }
                for (&a, va) in nodes.iter().zip(values) {
                    for i in 0..3 {
                        let row = equation(a, i);
                        if row != Equations::FIXED && row >= column {
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
        let n = self.equations.count;
        let pattern =
            SymbolicSparseColMatRef::new_checked(n, n, &self.column_start, None, &self.row);
        SparseColMatRef::new(pattern, values)
    }

    /// `y = A x` over the unknowns.
    pub fn multiply(&self, matrix: &SymmetricMatrix, x: &[f64], y: &mut [f64]) {
        y.fill(0.0);
        for c in 0..self.equations.count {
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
        let mut y = vec![0.0; self.equations.count];
        for c in 0..self.equations.count {
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

/// Neighbours of every node through elements, itself left out.
fn node_graph(mesh: &Mesh) -> Vec<BTreeSet<u32>> {
    let mut graph = vec![BTreeSet::new(); mesh.nodes.len()];
    for block in &mesh.blocks {
        for e in 0..block.len() {
            let nodes = block.element(e);
            for &a in nodes {
                graph[a as usize].extend(nodes.iter().copied().filter(|&b| b != a));
            }
        }
    }
    graph
}

/// Lower triangle of the pattern, by columns.
fn pattern(neighbours: &[BTreeSet<u32>], equations: &Equations) -> (Vec<usize>, Vec<usize>) {
    let mut start = vec![0];
    let mut row = Vec::new();
    for node in 0..neighbours.len() {
        for i in 0..3 {
            let column = equations.of_dof[3 * node + i];
            if column == Equations::FIXED {
                continue;
            }
            let first = row.len();
            for &b in neighbours[node].iter().chain(std::iter::once(&(node as u32))) {
                row.extend(
                    equations.of_dof[3 * b as usize..3 * b as usize + 3]
                        .iter()
                        .filter(|&&r| r != Equations::FIXED && r >= column)
                        .map(|&r| r as usize),
                );
            }
            row[first..].sort_unstable();
            start.push(row.len());
        }
    }
    (start, row)
}

/// Order of the nodes with unknowns, expanded to equations.
fn elimination_order(
    neighbours: &[BTreeSet<u32>],
    equations: &Equations,
    elimination: Elimination,
) -> Result<Vec<usize>, OrderingError> {
    let unknowns = |node: usize| {
        equations.of_dof[3 * node..3 * node + 3].iter().filter(|&&e| e != Equations::FIXED)
    };
    let mut compact = vec![u32::MAX; neighbours.len()];
    let mut kept = Vec::new();
    for node in 0..neighbours.len() {
        if unknowns(node).next().is_some() {
            compact[node] = kept.len() as u32;
            kept.push(node);
        }
    }
    let graph: Vec<BTreeSet<u32>> = kept
        .iter()
        .map(|&node| {
            neighbours[node]
                .iter()
                .map(|&b| compact[b as usize])
                .filter(|&b| b != u32::MAX)
                .collect()
        })
        .collect();
    let order = match elimination {
        Elimination::NestedDissection => nested_dissection(&graph)?,
        Elimination::CuthillMckee => cuthill_mckee(&graph),
        Elimination::Natural => (0..graph.len() as u32).collect(),
    };
    Ok(order.iter().flat_map(|&v| unknowns(kept[v as usize]).map(|&e| e as usize)).collect())
}

fn entry(column_start: &[usize], row: &[usize], r: usize, c: usize) -> usize {
    let (r, c) = (r.max(c), r.min(c));
    let first = column_start[c];
    let found = row[first..column_start[c + 1]].binary_search(&r);
    debug_assert!(found.is_ok(), "entry ({r}, {c}) is not in the pattern");
    first + found.unwrap_or(0)
}

fn scatter_maps(
    mesh: &Mesh,
    equations: &Equations,
    column_start: &[usize],
    row: &[usize],
) -> Vec<Vec<u32>> {
    mesh.blocks
        .iter()
        .map(|block| {
            let size = 3 * block.kind.nodes();
            let mut map = Vec::with_capacity(block.len() * size * (size + 1) / 2);
            for e in 0..block.len() {
                let of: Vec<u32> = block
                    .element(e)
                    .iter()
                    .flat_map(|&n| (0..3).map(move |i| 3 * n as usize + i))
                    .map(|d| equations.of_dof[d])
                    .collect();
                for p in 0..size {
                    for q in p..size {
                        map.push(if of[p] == Equations::FIXED || of[q] == Equations::FIXED {
                            Equations::FIXED
                        } else {
                            entry(column_start, row, of[p] as usize, of[q] as usize) as u32
                        });
                    }
                }
            }
            map
        })
        .collect()
}
