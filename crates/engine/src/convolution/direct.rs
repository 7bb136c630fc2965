//! A convolution of step 1 as an operator of tract.

use pulp::{Arch, Simd, WithSimd};
use std::sync::Arc;
use tract_onnx::tract_core::internal::*;

/// Output channels whose sums are kept in registers at a time.
const CHANNELS: usize = 4;
/// Vectors of pixels for each of these channels. With four channels that makes eight independent
/// sums, as many as two arithmetic units with a latency of four cycles need to be kept busy.
const VECTORS: usize = 2;

/// `y[o, r, c] = b[o] + sum over i, s, t of w[o, i, s, t] x[i, r + s - p, c + t - q]`, x = 0 outside.
#[derive(Clone, Debug)]
pub(super) struct Direct {
    shape: Shape,
    /// `w[o / 4, i, s, t, o % 4]`, with zeros beyond the last channel.
    weights: Arc<Vec<f32>>,
    /// One value for each channel, with zeros beyond the last.
    bias: Arc<Vec<f32>>,
}

/// Sizes of the input `map`, the kernel and the output `made`, in the order channels, rows,
/// columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Shape {
    pub map: [usize; 3],
    /// Rows and columns of zeros before the map.
    pub before: [usize; 2],
    pub kernel: [usize; 2],
    pub made: [usize; 3],
}

impl Shape {
    /// Rows and columns that are read, with the zeros around the map.
    fn read(&self) -> [usize; 2] {
        [0, 1].map(|axis| self.made[axis + 1] + self.kernel[axis] - 1)
    }

    /// Number of weights between all input channels and one block of output channels.
    fn block_len(&self) -> usize {
        self.map[0] * self.kernel[0] * self.kernel[1] * CHANNELS
    }
}

impl Direct {
    /// `kernels` is `[O, I, S, T]`; `bias` has one value for all channels, or one for each.
    pub(super) fn new(shape: Shape, kernels: &Tensor, bias: &Tensor) -> TractResult<Self> {
        let (made, taps) = (shape.made[0], shape.block_len() / CHANNELS);
        let kernels = kernels.try_as_plain_ram()?;
        let kernels = kernels.as_slice::<f32>()?;
        let bias = bias.try_as_plain_ram()?;
        let bias = bias.as_slice::<f32>()?;
        ensure!(kernels.len() == made * taps, "kernels of another size");
        ensure!(bias.len() == 1 || bias.len() == made, "a bias of another size");
        let blocks = made.div_ceil(CHANNELS);
        let mut weights = vec![0.0; blocks * shape.block_len()];
        let mut biases = vec![0.0; blocks * CHANNELS];
        for (o, of_channel) in kernels.chunks_exact(taps).enumerate() {
            let block = &mut weights[o / CHANNELS * shape.block_len()..][..shape.block_len()];
            for (weight, kernel) in
                block.iter_mut().skip(o % CHANNELS).step_by(CHANNELS).zip(of_channel)
            {
                *weight = *kernel;
            }
            biases[o] = bias[if bias.len() == 1 { 0 } else { o }];
        }
        Ok(Self { shape, weights: Arc::new(weights), bias: Arc::new(biases) })
    }

    /// Bytes of the weights, and number of products that one map takes.
    pub(super) fn size(&self) -> (u64, u64) {
        let Shape { map, kernel, made, .. } = self.shape;
        let weights = made[0] * map[0] * kernel[0] * kernel[1];
        ((size_of::<f32>() * weights) as u64, (weights * made[1] * made[2]) as u64)
    }

    /// The map with zeros around it.
    fn surrounded(&self, map: &[f32]) -> TractResult<Tensor> {
        let Shape { map: [channels, rows, columns], before, .. } = self.shape;
        let [read_rows, read_columns] = self.shape.read();
        let mut wide = Tensor::zero::<f32>(&[channels, read_rows, read_columns])?;
        let mut plain = wide.try_as_plain_ram_mut()?;
        let values = plain.as_slice_mut::<f32>()?;
        // If the kernel does not reach the end of the map, that end is left out.
        let (kept, width) =
            (rows.min(read_rows - before[0]), columns.min(read_columns - before[1]));
        for (channel, of_channel) in
            values.chunks_exact_mut(read_rows * read_columns).zip(map.chunks_exact(rows * columns))
        {
            let targets = channel.chunks_exact_mut(read_columns).skip(before[0]);
            for (target, row) in targets.zip(of_channel.chunks_exact(columns)).take(kept) {
                target[before[1]..before[1] + width].copy_from_slice(&row[..width]);
            }
        }
        Ok(wide)
    }
}

struct Work<'a> {
    shape: Shape,
    /// `[I, rows, columns]`, with the zeros around.
    map: &'a [f32],
    weights: &'a [f32],
    bias: &'a [f32],
    made: &'a mut [f32],
}

impl WithSimd for Work<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let [_, rows, columns] = self.shape.made;
        for row in 0..rows {
            for block in 0..self.bias.len() / CHANNELS {
                if columns >= VECTORS * S::F32_LANES {
                    self.row::<S, VECTORS>(simd, block, row);
                } else if columns >= S::F32_LANES {
                    self.row::<S, 1>(simd, block, row);
                } else {
                    self.narrow_row(block, row);
                }
            }
        }
    }
}

