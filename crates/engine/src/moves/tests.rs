//! Rewritten chains of axis operations against the chains they replace.

use super::*;
use proptest::prelude::*;

fn model(shape: &[usize], steps: &[AxisOp]) -> TypedModel {
    let mut model = TypedModel::default();
    let mut last = model.add_source("x", f32::fact(shape)).unwrap();
    for (k, step) in steps.iter().enumerate() {
        last = model.wire_node(format!("step {k}"), step.clone(), &[last]).unwrap()[0];
    }
    model.select_output_outlets(&[last]).unwrap();
    model
}

fn run(model: TypedModel, shape: &[usize]) -> (Vec<usize>, Vec<f32>) {
    let values: Vec<f32> = (0..shape.iter().product::<usize>()).map(|k| k as f32).collect();
    let source = Tensor::from_shape(shape, &values).unwrap().into_tvalue();
    let made = model.into_runnable().unwrap().run(tvec!(source)).unwrap();
    let plain = made[0].try_as_plain_ram().unwrap();
    (made[0].shape().to_vec(), plain.as_slice::<f32>().unwrap().to_vec())
}

/// Rewritten, the chain is one node after the source and writes the same values.
fn same(shape: &[usize], steps: &[AxisOp]) {
    let plain = model(shape, steps);
    let rewritten = run_by_rows(plain.clone()).unwrap();
    assert_eq!(rewritten.nodes.len(), 2, "{rewritten}");
    assert_eq!(run(rewritten, shape), run(plain, shape));
}

fn dims(values: &[usize]) -> TVec<TDim> {
    values.iter().map(TDim::from).collect()
}

#[test]
fn pixels_become_channels_of_blocks_and_channels_pixels() {
    let unshuffle = [
        AxisOp::Reshape(2, dims(&[6, 10]), dims(&[3, 2, 5, 2])),
        AxisOp::Move(3, 2),
        AxisOp::Move(5, 3),
        AxisOp::Reshape(1, dims(&[1, 2, 2]), dims(&[4])),
    ];
    same(&[1, 1, 6, 10], &unshuffle);
    let shuffle = [
        AxisOp::Reshape(1, dims(&[12]), dims(&[3, 2, 2])),
        AxisOp::Move(2, 4),
        AxisOp::Move(2, 5),
        AxisOp::Reshape(2, dims(&[4, 2, 5, 2]), dims(&[8, 10])),
    ];
    same(&[1, 12, 4, 5], &shuffle);
}

#[test]
fn what_moves_nothing_stays() {
    let shape = [2, 6];
    let plain = model(&shape, &[AxisOp::Reshape(1, dims(&[6]), dims(&[2, 3]))]);
    let rewritten = run_by_rows(plain.clone()).unwrap();
    assert_eq!(format!("{rewritten}"), format!("{plain}"));
}

#[test]
fn an_order_without_loops_is_refused() {
    assert!(Reorder::new(tvec![4], &[0, 1, 3, 2]).is_none());
    assert!(Reorder::new(tvec![4], &[1, 0, 3, 2]).is_none());
    assert!(Reorder::new(tvec![6], &[0, 1, 2, 3, 5, 4]).is_none());
    assert!(Reorder::new(tvec![2, 3], &[0, 2, 4, 1, 3, 5]).is_some());
}

proptest! {
    #[test]
    fn any_permutation_of_axes_is_one_pass(
        shape in prop::collection::vec(1_usize..5, 2..6),
        moves in prop::collection::vec((0_usize..6, 0_usize..6), 1..5),
    ) {
        let rank = shape.len();
        let steps: Vec<_> = moves
            .into_iter()
            .map(|(from, to)| (from % rank, to % rank))
            .filter(|(from, to)| from != to)
            .map(|(from, to)| AxisOp::Move(from, to))
            .collect();
        prop_assume!(!steps.is_empty());
        same(&shape, &steps);
    }
}
