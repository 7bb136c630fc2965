//! Rewritten graphs against the graphs they came from.

use super::*;
use tract_onnx::tract_core::ops::einsum::EinSum;

fn tensor(shape: &[usize], seed: usize) -> Tensor {
    let values: Vec<f32> = (0..shape.iter().product())
        .map(|i| (((i * 7919 + seed * 104_729) % 1009) as f32 - 504.0) / 504.0)
        .collect();
    Tensor::from_shape(shape, &values).unwrap()
}

fn run(model: TypedModel, inputs: &[Tensor]) -> Vec<f32> {
    let plan = model.into_optimized().unwrap().into_runnable().unwrap();
    let inputs = inputs.iter().map(|tensor| tensor.clone().into_tvalue()).collect();
    let made = plan.run(inputs).unwrap();
    made[0].try_as_plain_ram().unwrap().as_slice::<f32>().unwrap().to_vec()
}

#[track_caller]
fn assert_close(found: &[f32], due: &[f32]) {
    assert_eq!(found.len(), due.len());
    for (i, (found, due)) in found.iter().zip(due).enumerate() {
        assert!((found - due).abs() <= 1e-5 * (1.0 + due.abs()), "{found} at {i}, not {due}");
    }
}

/// `x` of this shape by a constant stack of `k x n`.
fn product(shape: &[usize], axes: &str, matrices: Tensor) -> TypedModel {
    let mut model = TypedModel::default();
    let rows = model.add_source("x", f32::fact(shape)).unwrap();
    let matrices = model.add_const("w", matrices).unwrap();
    let product = EinSum::new(axes.parse().unwrap(), f32::datum_type());
    let made = model.wire_node("y", product, &[rows, matrices]).unwrap();
    model.select_output_outlets(&made).unwrap();
    model.into_decluttered().unwrap()
}

fn stacks(model: &TypedModel) -> usize {
    model.nodes.iter().filter(|node| node.op_is::<Stacked>()).count()
}

#[test]
fn a_stack_answers_as_the_products_it_replaces() {
    // Pairs of rows and a row left over; whole tiles of columns and columns left over.
    for (m, k, n) in [(2, 48, 48), (1, 5, 48), (3, 7, 61), (5, 2, 3), (4, 9, 100)] {
        let shape = [1, 6, m, k];
        let model = product(&shape, "asmk,skn->asmn", tensor(&[6, k, n], 1));
        let fast = stack(model.clone()).unwrap();
        assert_eq!(stacks(&fast), 1, "{m} {k} {n}");
        let input = [tensor(&shape, 2)];
        assert_close(&run(fast, &input), &run(model, &input));
    }
}

#[test]
fn other_products_stay() {
    let matrices = || tensor(&[6, 4, 4], 1);
    for (shape, axes, matrices) in [
        // The stack is not the matrices' first axis, the matrix is turned, there is one alone, or
        // all rows meet every matrix.
        (&[4, 6, 4][..], "msk,skn->smn", matrices()),
        (&[6, 4, 4], "smk,snk->smn", matrices()),
        (&[1, 4, 4], "smk,skn->smn", tensor(&[1, 4, 4], 1)),
        (&[3, 6, 4, 4], "asmk,skn->asmn", matrices()),
    ] {
        let model = product(shape, axes, matrices);
        let input = [tensor(shape, 2)];
        let fast = stack(model.clone()).unwrap();
        assert_eq!(stacks(&fast), 0, "{axes}");
        assert_close(&run(fast, &input), &run(model, &input));
    }
}

#[test]
fn what_is_joined_meets_one_matrix() {
    let mut model = TypedModel::default();
    let parts = [("a", 3), ("b", 5)];
    let sources: Vec<OutletId> = parts
        .iter()
        .map(|(name, columns)| model.add_source(*name, f32::fact([7, *columns])).unwrap())
        .collect();
    let joined = model.wire_node("j", TypedConcat::new(1), &sources).unwrap()[0];
    let matrix = model.add_const("w", tensor(&[8, 4], 1)).unwrap();
    let op = EinSum::new("mk,kn->mn".parse().unwrap(), f32::datum_type());
    let made = model.wire_node("y", op, &[joined, matrix]).unwrap();
    model.select_output_outlets(&made).unwrap();
    let products = |model: &TypedModel| model.nodes.iter().filter(|n| n.op_is::<EinSum>()).count();
    let kept = keep_joined(model.clone()).unwrap().into_decluttered().unwrap();
    let taken_apart = model.into_decluttered().unwrap();
    // If tract no longer does this, neither need we.
    assert_eq!((products(&taken_apart), products(&kept)), (2, 1));
    let inputs = [tensor(&[7, 3], 2), tensor(&[7, 5], 3)];
    assert_close(&run(kept, &inputs), &run(taken_apart, &inputs));
}

#[test]
fn axes_are_read() {
    assert!(is_stack("smk,skn->smn") && is_stack("abmk,bkn->abmn"));
    for other in ["mk,kn->mn", "smk,snk->smn", "smk,skn->msn", "asmk,skn->samn", "k,k->", ""] {
        assert!(!is_stack(other), "{other}");
    }
}
