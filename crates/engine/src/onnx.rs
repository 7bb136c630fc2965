//! Checks on the ONNX file itself, before any backend sees it.

use crate::{Backend, EngineError, INPUT_NAME, MAP_SIDE_PX, OUTPUT_NAME};
use half::f16;
use tract_onnx::pb::{
    AttributeProto, GraphProto, ModelProto, TensorProto, ValueInfoProto,
    tensor_proto::DataLocation, tensor_proto::DataType,
    tensor_shape_proto::dimension::Value as Dimension, type_proto,
};
use tract_onnx::prelude::Framework;

/// Greatest depth of nested subgraphs; plain networks have none.
const DEPTH_MAX: usize = 8;

/// Decodes an ONNX file.
///
/// # Errors
/// [`EngineError::NotOnnx`] if it is cut short, garbled or something else.
pub(crate) fn decode(onnx: &[u8]) -> Result<ModelProto, EngineError> {
    let not_onnx = |reason: String| EngineError::NotOnnx { bytes: onnx.len(), reason };
    let mut reader = onnx;
    let proto = crate::guard::guarded("decode the model", || {
        tract_onnx::onnx().proto_model_for_read(&mut reader)
    })
    .map_err(|error| match error {
        EngineError::Backend { reason, .. } => not_onnx(reason),
        other => other,
    })?;
    if proto.graph.is_none() {
        return Err(not_onnx("there is no graph in it".to_owned()));
    }
    Ok(proto)
}

/// Checks inputs, outputs and every weight against the contract.
///
/// # Errors
/// [`EngineError::Interface`], [`EngineError::BrokenTensor`],
/// [`EngineError::NonFiniteWeight`], [`EngineError::Operator`], [`EngineError::TooLarge`].
pub(crate) fn check(proto: &ModelProto) -> Result<(), EngineError> {
    let Some(graph) = &proto.graph else { return Ok(()) };
    if !proto.functions.is_empty() {
        return Err(EngineError::Backend {
            backend: Backend::Tract,
            action: "read the model",
            reason: "it defines functions of its own; export it with plain operators".to_owned(),
        });
    }
    // Old exporters list the weights among the inputs as well.
    let weights: std::collections::HashSet<&str> =
        graph.initializer.iter().map(|t| t.name.as_str()).collect();
    let inputs: Vec<_> =
        graph.input.iter().filter(|i| !weights.contains(i.name.as_str())).collect();
    check_side("input", INPUT_NAME, &inputs)?;
    check_side("output", OUTPUT_NAME, &graph.output.iter().collect::<Vec<_>>())?;
    check_graph(graph, 0)?;
    crate::operators::check(graph)
}

fn check_side(
    side: &'static str,
    name: &str,
    found: &[&ValueInfoProto],
) -> Result<(), EngineError> {
    let expected = format!("{name} float32 [1, 1, {MAP_SIDE_PX}, {MAP_SIDE_PX}]");
    let described = found.iter().map(|v| describe(v)).collect::<Vec<_>>().join(", ");
    if described == expected {
        return Ok(());
    }
    let found = if described.is_empty() { "missing".to_owned() } else { described };
    Err(EngineError::Interface { side, expected, found })
}

/// `name type [shape]`, with `?` for what the file leaves open.
fn describe(value: &ValueInfoProto) -> String {
    let Some(type_proto::Value::TensorType(tensor)) =
        value.r#type.as_ref().and_then(|t| t.value.as_ref())
    else {
        return format!("{} without type", value.name);
    };
    let kind = match DataType::try_from(tensor.elem_type) {
        Ok(DataType::Float) => "float32".to_owned(),
        Ok(other) => format!("{other:?}").to_lowercase(),
        Err(_) => format!("type {}", tensor.elem_type),
    };
    let dims = tensor.shape.as_ref().map_or(&[][..], |shape| &shape.dim);
    let dims: Vec<String> = dims
        .iter()
        .map(|dim| match &dim.value {
            Some(Dimension::DimValue(n)) => n.to_string(),
            Some(Dimension::DimParam(symbol)) => symbol.clone(),
            None => "?".to_owned(),
        })
        .collect();
    format!("{} {kind} [{}]", value.name, dims.join(", "))
}

