//! Many small products at once: the rows of each part, times the matrix of that part.

use pulp::{Arch, Simd, WithSimd};
use std::sync::Arc;
use tract_onnx::tract_core::internal::*;

/// `y[s, m, n] = sum over k of x[s, m, k] w[s, k, n]`.
#[derive(Clone, Debug)]
pub(super) struct Stacked {
    /// Shape of the output; the last two axes are `m` and `n`.
    shape: TVec<usize>,
    sizes: Sizes,
    /// `w`, row-major.
    matrices: Arc<Vec<f32>>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Sizes {
    m: usize,
    k: usize,
    n: usize,
}

impl Stacked {
    /// `m` is the number of rows for each matrix, `shape` that of the output.
    pub(super) fn new(matrices: &Tensor, m: usize, shape: &[usize]) -> TractResult<Self> {
        let &[_, k, n] = matrices.shape() else { bail!("no stack of matrices") };
        let matrices = Arc::new(matrices.try_as_plain_ram()?.as_slice::<f32>()?.to_vec());
        Ok(Self { shape: shape.into(), sizes: Sizes { m, k, n }, matrices })
    }

    /// Bytes of the matrices, and number of products that one map takes.
    pub(super) fn size(&self) -> (u64, u64) {
        let values = self.matrices.len();
        (size_of_val(&self.matrices[..]) as u64, (values * self.sizes.m) as u64)
    }
}

/// Vectors of sums for each row that are kept in registers.
const TILE: usize = 6;

struct Work<'a> {
    sizes: Sizes,
    rows: &'a [f32],
    matrices: &'a [f32],
    made: &'a mut [f32],
}

impl WithSimd for Work<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Sizes { m, k, n } = self.sizes;
        let parts = self.rows.chunks_exact(m * k).zip(self.matrices.chunks_exact(k * n));
        for ((rows, matrix), made) in parts.zip(self.made.chunks_exact_mut(m * n)) {
            let mut pairs = made.chunks_exact_mut(2 * n);
            let mut rows = rows.chunks_exact(2 * k);
            for (made, rows) in (&mut pairs).zip(&mut rows) {
                let (first, second) = made.split_at_mut(n);
                let (row, other) = rows.split_at(k);
                product(simd, [row, other], matrix, [first, second]);
            }
            let (row, made) = (rows.remainder(), pairs.into_remainder());
            if !row.is_empty() {
                product(simd, [row], matrix, [made]);
            }
        }
    }
}

/// Multiplies `R` rows by one matrix. Each vector of the matrix is read once for all rows.
#[inline(always)]
fn product<S: Simd, const R: usize>(
    simd: S,
    rows: [&[f32]; R],
    matrix: &[f32],
    mut made: [&mut [f32]; R],
) {
    let n = made[0].len();
    let width = TILE * S::F32_LANES;
    let whole = n - n % width;
    for first in (0..whole).step_by(width) {
        let mut sums = [[simd.splat_f32s(0.0); TILE]; R];
        for (k, of_k) in matrix.chunks_exact(n).enumerate() {
            let (vectors, _) = S::as_simd_f32s(&of_k[first..first + width]);
            for (sums, row) in sums.iter_mut().zip(rows) {
                let factor = simd.splat_f32s(row[k]);
                for (sum, vector) in sums.iter_mut().zip(vectors) {
                    *sum = simd.mul_add_e_f32s(*vector, factor, *sum);
                }
            }
        }
        for (sums, made) in sums.iter().zip(&mut made) {
            S::as_mut_simd_f32s(&mut made[first..first + width]).0.copy_from_slice(sums);
        }
    }
    for (row, made) in rows.into_iter().zip(made) {
        for (column, made) in made.iter_mut().enumerate().skip(whole) {
            let of_column = matrix[column..].iter().step_by(n);
            *made = row.iter().zip(of_column).map(|(row, value)| row * value).sum();
        }
    }
}

impl PartialEq for Stacked {
    fn eq(&self, other: &Self) -> bool {
        (&self.shape, self.sizes) == (&other.shape, other.sizes)
            && Arc::ptr_eq(&self.matrices, &other.matrices)
    }
}

impl Eq for Stacked {}

impl Op for Stacked {
    fn name(&self) -> StaticName {
        "StackedProduct".into()
    }

    fn validation(&self) -> Validation {
        Validation::Rounding
    }

    op_as_typed_op!();
}

impl EvalOp for Stacked {
    op_out_of_plan!();

    fn eval(&self, _: &EvalContext<'_>, inputs: TVec<TValue>) -> TractResult<TVec<TValue>> {
        let rows = args_1!(inputs);
        let mut made = Tensor::zero::<f32>(&self.shape)?;
        let mut plain = made.try_as_plain_ram_mut()?;
        Arch::new().dispatch(Work {
            sizes: self.sizes,
            rows: rows.try_as_plain_ram()?.as_slice::<f32>()?,
            matrices: &self.matrices,
            made: plain.as_slice_mut::<f32>()?,
        });
        Ok(tvec!(made.into_tvalue()))
    }
}

impl TypedOp for Stacked {
    as_op!();

    fn output_facts(&self, _: &[&TypedFact]) -> TractResult<TVec<TypedFact>> {
        Ok(tvec!(f32::fact(&*self.shape)))
    }
}
