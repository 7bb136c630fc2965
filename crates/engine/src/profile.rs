//! How the time of a model in tract is divided among its operators, and what each of them reads and
//! computes.

use crate::tract_backend::{SHAPE, TractModel};
use crate::{EngineError, checked, convolution, guard::guarded, products, sparse, trial_map};
use std::time::{Duration, Instant};
use tract_onnx::prelude::*;
use tract_onnx::tract_core::ops::Cost;
use tract_onnx::tract_core::ops::matmul::optimized::{MatMulOperand, OptMatMul, ProtoFusedSpec};
use tract_onnx::tract_core::plan;

/// One operator of a model, as tract runs it.
#[derive(Clone, Debug)]
pub struct Operator {
    /// Name of its node.
    pub name: String,
    /// Name of the operator in tract.
    pub kind: String,
    /// Bytes of its constants: weights, and tables of indices.
    pub constant_bytes: u64,
    /// Bytes of its inputs and outputs for one map.
    pub map_bytes: u64,
    /// Number of additions, multiplications and divisions for one map.
    pub operations: u64,
    /// Time of one map: the median of all runs.
    pub median: Duration,
}

/// Runs a model `runs` times on one contact, and times every operator.
///
/// # Errors
/// As [`load_with`](crate::load_with).
pub fn profile(onnx: &[u8], runs: usize) -> Result<Vec<Operator>, EngineError> {
    let (proto, info) = checked(onnx, None)?;
    let pressure_pa = trial_map(info.pressure_max_pa);
    let model = TractModel::load(&proto, info)?;
    let plan = model.plan();
    let typed = plan.model();
    let mut times = vec![Vec::with_capacity(runs); typed.nodes.len()];
    guarded("infer a map", || {
        let mut state = plan.spawn()?;
        for _ in 0..runs {
            let input = tensor1(&pressure_pa).into_shape(&SHAPE)?;
            state.run_plan_with_eval(
                tvec!(input.into_tvalue()),
                |context, state, node, inputs| {
                    let start = Instant::now();
                    let outputs = plan::eval(context, state, node, inputs);
                    times[node.id].push(start.elapsed());
                    outputs
                },
            )?;
        }
        Ok(())
    })?;
    let of_node = |(node, mut times): (&TypedNode, Vec<Duration>)| {
        times.sort_unstable();
        let median = times.get(times.len() / 2).copied().unwrap_or_default();
        guarded("count the operations", || operator(typed, node, median))
    };
    let all = typed.nodes.iter().zip(times).map(of_node).collect::<Result<Vec<_>, _>>()?;
    Ok(all.into_iter().filter(|operator| !operator.is_free()).collect())
}

impl Operator {
    /// Whether it is a constant or the input, for which nothing is computed.
    fn is_free(&self) -> bool {
        ["Const", "Source"].contains(&self.kind.as_str())
    }
}

fn operator(model: &TypedModel, node: &TypedNode, median: Duration) -> TractResult<Operator> {
    let inputs = model.node_input_facts(node.id)?;
    let (mut constant_bytes, mut map_bytes, mut operations) = (0, 0, 0);
    let bytes = |fact: &TypedFact| fact.mem_size().to_i64().map(i64::unsigned_abs);
    for fact in &inputs {
        let total = if fact.konst.is_some() { &mut constant_bytes } else { &mut map_bytes };
        *total += bytes(fact)?;
    }
    constant_bytes += packed_bytes(node)?;
    for output in &node.outputs {
        map_bytes += bytes(&output.fact)?;
    }
    for (cost, count) in node.op.cost(&inputs)? {
        let count = count.to_i64()?.unsigned_abs();
        match cost {
            Cost::FMA(_) => operations += 2 * count,
            Cost::Div(_) => operations += count,
            _ => {}
        }
    }
    let of_ours = sparse::table(node).or_else(|| products::table(node));
    if let Some((table_bytes, terms)) = of_ours.or_else(|| convolution::table(node)) {
        constant_bytes += table_bytes;
        operations += 2 * terms;
    }
    let (name, kind) = (node.name.clone(), node.op.name().into_owned());
    Ok(Operator { name, kind, constant_bytes, map_bytes, operations, median })
}

/// Bytes of the constant matrices that tract keeps inside a product.
fn packed_bytes(node: &TypedNode) -> TractResult<u64> {
    let Some(product) = node.op_as::<OptMatMul>() else { return Ok(0) };
    let mut bytes = 0;
    for part in &product.micro_ops {
        let ProtoFusedSpec::AddMatMul { a, b, .. } = part else { continue };
        for side in [a, b] {
            if let MatMulOperand::Const(matrix) = side {
                bytes += matrix.exotic_fact().mem_size().to_i64()?.unsigned_abs();
            }
        }
    }
    Ok(bytes)
}
