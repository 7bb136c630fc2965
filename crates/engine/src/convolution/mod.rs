//! Convolutions of maps, run as they stand.
//!
//! tract lays every patch of a map out as a column, packs the columns and multiplies them with the
//! kernels. Between few channels that writes and reads nine times the map for a small product: four
//! times the [bound](crate::profile). Here sums of four channels and two vectors of pixels stay in
//! registers while rows of the map pass by.

mod direct;
#[cfg(test)]
mod tests;

use crate::rewrite::replace;
use direct::{Direct, Shape};
use tract_onnx::tract_core::internal::*;
use tract_onnx::tract_core::ops::cnn::{Conv, KernelFormat};
use tract_onnx::tract_core::ops::nn::DataFormat;

/// The most weights of a convolution that is run this way (1 MiB). They are read again for every
/// row and must stay in the cache.
const WEIGHTS_MAX: usize = 1 << 18;

/// Replaces every convolution of one map with constant kernels. Kernels of one pixel are no
/// convolutions any more once tract has decluttered the graph, but products.
pub(crate) fn run_direct(mut model: TypedModel) -> TractResult<TypedModel> {
    for node in model.eval_order()? {
        if let Some(convolution) = direct(&model, node)? {
            let source = model.nodes[node].inputs[0];
            replace(&mut model, source, node, "direct", convolution)?;
        }
    }
    model.compact()?;
    Ok(model)
}

/// If a node is such a convolution: bytes of its weights, and number of products that one map
/// takes.
pub(crate) fn table(node: &TypedNode) -> Option<(u64, u64)> {
    node.op_as::<Direct>().map(Direct::size)
}

/// The convolution at a node, if it has stride 1, constant kernels and one map.
fn direct(model: &TypedModel, node: usize) -> TractResult<Option<Direct>> {
    let node = &model.nodes[node];
    let Some(op) = node.op_as::<Conv>() else { return Ok(None) };
    let facts = model.node_input_facts(node.id)?;
    let &[map, kernels, bias] = &facts[..] else { return Ok(None) };
    let pool = &op.pool_spec;
    let is_plain = op.group == 1
        && op.q_params.is_none()
        && op.kernel_fmt == KernelFormat::OIHW
        && pool.data_format == DataFormat::NCHW
        && pool.strides().iter().chain(&*pool.dilations()).all(|&step| step == 1);
    let (Some(shape), Some(kernels), Some(bias)) =
        (map.shape.as_concrete(), &kernels.konst, &bias.konst)
    else {
        return Ok(None);
    };
    let is_f32 = |tensor: &Tensor| tensor.datum_type() == f32::datum_type() && tensor.is_plain();
    let (&[1, channels, rows, columns], &[made, _, kernel_rows, kernel_columns]) =
        (shape, kernels.shape())
    else {
        return Ok(None);
    };
    if !is_plain
        || map.datum_type != f32::datum_type()
        || !is_f32(kernels)
        || !is_f32(bias)
        || kernels.len() > WEIGHTS_MAX
    {
        return Ok(None);
    }
    let padding = pool.computed_padding(&[rows, columns]);
    let shape = Shape {
        map: [channels, rows, columns],
        before: [padding[0].pad_before, padding[1].pad_before],
        kernel: [kernel_rows, kernel_columns],
        made: [made, padding[0].convoluted, padding[1].convoluted],
    };
    Direct::new(shape, kernels, bias).map(Some)
}
