//! Fused graphs against the graphs they came from.

use super::*;
use tract_onnx::{prelude::InferenceModelExt, tract_core::ops::math};

fn numbers(len: usize, seed: usize) -> Vec<f32> {
    (0..len).map(|i| (((i * 7919 + seed * 104_729) % 1009) as f32 - 504.0) / 504.0).collect()
}

fn tensor(shape: &[usize], seed: usize) -> Arc<Tensor> {
    let values = numbers(shape.iter().product(), seed);
    Tensor::from_shape(shape, &values).unwrap().into_arc_tensor()
}

fn indices(shape: &[usize], len: usize) -> Arc<Tensor> {
    let count: usize = shape.iter().product();
    let values: Vec<i64> = (0..count)
        // A third of them from the end.
        .map(|i| ((i * 31 + 5) % len) as i64 - if i % 3 == 0 { len as i64 } else { 0 })
        .collect();
    Tensor::from_shape(shape, &values).unwrap().into_arc_tensor()
}

/// A graph of `width` values, to which the links are added.
struct Graph {
    model: TypedModel,
    at: OutletId,
    links: usize,
}

impl Graph {
    fn new(shape: &[usize]) -> Self {
        let mut model = TypedModel::default();
        let at = model.add_source("x", f32::fact(shape)).unwrap();
        Self { model, at, links: 0 }
    }

    fn then(mut self, op: impl Into<Box<dyn TypedOp>>, constant: Option<Arc<Tensor>>) -> Self {
        self.links += 1;
        let mut inputs = tvec!(self.at);
        if let Some(constant) = constant {
            let name = format!("c{}", self.links);
            inputs.push(self.model.add_const(name, constant).unwrap());
        }
        self.at = self.model.wire_node(format!("n{}", self.links), op, &inputs).unwrap()[0];
        self
    }

    fn gather(self, axis: usize, indices: Arc<Tensor>) -> Self {
        self.then(Gather::new(axis), Some(indices))
    }

    fn times(self, factor: Arc<Tensor>) -> Self {
        self.then(math::mul(), Some(factor))
    }

    fn sum(self, axis: usize) -> Self {
        self.then(Reduce { axes: tvec!(axis), reducer: Reducer::Sum }, None)
    }

    fn done(mut self) -> TypedModel {
        self.model.select_output_outlets(&[self.at]).unwrap();
        self.model
    }
}

/// Answers before and after, and how many nodes of each kind are left.
fn compare(model: TypedModel, shape: &[usize]) -> (usize, usize) {
    let run = |model: TypedModel| {
        let plan = model.into_optimized().unwrap().into_runnable().unwrap();
        let input = tensor(shape, 3).into_tvalue();
        plan.run(tvec!(input)).unwrap().remove(0)
    };
    let fused = fuse(model.clone()).unwrap();
    let count = |is: &dyn Fn(&TypedNode) -> bool| fused.nodes.iter().filter(|n| is(n)).count();
    let left = (
        count(&|n| n.op_is::<SparseMap>()),
        count(&|n| n.op_is::<Gather>() || n.op_is::<Reduce>() || n.op_is::<TypedBinOp>()),
    );
    let (before, after) = (run(model), run(fused));
    assert_eq!(before.shape(), after.shape());
    before.close_enough(&after, Approximation::Close).unwrap();
    left
}

#[test]
fn a_weighted_pick_is_one_map() {
    for picks in [1, 2, 3, 4, 5, 8] {
        let graph = Graph::new(&[40]).gather(0, indices(&[picks, 7], 40));
        let graph = graph.times(tensor(&[picks, 7], 1)).sum(0);
        assert_eq!(compare(graph.done(), &[40]), (1, 0), "{picks} picks");
    }
}

#[test]
fn picks_of_picks_axes_and_repeated_factors_are_one_map() {
    let graph = Graph::new(&[2, 30])
        .times(tensor(&[1, 1], 7))
        .gather(1, indices(&[3, 11], 30))
        .gather(2, indices(&[50], 11))
        .times(tensor(&[2, 3, 1], 2))
        .times(tensor(&[1, 3, 50], 4))
        .sum(1)
        .then(AxisOp::Rm(1), None)
        .then(AxisOp::Reshape(0, tvec!(2.into(), 50.into()), tvec!(100.into())), None);
    assert_eq!(compare(graph.done(), &[2, 30]), (1, 0));
}