fn check_graph(graph: &GraphProto, depth: usize) -> Result<(), EngineError> {
    if depth > DEPTH_MAX {
        return Err(EngineError::Backend {
            backend: Backend::Tract,
            action: "read the model",
            reason: format!("its graphs are nested deeper than {DEPTH_MAX}"),
        });
    }
    for tensor in &graph.initializer {
        check_tensor(tensor, &tensor.name)?;
    }
    for node in &graph.node {
        for attribute in &node.attribute {
            check_attribute(attribute, &node.name, depth)?;
        }
    }
    Ok(())
}

fn check_attribute(
    attribute: &AttributeProto,
    node: &str,
    depth: usize,
) -> Result<(), EngineError> {
    let name = format!("{node}.{}", attribute.name);
    for tensor in attribute.t.iter().chain(&attribute.tensors) {
        check_tensor(tensor, &name)?;
    }
    if let Some((index, &value)) =
        attribute.floats.iter().enumerate().find(|(_, value)| !value.is_finite())
    {
        return Err(EngineError::NonFiniteWeight { tensor: name, index, value });
    }
    for graph in attribute.g.iter().chain(&attribute.graphs) {
        check_graph(graph, depth + 1)?;
    }
    Ok(())
}

fn check_tensor(tensor: &TensorProto, name: &str) -> Result<(), EngineError> {
    let broken = |reason: String| EngineError::BrokenTensor { tensor: name.to_owned(), reason };
    // A model file must not make the program read other files.
    if !tensor.external_data.is_empty()
        || tensor.data_location == Some(DataLocation::External as i32)
    {
        return Err(broken("its data lie in another file; export with the weights inside".into()));
    }
    let count = tensor
        .dims
        .iter()
        .try_fold(1usize, |n, &dim| n.checked_mul(usize::try_from(dim).ok()?))
        .ok_or_else(|| broken(format!("its shape is {:?}", tensor.dims)))?;
    let kind = DataType::try_from(tensor.data_type)
        .map_err(|_| broken(format!("its type is {}", tensor.data_type)))?;
    let size = match kind {
        DataType::Float | DataType::Int32 => 4,
        DataType::Int64 | DataType::Double => 8,
        DataType::Float16 | DataType::Int16 => 2,
        DataType::Bool | DataType::Int8 | DataType::Uint8 => 1,
        other => return Err(broken(format!("its type is {other:?}, which no Papilla model has"))),
    };
    let held = if tensor.raw_data.is_empty() {
        match kind {
            DataType::Float => tensor.float_data.len(),
            DataType::Double => tensor.double_data.len(),
            DataType::Int64 => tensor.int64_data.len(),
            _ => tensor.int32_data.len(),
        }
    } else if tensor.raw_data.len().is_multiple_of(size) {
        tensor.raw_data.len() / size
    } else {
        return Err(broken(format!(
            "{} bytes are no whole number of values",
            tensor.raw_data.len()
        )));
    };
    if held != count {
        return Err(broken(format!("{held} values for shape {:?}", tensor.dims)));
    }
    let not_finite = match kind {
        DataType::Float => {
            let raw = tensor.raw_data.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b));
            first_not_finite(raw.chain(tensor.float_data.iter().copied()))
        }
        DataType::Float16 => {
            let raw = tensor.raw_data.as_chunks::<2>().0.iter().map(|b| u16::from_le_bytes(*b));
            let listed = tensor.int32_data.iter().map(|&bits| bits as u16);
            first_not_finite(raw.chain(listed).map(|bits| f16::from_bits(bits).to_f32()))
        }
        _ => None,
    };
    if let Some((index, value)) = not_finite {
        return Err(EngineError::NonFiniteWeight { tensor: name.to_owned(), index, value });
    }
    Ok(())
}

fn first_not_finite(values: impl Iterator<Item = f32>) -> Option<(usize, f32)> {
    values.enumerate().find(|(_, value)| !value.is_finite())
}