impl Work<'_> {
    /// Computes a row of a block of channels, V vectors of pixels at a time. If the row is no
    /// multiple of V vectors, the last ones overlap those before them.
    #[inline(always)]
    fn row<S: Simd, const V: usize>(&mut self, simd: S, block: usize, row: usize) {
        let columns = self.shape.made[2];
        let width = V * S::F32_LANES;
        for from in (0..columns).step_by(width) {
            let from = from.min(columns - width);
            let sums = self.sums::<S, V>(simd, block, row, from);
            for (channel, sums) in sums.iter().enumerate() {
                if let Some(at) = self.place(block, channel, row) {
                    let pixels = &mut self.made[at + from..at + from + width];
                    S::as_mut_simd_f32s(pixels).0.copy_from_slice(sums);
                }
            }
        }
    }

    #[inline(always)]
    fn sums<S: Simd, const V: usize>(
        &self,
        simd: S,
        block: usize,
        row: usize,
        from: usize,
    ) -> [[S::f32s; V]; CHANNELS] {
        let [kernel_rows, kernel_columns] = self.shape.kernel;
        let [read_rows, read_columns] = self.shape.read();
        let width = V * S::F32_LANES;
        let bias = &self.bias[block * CHANNELS..][..CHANNELS];
        let mut sums: [[S::f32s; V]; CHANNELS] =
            std::array::from_fn(|channel| [simd.splat_f32s(bias[channel]); V]);
        let len = self.shape.block_len();
        let weights = &self.weights[block * len..(block + 1) * len];
        let mut of_row = weights.chunks_exact(kernel_columns * CHANNELS);
        for of_channel in self.map.chunks_exact(read_rows * read_columns) {
            let rows = of_channel[row * read_columns..].chunks_exact(read_columns);
            for (pixels, weights) in rows.take(kernel_rows).zip(&mut of_row) {
                let pixels = &pixels[from..from + width + kernel_columns - 1];
                for (t, weights) in weights.chunks_exact(CHANNELS).enumerate() {
                    let (vectors, _) = S::as_simd_f32s(&pixels[t..t + width]);
                    for (sums, weight) in sums.iter_mut().zip(weights) {
                        let weight = simd.splat_f32s(*weight);
                        for (sum, vector) in sums.iter_mut().zip(vectors) {
                            *sum = simd.mul_add_e_f32s(weight, *vector, *sum);
                        }
                    }
                }
            }
        }
        sums
    }

    /// Computes a row that has fewer pixels than a vector.
    fn narrow_row(&mut self, block: usize, row: usize) {
        let Shape { map: [channels, ..], kernel, made, .. } = self.shape;
        let [read_rows, read_columns] = self.shape.read();
        let weights = &self.weights[block * self.shape.block_len()..];
        for channel in 0..CHANNELS {
            let Some(at) = self.place(block, channel, row) else { break };
            for column in 0..made[2] {
                let mut sum = self.bias[block * CHANNELS + channel];
                for i in 0..channels {
                    for s in 0..kernel[0] {
                        for t in 0..kernel[1] {
                            let tap = (i * kernel[0] + s) * kernel[1] + t;
                            let pixel = (i * read_rows + row + s) * read_columns + column + t;
                            sum += weights[tap * CHANNELS + channel] * self.map[pixel];
                        }
                    }
                }
                self.made[at + column] = sum;
            }
        }
    }

    /// Where the row of a channel begins; None if there is no such channel.
    fn place(&self, block: usize, channel: usize, row: usize) -> Option<usize> {
        let [made, rows, columns] = self.shape.made;
        let channel = block * CHANNELS + channel;
        (channel < made).then_some((channel * rows + row) * columns)
    }
}

impl PartialEq for Direct {
    fn eq(&self, other: &Self) -> bool {
        self.shape == other.shape
            && Arc::ptr_eq(&self.weights, &other.weights)
            && Arc::ptr_eq(&self.bias, &other.bias)
    }
}

impl Eq for Direct {}

impl Op for Direct {
    fn name(&self) -> StaticName {
        "DirectConvolution".into()
    }

    fn validation(&self) -> Validation {
        Validation::Rounding
    }

    op_as_typed_op!();
}

impl EvalOp for Direct {
    op_out_of_plan!();

    fn eval(&self, _: &EvalContext<'_>, inputs: TVec<TValue>) -> TractResult<TVec<TValue>> {
        let map = args_1!(inputs);
        let map = map.try_as_plain_ram()?;
        let map = map.as_slice::<f32>()?;
        let [rows, columns] = self.shape.read();
        let wide;
        let plain;
        let map = if [rows, columns] == self.shape.map[1..] {
            map
        } else {
            wide = self.surrounded(map)?;
            plain = wide.try_as_plain_ram()?;
            plain.as_slice::<f32>()?
        };
        let [made, rows, columns] = self.shape.made;
        let mut answer = Tensor::zero::<f32>(&[1, made, rows, columns])?;
        let mut values = answer.try_as_plain_ram_mut()?;
        let made = values.as_slice_mut::<f32>()?;
        let (weights, bias) = (&self.weights[..], &self.bias[..]);
        Arch::new().dispatch(Work { shape: self.shape, map, weights, bias, made });
        Ok(tvec!(answer.into_tvalue()))
    }
}

impl TypedOp for Direct {
    as_op!();

    fn output_facts(&self, _: &[&TypedFact]) -> TractResult<TVec<TypedFact>> {
        let [made, rows, columns] = self.shape.made;
        Ok(tvec!(f32::fact([1, made, rows, columns])))
    }
}