#[test]
fn weights_of_zero_leave_rows_empty() {
    let mut weights = numbers(3 * 20, 1);
    for (at, weight) in weights.iter_mut().enumerate() {
        *weight *= f32::from(u8::from(at % 20 > 5 && at % 20 != 9 && at != 12));
    }
    let weights = Tensor::from_shape(&[3, 20], &weights).unwrap().into_arc_tensor();
    let graph = Graph::new(&[9]).gather(0, indices(&[3, 20], 9)).times(weights).sum(0);
    assert_eq!(compare(graph.done(), &[9]), (1, 0));
}

#[test]
fn a_source_of_many_values_is_told_by_long_indices() {
    let graph = Graph::new(&[70_000]).gather(0, indices(&[3, 50], 70_000)).sum(0);
    assert_eq!(compare(graph.done(), &[70_000]), (1, 0));
}

#[test]
fn sums_are_not_repeated_for_every_pick() {
    let graph = Graph::new(&[4, 6]).gather(1, indices(&[5], 6)).sum(0);
    assert_eq!(compare(graph.gather(1, indices(&[90], 5)).done(), &[4, 6]), (2, 0));
}

#[test]
fn what_others_need_stays() {
    let mut graph = Graph::new(&[10]).gather(0, indices(&[2, 8], 10));
    let picked = graph.at;
    graph = graph.times(tensor(&[2, 8], 1)).sum(0);
    let sums = graph.at;
    graph.model.select_output_outlets(&[sums, picked]).unwrap();
    // The pick is an output: it is a map of its own, and the rest stays as it is.
    assert_eq!(compare(graph.model, &[10]), (1, 2));
}

#[test]
fn a_pick_beyond_the_end_stays_for_tract_to_refuse() {
    let beyond = Tensor::from_shape(&[2], &[0_i64, 10]).unwrap().into_arc_tensor();
    let model = Graph::new(&[10]).gather(0, beyond).done();
    let fused = fuse(model).unwrap();
    assert!(fused.nodes.iter().any(|node| node.op_is::<Gather>()));
}

#[test]
fn shipped_models_answer_as_before() {
    for name in ["nano", "small", "half-space"] {
        let path = format!("{}/../../models/{name}.onnx", env!("CARGO_MANIFEST_DIR"));
        let mut proto = crate::onnx::decode(&std::fs::read(path).unwrap()).unwrap();
        crate::widen::widen(&mut proto);
        let typed = tract_onnx::onnx().model_for_proto_model(&proto).unwrap().into_typed().unwrap();
        let model = typed.into_decluttered().unwrap();
        let pressure_pa: Vec<f32> = (0..224 * 224)
            .map(|i| {
                let (row, column) = ((i / 224) as f32 - 90.0, (i % 224) as f32 - 100.0);
                2e4 * (1.0 - (row * row + column * column) / 900.0).max(0.0)
            })
            .collect();
        let pressure = Tensor::from_shape(&[1, 1, 224, 224], &pressure_pa).unwrap().into_tvalue();
        let run = |model: TypedModel| {
            let plan = model.into_optimized().unwrap().into_runnable().unwrap();
            let answer = plan.run(tvec!(pressure.clone())).unwrap().remove(0);
            answer.try_as_plain_ram().unwrap().as_slice::<f32>().unwrap().to_vec()
        };
        let fused = fuse(model.clone()).unwrap();
        assert!(fused.nodes.iter().all(|node| !node.op_is::<Gather>()), "{name}");
        let (before, after) = (run(model), run(fused));
        let greatest = before.iter().fold(0.0, |a: f32, b| a.max(*b));
        let differs = before.iter().zip(&after).fold(0.0, |d: f32, (a, b)| d.max((a - b).abs()));
        assert!(greatest > 10.0, "{name}: {greatest} J/m3");
        assert!(differs < 1e-6 * greatest, "{name}: {differs} of {greatest} J/m3");
    }
}
