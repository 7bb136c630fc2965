//! Which operators a graph may use, and how large the results of its constants may be.
//!
//! While tract reads a model, it computes what depends on constants alone. At that time no shapes
//! can be looked at, and an allocation that fails may end the process. A file of a kilobyte is
//! enough (`Pad` by 2^38, an outer product of two long lists). So only those operators are accepted
//! whose output is no longer than their inputs or attributes say, and these are checked here.

use crate::{EngineError, MAP_SIDE_PX, tract_backend::TENSOR_LEN_MAX};
use std::collections::{HashMap, HashSet};
use tract_onnx::pb::{AttributeProto, GraphProto, NodeProto};

/// Their output has the shape to which their inputs are broadcast.
const ELEMENTWISE: [&str; 36] = [
    "Abs",
    "Add",
    "Cast",
    "Clip",
    "Cos",
    "Div",
    "Elu",
    "Equal",
    "Erf",
    "Exp",
    "Gelu",
    "Greater",
    "HardSigmoid",
    "HardSwish",
    "Identity",
    "LeakyRelu",
    "Less",
    "Log",
    "Max",
    "Min",
    "Mod",
    "Mul",
    "Neg",
    "PRelu",
    "Pow",
    "Reciprocal",
    "Relu",
    "Sigmoid",
    "Sin",
    "Softplus",
    "Softsign",
    "Sqrt",
    "Sub",
    "Tanh",
    "Not",
    "Where",
];

/// Their output is at most as long as the product of their inputs' lengths.
const PRODUCTS: [&str; 4] = ["Einsum", "Gather", "Gemm", "MatMul"];

/// Their output is at most as long as their first input.
const REARRANGING: [&str; 17] = [
    "ArgMax",
    "ArgMin",
    "Flatten",
    "ReduceL1",
    "ReduceL2",
    "ReduceMax",
    "ReduceMean",
    "ReduceMin",
    "ReduceProd",
    "ReduceSum",
    "ReduceSumSquare",
    "Reshape",
    "Slice",
    "Softmax",
    "Squeeze",
    "Transpose",
    "Unsqueeze",
];

/// They are accepted only if an input depends on the map. Their output's shape follows from that
/// input's, and is checked once tract has worked out all shapes.
const OF_THE_MAP: [&str; 15] = [
    "AveragePool",
    "BatchNormalization",
    "Conv",
    "ConvTranspose",
    "DepthToSpace",
    "GlobalAveragePool",
    "GlobalMaxPool",
    "GroupNormalization",
    "InstanceNormalization",
    "LayerNormalization",
    "MaxPool",
    "Pad",
    "Resize",
    "SpaceToDepth",
    "Split",
];

/// Attributes that say how far a window reaches, px.
const WINDOWS: [&str; 6] =
    ["kernel_shape", "pads", "strides", "dilations", "output_padding", "output_shape"];

/// Checks every node of a graph whose tensors have been checked.
///
/// # Errors
/// [`EngineError::Operator`], [`EngineError::TooLarge`].
pub(crate) fn check(graph: &GraphProto) -> Result<(), EngineError> {
    // Greatest lengths of the tensors that depend on the file alone.
    let mut constants: HashMap<&str, u64> =
        graph.initializer.iter().map(|t| (t.name.as_str(), length(&t.dims))).collect();
    // Names of the tensors that depend on the map.
    let mut variables: HashSet<&str> = graph.input.iter().map(|i| i.name.as_str()).collect();
    for node in &graph.node {
        let refuse = |reason: &str| {
            let (node, kind) = (node.name.clone(), node.op_type.clone());
            Err(EngineError::Operator { node, kind, reason: reason.to_owned() })
        };
        for attribute in &node.attribute {
            if attribute.sparse_tensor.is_some() || !attribute.sparse_tensors.is_empty() {
                return refuse("its tensor is sparse");
            }
            if reaches_too_far(attribute) {
                return refuse(&format!("its {} goes beyond any map", attribute.name));
            }
        }
        let is_known = |name: &&String| {
            constants.contains_key(name.as_str()) || variables.contains(name.as_str())
        };
        // An empty name stands for an input that is left out.
        let mut inputs = node.input.iter().filter(|name| !name.is_empty());
        if let Some(stranger) = inputs.find(|name| !is_known(name)) {
            return refuse(&format!("its input '{stranger}' is made by no node before it"));
        }
        if let Some(twin) = node.output.iter().find(is_known) {
            return refuse(&format!("'{twin}' is made twice"));
        }
        let Some(length) = made_of_constants(node, &constants)? else {
            variables.extend(node.output.iter().map(String::as_str));
            continue;
        };
        if length > TENSOR_LEN_MAX as u64 {
            return Err(EngineError::TooLarge {
                node: node.name.clone(),
                values: format!("up to {length}"),
                limit: TENSOR_LEN_MAX,
            });
        }
        constants.extend(node.output.iter().map(|output| (output.as_str(), length)));
    }
    Ok(())
}

fn length(dims: &[i64]) -> u64 {
    dims.iter().fold(1, |n: u64, &dim| n.saturating_mul(dim.max(0).unsigned_abs()))
}

/// Whether an attribute lets a window reach further than any model needs: a kernel as large as the
/// map is a sum over all of it.
fn reaches_too_far(attribute: &AttributeProto) -> bool {
    const SIDE: u64 = MAP_SIDE_PX as u64;
    let limit = if attribute.name == "kernel_shape" { SIDE } else { 2 * SIDE };
    WINDOWS.contains(&attribute.name.as_str())
        && attribute.ints.iter().any(|int| int.unsigned_abs() > limit)
}

/// The most values in the output of `node`, if that depends on constants alone. None: it depends on
/// the map, and then its shape is known before it is computed.
fn made_of_constants(
    node: &NodeProto,
    constants: &HashMap<&str, u64>,
) -> Result<Option<u64>, EngineError> {
    let kind = node.op_type.as_str();
    let refuse = |reason: &str| {
        let (node, kind) = (node.name.clone(), kind.to_owned());
        Err(EngineError::Operator { node, kind, reason: reason.to_owned() })
    };
    if !node.domain.is_empty() && node.domain != "ai.onnx" {
        return refuse("it is not of ONNX's own operators");
    }
    if kind == "Constant" {
        let lengths = node.attribute.iter().map(|a| {
            let lists = a.ints.len().max(a.floats.len()).max(a.strings.len()).max(1) as u64;
            a.t.as_ref().map_or(lists, |tensor| length(&tensor.dims))
        });
        return Ok(Some(lengths.max().unwrap_or(0)));
    }
    let inputs = node.input.iter().filter(|name| !name.is_empty());
    let lengths: Option<Vec<u64>> =
        inputs.map(|name| constants.get(name.as_str()).copied()).collect();
    let known = [&ELEMENTWISE[..], &PRODUCTS, &REARRANGING, &OF_THE_MAP, &["Concat"]];
    if !known.iter().any(|kinds| kinds.contains(&kind)) {
        return refuse("no Papilla model needs it, and its output may be of any length");
    }
    let Some(lengths) = lengths else { return Ok(None) };
    if OF_THE_MAP.contains(&kind) {
        return refuse("nothing that it works on depends on the map");
    }
    Ok(Some(match lengths[..] {
        [] => return refuse("it has no inputs"),
        _ if kind == "Concat" => lengths.iter().fold(0, |n: u64, &l| n.saturating_add(l)),
        [first, ..] if REARRANGING.contains(&kind) => first,
        _ => lengths.iter().fold(1, |n: u64, &l| n.saturating_mul(l.max(1))),
    }))
}
