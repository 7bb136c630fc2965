//! Products with constant matrices, stored in a form that is fast for one map at a time.
//!
//! tract splits a product with joined columns into one product for each part and adds the results.
//! For a thousand rows of 49 values in seven parts, this writes the result seven times. And it
//! packs both sides of every product anew. For many small products of two rows each, this takes
//! longer than the products.

mod joined;
mod stacked;
#[cfg(test)]
mod tests;

use crate::rewrite::replace;
use joined::Joined;
use stacked::Stacked;
use tract_onnx::tract_core::internal::*;
use tract_onnx::tract_core::ops::{array::TypedConcat, einsum::EinSum};

/// Keeps joined columns together. This has to be called before the graph is decluttered.
pub(crate) fn keep_joined(mut model: TypedModel) -> TractResult<TypedModel> {
    for node in model.eval_order()? {
        if model.nodes[node].op_is::<TypedConcat>()
            && !model.nodes[node].outputs[0].successors.is_empty()
        {
            let name = format!("{}.joined", model.nodes[node].name);
            TypedModelPatch::intercept(&model, node.into(), name, Joined, f32_fact(&model, node)?)?
                .apply(&mut model)?;
        }
    }
    Ok(model)
}

fn f32_fact(model: &TypedModel, node: usize) -> TractResult<TypedFact> {
    Ok(model.outlet_fact(node.into())?.without_value())
}

/// Replaces products with stacks of constant matrices. The graph must have been decluttered.
pub(crate) fn stack(mut model: TypedModel) -> TractResult<TypedModel> {
    for node in model.eval_order()? {
        if let Some(product) = stacked(&model, node)? {
            let source = model.nodes[node].inputs[0];
            replace(&mut model, source, node, "stacked", product)?;
        }
    }
    model.compact()?;
    Ok(model)
}

/// If a node is a stacked product: bytes of its matrices, and number of products that one map
/// takes.
pub(crate) fn table(node: &TypedNode) -> Option<(u64, u64)> {
    node.op_as::<Stacked>().map(Stacked::size)
}

/// The product at a node, if its second input is a constant stack of matrices.
fn stacked(model: &TypedModel, node: usize) -> TractResult<Option<Stacked>> {
    let node = &model.nodes[node];
    let Some(product) = node.op_as::<EinSum>() else { return Ok(None) };
    let facts = model.node_input_facts(node.id)?;
    let [rows, matrices] = facts[..] else { return Ok(None) };
    let Some(matrices) = matrices.konst.as_ref().filter(|_| product.q_params.is_none()) else {
        return Ok(None);
    };
    let is_f32 = |dt: DatumType| dt == f32::datum_type();
    if !is_f32(product.operating_dt) || !is_f32(rows.datum_type) || !matrices.is_plain() {
        return Ok(None);
    }
    let shapes = (rows.shape.as_concrete(), node.outputs[0].fact.shape.as_concrete());
    let (Some(rows), Some(made), true) = (shapes.0, shapes.1, is_stack(&product.axes.to_string()))
    else {
        return Ok(None);
    };
    // The axes before the stack's have length 1.
    let before = &rows[..rows.len() - 3];
    if before.iter().any(|&len| len != 1) || matrices.shape()[0] < 2 {
        return Ok(None);
    }
    Stacked::new(matrices, rows[rows.len() - 2], made).map(Some)
}

/// Whether the axes are `..smk,skn->..smn`: for each `s`, rows are multiplied by a matrix of their
/// own.
fn is_stack(axes: &str) -> bool {
    let Some((sides, made)) = axes.split_once("->") else { return false };
    let Some((rows, matrices)) = sides.split_once(',') else { return false };
    let [rows, matrices, made] =
        [rows, matrices, made].map(|side| side.chars().collect::<Vec<_>>());
    let ([.., s, m, k], [t, l, n]) = (&rows[..], &matrices[..]) else { return false };
    let before = &rows[..rows.len() - 3];
    s == t && k == l && made == [before, &[*s, *m, *n]].concat()
}
