//! Chains of operators that move axes, each run as one pass over the values.
//!
//! A transposition turns pixels into the channels of blocks, and channels into pixels. tract
//! addresses every value by an index over all axes: 40 us for 50176 values, as long as a
//! convolution takes. Here the loops are found when the model is loaded, and rows are copied, split
//! or interleaved.

mod reorder;
#[cfg(test)]
mod tests;

use crate::rewrite::replace;
use reorder::Reorder;
use tract_onnx::tract_core::internal::*;
use tract_onnx::tract_core::ops::change_axes::AxisOp;

/// Replaces every chain of axis operations that moves an axis. A chain that is no nest of loops
/// stays.
pub(crate) fn run_by_rows(mut model: TypedModel) -> TractResult<TypedModel> {
    // This begins at the outputs, so that each chain is found from its end.
    for end in model.eval_order()?.into_iter().rev() {
        if let Some((start, order)) = chain(&model, end)? {
            replace(&mut model, start, end, "rows", order)?;
        }
    }
    model.compact()?;
    Ok(model)
}

/// The longest chain that ends at a node: where it starts, and what it does.
fn chain(model: &TypedModel, end: usize) -> TractResult<Option<(OutletId, Reorder)>> {
    let (mut steps, mut start, mut at) = (Vec::new(), None, end);
    while let Some(step) = model.nodes[at].op_as::<AxisOp>() {
        let input = model.nodes[at].inputs[0];
        steps.push(step);
        start = Some(input);
        let feeds = &model.nodes[input.node].outputs[input.slot].successors;
        if feeds.len() != 1 || model.output_outlets()?.contains(&input) {
            break;
        }
        at = input.node;
    }
    let moves = steps.iter().any(|step| matches!(step, AxisOp::Move(..)));
    let (Some(start), true) = (start, moves) else { return Ok(None) };
    let fact = model.outlet_fact(start)?;
    let is_f32 = fact.is_plain() && fact.datum_type == f32::datum_type();
    let (Some(shape), true) = (fact.shape.as_concrete(), is_f32) else { return Ok(None) };
    let len = shape.iter().product::<usize>();
    let Ok(len) = u32::try_from(len) else { return Ok(None) };
    let mut index = Tensor::from_shape(shape, &(0..len).collect::<Vec<_>>())?;
    for step in steps.iter().rev() {
        step.change_tensor(&mut index, false)?;
    }
    let shape = index.shape().into();
    let index = index.try_as_plain_ram()?;
    Ok(Reorder::new(shape, index.as_slice::<u32>()?).map(|order| (start, order)))
}
