//! Puts operators of this crate into a graph of tract, in place of those that they replace.

use tract_onnx::tract_core::internal::*;

/// Replaces everything between `source` and the output of the node `end` by `op`, whose name is
/// that node's with `.suffix`.
pub(crate) fn replace(
    model: &mut TypedModel,
    source: OutletId,
    end: usize,
    suffix: &str,
    op: impl Into<Box<dyn TypedOp>>,
) -> TractResult<()> {
    let mut patch = TypedModelPatch::new(suffix.to_owned());
    let source = patch.tap_model(model, source)?;
    let name = format!("{}.{suffix}", model.nodes[end].name);
    let made = patch.wire_node(name, op, &[source])?;
    patch.shunt_outside(model, end.into(), made[0])?;
    patch.apply(model)
}
