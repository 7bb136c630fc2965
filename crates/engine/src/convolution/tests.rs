//! Rewritten convolutions against the convolutions they replace.

use super::*;
use tract_onnx::tract_core::ops::cnn::{PaddingSpec, PoolSpec};

fn tensor(shape: &[usize], seed: usize) -> Tensor {
    let values: Vec<f32> = (0..shape.iter().product())
        .map(|i| (((i * 7919 + seed * 104_729) % 1009) as f32 - 504.0) / 504.0)
        .collect();
    Tensor::from_shape(shape, &values).unwrap()
}

/// How a convolution differs from the one that is run directly.
#[derive(Clone)]
struct Case {
    map: [usize; 3],
    made: usize,
    kernel: [usize; 2],
    padding: PaddingSpec,
    stride: usize,
    dilation: usize,
    group: usize,
}

impl Case {
    fn plain(map: [usize; 3], made: usize, kernel: [usize; 2], padding: PaddingSpec) -> Self {
        Self { map, made, kernel, padding, stride: 1, dilation: 1, group: 1 }
    }

    fn model(&self) -> TypedModel {
        let [channels, rows, columns] = self.map;
        let mut model = TypedModel::default();
        let map = model.add_source("x", f32::fact([1, channels, rows, columns])).unwrap();
        let kernels = [self.made, channels / self.group, self.kernel[0], self.kernel[1]];
        let kernels = model.add_const("w", tensor(&kernels, 1)).unwrap();
        let bias = model.add_const("b", tensor(&[self.made], 3)).unwrap();
        let pool_spec = PoolSpec {
            data_format: DataFormat::NCHW,
            kernel_shape: tvec!(self.kernel[0], self.kernel[1]),
            padding: self.padding.clone(),
            dilations: Some(tvec!(self.dilation, self.dilation)),
            strides: Some(tvec!(self.stride, self.stride)),
            input_channels: channels,
            output_channels: self.made,
        };
        let op =
            Conv { pool_spec, kernel_fmt: KernelFormat::OIHW, group: self.group, q_params: None };
        let made = model.wire_node("y", op, &[map, kernels, bias]).unwrap();
        model.select_output_outlets(&made).unwrap();
        model
    }

    /// The answer of a model to the case's map.
    fn run(&self, model: TypedModel) -> Vec<f32> {
        let plan =
            model.into_decluttered().unwrap().into_optimized().unwrap().into_runnable().unwrap();
        let [channels, rows, columns] = self.map;
        let map = tensor(&[1, channels, rows, columns], 2).into_tvalue();
        let made = plan.run(tvec!(map)).unwrap();
        made[0].try_as_plain_ram().unwrap().as_slice::<f32>().unwrap().to_vec()
    }
}

fn direct_nodes(model: &TypedModel) -> usize {
    model.nodes.iter().filter(|node| node.op_is::<Direct>()).count()
}

#[test]
fn a_direct_convolution_answers_as_the_one_it_replaces() {
    let same = || PaddingSpec::SameUpper;
    let uneven = PaddingSpec::Explicit(tvec!(2, 0), tvec!(1, 3));
    for case in [
        // Whole vectors, one of them, a rest, and rows narrower than any.
        Case::plain([4, 9, 32], 16, [3, 3], same()),
        Case::plain([3, 5, 61], 6, [5, 5], same()),
        Case::plain([2, 4, 13], 1, [3, 3], same()),
        Case::plain([2, 6, 3], 5, [3, 3], same()),
        Case::plain([20, 7, 28], 8, [1, 1], PaddingSpec::Valid),
        Case::plain([3, 8, 40], 7, [3, 3], PaddingSpec::Valid),
        Case::plain([3, 8, 40], 4, [2, 4], uneven),
    ] {
        let model = case.model();
        let fast = run_direct(model.clone()).unwrap();
        assert_eq!(direct_nodes(&fast), 1, "{:?}", case.map);
        let (found, due) = (case.run(fast), case.run(model));
        assert_eq!(found.len(), due.len());
        for (i, (found, due)) in found.iter().zip(&due).enumerate() {
            assert!((found - due).abs() <= 1e-5 * (1.0 + due.abs()), "{i}: {found}, not {due}");
        }
    }
}

#[test]
fn other_convolutions_stay() {
    let plain = Case::plain([4, 8, 32], 8, [3, 3], PaddingSpec::SameUpper);
    for case in [
        Case { stride: 2, ..plain.clone() },
        Case { dilation: 2, ..plain.clone() },
        Case { group: 2, ..plain },
    ] {
        let model = case.model();
        let fast = run_direct(model.clone()).unwrap();
        assert_eq!(direct_nodes(&fast), 0);
        assert_eq!(case.run(fast), case.run(model));
    }
}
