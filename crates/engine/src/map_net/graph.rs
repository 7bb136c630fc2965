//! Reads an ONNX graph backwards, from its output to its inputs.

use std::collections::HashMap;
use tract_onnx::pb::{
    AttributeProto, GraphProto, ModelProto, NodeProto, TensorProto, tensor_proto::DataType,
};

/// Nodes and constants of a graph, by the name of their output.
pub(super) struct Graph<'a> {
    nodes: HashMap<&'a str, &'a NodeProto>,
    constants: HashMap<&'a str, &'a TensorProto>,
    pub output: &'a str,
}

/// A constant of floats.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Floats {
    pub shape: Vec<usize>,
    pub values: Vec<f32>,
}

impl<'a> Graph<'a> {
    pub(super) fn new(model: &'a ModelProto) -> Option<Self> {
        let GraphProto { node, initializer, output, .. } = model.graph.as_ref()?;
        let mut constants: HashMap<_, _> =
            initializer.iter().map(|tensor| (tensor.name.as_str(), tensor)).collect();
        let mut nodes = HashMap::new();
        for node in node {
            let [name] = &node.output[..] else { return None };
            match attribute(node, "value").and_then(|value| value.t.as_ref()) {
                Some(tensor) if node.op_type == "Constant" => {
                    constants.insert(name.as_str(), tensor);
                }
                _ => {
                    nodes.insert(name.as_str(), node);
                }
            }
        }
        let [output] = &output[..] else { return None };
        Some(Self { nodes, constants, output: &output.name })
    }

    /// The node whose output is `name`, if it is this operator of ONNX's own set.
    pub(super) fn node(&self, name: &str, operator: &str) -> Option<&'a NodeProto> {
        let node = self.nodes.get(name)?;
        let is_standard = node.domain.is_empty() || node.domain == "ai.onnx";
        (is_standard && node.op_type == operator).then_some(node)
    }

    /// The inputs of that node, if there are N.
    pub(super) fn inputs<const N: usize>(
        &self,
        name: &str,
        operator: &str,
    ) -> Option<[&'a str; N]> {
        inputs(self.node(name, operator)?)
    }

    pub(super) fn floats(&self, name: &str) -> Option<Floats> {
        let tensor = self.constants.get(name)?;
        if tensor.data_type != DataType::Float as i32 {
            return None;
        }
        let raw = tensor.raw_data.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes));
        let values: Vec<f32> = raw.chain(tensor.float_data.iter().copied()).collect();
        let shape = shape(tensor)?;
        (shape.iter().product::<usize>() == values.len()).then_some(Floats { shape, values })
    }

    /// Shape and values of a constant, if it has N axes.
    pub(super) fn shaped<const N: usize>(&self, name: &str) -> Option<([usize; N], Vec<f32>)> {
        let Floats { shape, values } = self.floats(name)?;
        Some((shape.try_into().ok()?, values))
    }

    pub(super) fn scalar(&self, name: &str) -> Option<f32> {
        let Floats { values, .. } = self.floats(name)?;
        let [value] = values[..] else { return None };
        Some(value)
    }

    pub(super) fn is_scalar(&self, name: &str, due: f32) -> bool {
        self.scalar(name).is_some_and(|value| value.total_cmp(&due).is_eq())
    }

    pub(super) fn whole(&self, name: &str) -> Option<Vec<i64>> {
        let tensor = self.constants.get(name)?;
        if tensor.data_type != DataType::Int64 as i32 {
            return None;
        }
        let raw = tensor.raw_data.as_chunks::<8>().0.iter().map(|bytes| i64::from_le_bytes(*bytes));
        Some(raw.chain(tensor.int64_data.iter().copied()).collect())
    }

    /// If this is a product with a constant scalar: the other factor, and the scalar.
    pub(super) fn scaled(&self, name: &str) -> Option<(&'a str, f32)> {
        let [a, b] = self.inputs(name, "Mul")?;
        self.scalar(b).map(|factor| (a, factor)).or_else(|| Some((b, self.scalar(a)?)))
    }

    /// If this is a plain convolution: the map, and the shape and values of the kernels. Plain
    /// means a square kernel of odd width, stride 1, no bias, and an output of the map's size.
    pub(super) fn convolution(&self, name: &str) -> Option<(&'a str, [usize; 4], Vec<f32>)> {
        let node = self.node(name, "Conv")?;
        let [map, kernels] = inputs(node)?;
        let (shape, values) = self.shaped::<4>(kernels)?;
        let [_, _, rows, columns] = shape;
        let around = (rows / 2) as i64;
        let all = |name, due: i64| {
            attribute(node, name).is_none_or(|found| found.ints.iter().all(|int| *int == due))
        };
        let pads = attribute(node, "pads").map_or(&[][..], |pads| &pads.ints);
        let is_padded = if around == 0 {
            pads.iter().all(|pad| *pad == 0)
        } else {
            pads.len() == 4 && pads.iter().all(|pad| *pad == around)
        };
        let is_plain = rows == columns
            && rows % 2 == 1
            && is_padded
            && all("strides", 1)
            && all("dilations", 1)
            && attribute(node, "group").is_none_or(|group| group.i == 1)
            && attribute(node, "auto_pad").is_none_or(|pad| pad.s == b"NOTSET");
        is_plain.then_some((map, shape, values))
    }

    /// If this is a `Reshape`: what is reshaped, and the shape asked for.
    pub(super) fn reshaped(&self, name: &str) -> Option<(&'a str, Vec<i64>)> {
        let [from, shape] = self.inputs(name, "Reshape")?;
        Some((from, self.whole(shape)?))
    }

    /// If this turns four channels into each pixel's block of 2 x 2: the input. The four channels
    /// of one output channel have to lie one after another (mode `CRD`).
    pub(super) fn shuffled(&self, name: &str) -> Option<&'a str> {
        let node = self.node(name, "DepthToSpace")?;
        let is_plain = attribute(node, "blocksize")?.i == 2 && attribute(node, "mode")?.s == b"CRD";
        inputs::<1>(node).filter(|_| is_plain).map(|[from]| from)
    }
}

pub(super) fn inputs<const N: usize>(node: &NodeProto) -> Option<[&str; N]> {
    let inputs: Vec<&str> = node.input.iter().map(String::as_str).collect();
    inputs.try_into().ok()
}

pub(super) fn attribute<'a>(node: &'a NodeProto, name: &str) -> Option<&'a AttributeProto> {
    node.attribute.iter().find(|attribute| attribute.name == name)
}

fn shape(tensor: &TensorProto) -> Option<Vec<usize>> {
    tensor.dims.iter().map(|dim| usize::try_from(*dim).ok()).collect()
}
