//! Chains of picking, weighting and adding, each turned into one sparse linear map.
//!
//! A model samples the pressure of each vertex from a few pixels, and gives each pixel the weighted
//! densities of three vertices. In a graph this is `Gather`, `Mul` and `ReduceSum` over three times
//! 50176 values. tract spends more time on it than on all products of a small network: it evaluates
//! the constant indices anew for every map, and writes every intermediate result to memory. Here
//! the chain becomes one pass over a table that is made when the model is loaded.

mod map;
mod terms;
#[cfg(test)]
mod tests;

use crate::rewrite::replace;
use map::SparseMap;
use terms::Terms;
use tract_onnx::tract_core::internal::*;
use tract_onnx::tract_core::ops::{
    array::Gather,
    binary::TypedBinOp,
    change_axes::AxisOp,
    math::Mul,
    nn::{Reduce, Reducer},
};

/// Replaces every chain that holds a `Gather` with constant indices. A chain that it cannot read
/// stays.
pub(crate) fn fuse(mut model: TypedModel) -> TractResult<TypedModel> {
    // This begins at the outputs, so that each chain is found from its end.
    for end in model.eval_order()?.into_iter().rev() {
        if let Some((start, map)) = chain(&model, end)? {
            replace(&mut model, start, end, "sparse", map)?;
        }
    }
    model.compact()?;
    Ok(model)
}

/// If a node is a sparse map: bytes of its table, and number of its terms.
pub(crate) fn table(node: &TypedNode) -> Option<(u64, u64)> {
    node.op_as::<SparseMap>().map(SparseMap::size)
}

/// The longest chain that ends at a node: where it starts, and what it does.
fn chain(model: &TypedModel, end: usize) -> TractResult<Option<(OutletId, SparseMap)>> {
    let mut nodes = Vec::new();
    let (mut at, mut gathers) = (end, false);
    let mut start = None;
    while let Some(input) = link(model, at)? {
        let node = &model.nodes[at];
        // A sum that is picked several times would be computed anew each time.
        if gathers && node.op_is::<Reduce>() {
            break;
        }
        gathers |= node.op_is::<Gather>();
        nodes.push(at);
        start = Some(input);
        let feeds = &model.nodes[input.node].outputs[input.slot].successors;
        if feeds.len() != 1 || model.output_outlets()?.contains(&input) {
            break;
        }
        at = input.node;
    }
    let (Some(start), true) = (start, gathers) else { return Ok(None) };
    let Some(shape) = model.outlet_fact(start)?.shape.as_concrete() else { return Ok(None) };
    let source_len = shape.iter().product();
    let mut terms = Terms::source(shape);
    for &node in nodes.iter().rev() {
        terms = match terms {
            Some(terms) => step(model, node, &terms)?,
            None => return Ok(None),
        };
    }
    Ok(terms.map(|terms| (start, SparseMap::new(&terms, source_len))))
}

/// The input that a link of a chain acts on; None if the node cannot be part of a chain.
fn link(model: &TypedModel, node: usize) -> TractResult<Option<OutletId>> {
    let node = &model.nodes[node];
    let facts = model.node_input_facts(node.id)?;
    let is_f32 = |fact: &TypedFact| fact.is_plain() && fact.datum_type == f32::datum_type();
    let acts_on = if node.op_is::<Gather>() {
        (facts[1].konst.is_some() && facts[0].konst.is_none()).then_some(0)
    } else if node.op_as::<TypedBinOp>().is_some_and(|op| op.0.is::<Mul>() && op.1.is_none()) {
        factor(&facts).map(|factor| 1 - factor)
    } else if let Some(reduce) = node.op_as::<Reduce>() {
        matches!(reduce.reducer, Reducer::Sum).then_some(0)
    } else {
        let moves = |op: &AxisOp| matches!(op, AxisOp::Move(..));
        node.op_as::<AxisOp>().is_some_and(|op| !moves(op)).then_some(0)
    };
    Ok(acts_on.filter(|&input| is_f32(facts[input])).map(|input| node.inputs[input]))
}

/// Which of the two inputs of a product is the constant; None if not exactly one is.
fn factor(facts: &[&TypedFact]) -> Option<usize> {
    let [a, b] = facts else { return None };
    match (a.konst.is_some(), b.konst.is_some()) {
        (true, false) => Some(0),
        (false, true) => Some(1),
        _ => None,
    }
}

/// Adds one link to the chain's terms; None if it cannot be read.
fn step(model: &TypedModel, node: usize, terms: &Terms) -> TractResult<Option<Terms>> {
    let facts = model.node_input_facts(node)?;
    let node = &model.nodes[node];
    let konst = |input: usize| facts.get(input).and_then(|fact| fact.konst.as_deref());
    if let Some(op) = node.op_as::<Gather>() {
        let Some(indices) = konst(1) else { return Ok(None) };
        let plain = indices.try_as_plain_ram()?;
        return Ok(terms.gather(op.axis, indices.shape(), plain.as_slice::<i64>()?));
    }
    if let Some(op) = node.op_as::<Reduce>() {
        let sum = |terms: Option<Terms>, axis: &usize| terms.and_then(|terms| terms.sum(*axis));
        return Ok(op.axes.iter().fold(Some(terms.clone()), sum));
    }
    if let Some(factor) = factor(&facts).and_then(konst) {
        return Ok(terms.scale(factor));
    }
    let shape = node.outputs[0].fact.shape.as_concrete();
    Ok(shape.and_then(|shape| terms.reshape(shape)))
}
