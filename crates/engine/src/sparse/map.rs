//! A sparse linear map as an operator of tract.

use super::terms::Terms;
use pulp::{Arch, NullaryFnOnce};
use std::{array, sync::Arc};
use tract_onnx::tract_core::internal::*;

/// `y = S x` with few terms in each row of `S`.
#[derive(Clone, Debug)]
pub(super) struct SparseMap {
    shape: TVec<usize>,
    table: Arc<Table>,
}

/// The rows that are not empty, as runs of consecutive rows. Every row has `degree` terms; a row
/// with fewer is padded with terms of weight 0, whose source is one of its own.
#[derive(Debug)]
struct Table {
    runs: Vec<Run>,
    degree: usize,
    /// The source of the first term of every row, then of the second term of every row, and so on.
    index: Index,
    /// The weights, in the same order.
    weight: Vec<f32>,
}

#[derive(Clone, Copy, Debug)]
struct Run {
    first: usize,
    rows: usize,
}

/// Sources of up to this many values are copied into an array of this length. Indices are taken
/// modulo that length, so they need no check, and the compiler can vectorise the loop.
const NEAR_LEN: usize = 2048;

#[derive(Debug)]
enum Index {
    /// The source has at most `NEAR_LEN` values.
    Near(Vec<u16>),
    Far(Vec<u32>),
}

impl SparseMap {
    pub(super) fn new(terms: &Terms, source_len: usize) -> Self {
        let rows = || {
            let of_row = terms.index.chunks_exact(terms.degree);
            let weights = terms.weight.chunks_exact(terms.degree);
            of_row.zip(weights).map(|(index, weight)| {
                index.iter().zip(weight).filter(|(_, w)| **w != 0.0).map(|(i, w)| (*i, *w))
            })
        };
        let degree = rows().map(Iterator::count).max().unwrap_or(0);
        let mut runs = Vec::<Run>::new();
        let mut kept: Vec<Vec<(u32, f32)>> = vec![vec![]; degree];
        for (row, mut of_row) in rows().enumerate() {
            let Some((some, _)) = of_row.clone().next() else { continue };
            for terms in &mut kept {
                terms.push(of_row.next().unwrap_or((some, 0.0)));
            }
            match runs.last_mut() {
                Some(run) if run.first + run.rows == row => run.rows += 1,
                _ => runs.push(Run { first: row, rows: 1 }),
            }
        }
        let (index, weight): (Vec<u32>, Vec<f32>) = kept.into_iter().flatten().unzip();
        let index = if source_len <= NEAR_LEN {
            Index::Near(index.into_iter().map(|at| at as u16).collect())
        } else {
            Index::Far(index)
        };
        let table = Table { runs, degree, index, weight };
        Self { shape: terms.shape.clone(), table: Arc::new(table) }
    }
}

impl SparseMap {
    /// Bytes of the table, and number of its terms.
    pub(super) fn size(&self) -> (u64, u64) {
        let terms = self.table.weight.len();
        let index_bytes = match self.table.index {
            Index::Near(_) => size_of::<u16>(),
            Index::Far(_) => size_of::<u32>(),
        };
        ((terms * (size_of::<f32>() + index_bytes)) as u64, terms as u64)
    }
}

/// One evaluation of a table with near sources.
struct Near<'a> {
    table: &'a Table,
    index: &'a [u16],
    source: &'a [f32; NEAR_LEN],
    target: &'a mut [f32],
}

impl NullaryFnOnce for Near<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let value = |at: u16| self.source[usize::from(at) % NEAR_LEN];
        self.table.apply_by(self.index, value, self.target);
    }
}

impl Table {
    fn apply(&self, source: &[f32], target: &mut [f32]) {
        match &self.index {
            Index::Near(index) => {
                let mut near = [0.0; NEAR_LEN];
                near[..source.len()].copy_from_slice(source);
                // Uses the widest vectors that this processor has.
                Arch::new().dispatch(Near { table: self, index, source: &near, target });
            }
            Index::Far(index) => self.apply_by(index, |at| source[at as usize], target),
        }
    }

    /// The degrees that occur in models have loops of their own, which the compiler unrolls.
    #[inline(always)]
    fn apply_by<I: Copy>(&self, index: &[I], value: impl Fn(I) -> f32, target: &mut [f32]) {
        match self.degree {
            1 => self.rows::<I, 1>(index, value, target),
            2 => self.rows::<I, 2>(index, value, target),
            3 => self.rows::<I, 3>(index, value, target),
            4 => self.rows::<I, 4>(index, value, target),
            8 => self.rows::<I, 8>(index, value, target),
            _ => self.rows_of_any(index, value, target),
        }
    }

    #[inline(always)]
    fn rows<I: Copy, const N: usize>(
        &self,
        index: &[I],
        value: impl Fn(I) -> f32,
        target: &mut [f32],
    ) {
        let all = index.len() / N;
        let mut done = 0;
        for &Run { first, rows } in &self.runs {
            let target = &mut target[first..first + rows];
            let of_run = |k: usize| k * all + done..k * all + done + rows;
            let index: [&[I]; N] = array::from_fn(|k| &index[of_run(k)]);
            let weight: [&[f32]; N] = array::from_fn(|k| &self.weight[of_run(k)]);
            for row in 0..rows {
                let mut sum = weight[0][row] * value(index[0][row]);
                for k in 1..N {
                    sum += weight[k][row] * value(index[k][row]);
                }
                target[row] = sum;
            }
            done += rows;
        }
    }

    fn rows_of_any<I: Copy>(&self, index: &[I], value: impl Fn(I) -> f32, target: &mut [f32]) {
        let all = index.len() / self.degree.max(1);
        let rows = self.runs.iter().flat_map(|run| run.first..run.first + run.rows);
        for (at, row) in rows.enumerate() {
            let terms = (0..self.degree).map(|k| k * all + at);
            target[row] = terms.map(|term| self.weight[term] * value(index[term])).sum();
        }
    }
}

impl PartialEq for SparseMap {
    fn eq(&self, other: &Self) -> bool {
        self.shape == other.shape && Arc::ptr_eq(&self.table, &other.table)
    }
}

impl Eq for SparseMap {}

impl Op for SparseMap {
    fn name(&self) -> StaticName {
        "SparseMap".into()
    }

    fn validation(&self) -> Validation {
        Validation::Rounding
    }

    op_as_typed_op!();
}

impl EvalOp for SparseMap {
    op_out_of_plan!();

    fn eval(&self, _: &EvalContext<'_>, inputs: TVec<TValue>) -> TractResult<TVec<TValue>> {
        let source = args_1!(inputs);
        let mut target = Tensor::zero::<f32>(&self.shape)?;
        let mut plain = target.try_as_plain_ram_mut()?;
        self.table
            .apply(source.try_as_plain_ram()?.as_slice::<f32>()?, plain.as_slice_mut::<f32>()?);
        Ok(tvec!(target.into_tvalue()))
    }
}

impl TypedOp for SparseMap {
    as_op!();

    fn output_facts(&self, _: &[&TypedFact]) -> TractResult<TVec<TypedFact>> {
        Ok(tvec!(f32::fact(&*self.shape)))
    }
}
