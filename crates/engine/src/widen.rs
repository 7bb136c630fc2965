//! Constants that are stored in 16 bits, converted to the type of the graph.
//!
//! The trainer stores large constants as `float16` or `int16` where nothing is lost by it, followed
//! by a `Cast`. tract folds such a cast only up to a certain size, and would otherwise cast again
//! for every map.

use half::f16;
use std::collections::HashMap;
use tract_onnx::pb::{ModelProto, NodeProto, TensorProto, tensor_proto::DataType};

/// Replaces casts of stored constants by the constants that they give. The model must have passed
/// the checks of [`crate::onnx`]. Other casts stay as they are.
pub(crate) fn widen(model: &mut ModelProto) {
    let Some(graph) = &mut model.graph else { return };
    let place: HashMap<String, usize> =
        graph.initializer.iter().enumerate().map(|(i, t)| (t.name.clone(), i)).collect();
    let mut wide = Vec::new();
    graph.node.retain(|node| {
        let found = stored(node).and_then(|(name, kind)| {
            widened(graph.initializer.get(*place.get(name)?)?, kind, node.output.first()?)
        });
        let keep = found.is_none();
        wide.extend(found);
        keep
    });
    let used = |name: &str| graph.node.iter().any(|n| n.input.iter().any(|input| input == name));
    graph.initializer.retain(|t| !is_small(t) || used(&t.name));
    graph.initializer.extend(wide);
}

/// Input and target type of a node, if it is a cast.
fn stored(node: &NodeProto) -> Option<(&str, i32)> {
    let to = node.attribute.iter().find(|a| a.name == "to")?;
    let is_cast = node.op_type == "Cast" && node.input.len() == 1;
    is_cast.then_some((node.input[0].as_str(), to.i as i32))
}

fn is_small(tensor: &TensorProto) -> bool {
    [DataType::Float16 as i32, DataType::Int16 as i32].contains(&tensor.data_type)
}

fn widened(tensor: &TensorProto, kind: i32, name: &str) -> Option<TensorProto> {
    let (halves, rest) = tensor.raw_data.as_chunks::<2>();
    if halves.is_empty() || !rest.is_empty() {
        return None;
    }
    let float = |bits: &[u8; 2]| f16::from_le_bytes(*bits).to_f32().to_le_bytes();
    let whole = |bits: &[u8; 2]| i64::from(i16::from_le_bytes(*bits)).to_le_bytes();
    let raw_data = if (tensor.data_type, kind) == (DataType::Float16 as i32, DataType::Float as i32)
    {
        halves.iter().flat_map(float).collect::<Vec<u8>>()
    } else if (tensor.data_type, kind) == (DataType::Int16 as i32, DataType::Int64 as i32) {
        halves.iter().flat_map(whole).collect()
    } else {
        return None;
    };
    let (name, dims) = (name.to_owned(), tensor.dims.clone());
    Some(TensorProto { name, dims, data_type: kind, raw_data, ..Default::default() })
}
