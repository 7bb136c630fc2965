//! Hands joined columns on, so that tract does not take a product with them apart again.

use tract_onnx::tract_core::internal::*;

/// Passes its input on. tract's rewriting rules do not look behind it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Joined;

impl Op for Joined {
    fn name(&self) -> StaticName {
        "Joined".into()
    }

    op_as_typed_op!();
}

impl EvalOp for Joined {
    op_out_of_plan!();

    fn eval(&self, _: &EvalContext<'_>, inputs: TVec<TValue>) -> TractResult<TVec<TValue>> {
        Ok(inputs)
    }
}

impl TypedOp for Joined {
    as_op!();

    fn output_facts(&self, inputs: &[&TypedFact]) -> TractResult<TVec<TypedFact>> {
        Ok(tvec!(inputs[0].without_value()))
    }
}
