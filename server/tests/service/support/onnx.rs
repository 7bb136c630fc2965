//! Writes small ONNX models, so that the service is tested on the engine it ships with.
//!
//! The file format is protobuf; these few lines write just the messages that are needed.
//! Field numbers: <https://github.com/onnx/onnx/blob/main/onnx/onnx.proto>

/// One protobuf message under construction.
#[derive(Default)]
struct Message(Vec<u8>);

impl Message {
    fn varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.0.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.0.push(value as u8);
    }

    fn int(mut self, field: u64, value: u64) -> Self {
        self.varint(field << 3);
        self.varint(value);
        self
    }

    fn bytes(mut self, field: u64, bytes: &[u8]) -> Self {
        self.varint(field << 3 | 2);
        self.varint(bytes.len() as u64);
        self.0.extend_from_slice(bytes);
        self
    }

    fn text(self, field: u64, text: &str) -> Self {
        self.bytes(field, text.as_bytes())
    }

    fn message(self, field: u64, message: &Self) -> Self {
        self.bytes(field, &message.0)
    }
}

const FLOAT: u64 = 1;

fn tensor(name: &str, shape: &[u64], values: &[f32]) -> Message {
    let raw: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let dims = shape.iter().fold(Message::default(), |m, &size| m.int(1, size));
    dims.int(2, FLOAT).text(8, name).bytes(9, &raw)
}

fn map_info(name: &str) -> Message {
    let shape = [1, 1, 224, 224]
        .iter()
        .fold(Message::default(), |m, &size| m.message(1, &Message::default().int(1, size)));
    let tensor = Message::default().int(1, FLOAT).message(2, &shape);
    Message::default().text(1, name).message(2, &Message::default().message(1, &tensor))
}

fn node(kind: &str, inputs: &[&str], output: &str) -> Message {
    let inputs = inputs.iter().fold(Message::default(), |m, input| m.text(1, input));
    inputs.text(2, output).text(3, output).text(4, kind)
}

/// An attribute: a list of whole numbers.
fn ints(name: &str, values: &[u64]) -> Message {
    let list = values.iter().fold(Message::default().text(1, name), |m, &v| m.int(8, v));
    list.int(20, 7)
}

fn convolution(inputs: &[&str], output: &str) -> Message {
    node("Conv", inputs, output)
        .message(5, &ints("kernel_shape", &[3, 3]))
        .message(5, &ints("pads", &[1, 1, 1, 1]))
}

const CHANNELS: u64 = 16;

/// A model that multiplies the map by `gain` and takes its time: `work` convolutions of 16
/// channels at full resolution run beside and add nothing.
pub(crate) fn model(gain: f32, work: usize, metadata: &[(&str, String)]) -> Vec<u8> {
    let mut graph = Message::default().text(2, "test");
    let scaled = if work == 0 { "sed_j_per_m3" } else { "scaled" };
    graph = graph.message(1, &node("Mul", &["pressure_pa", "gain"], scaled));
    graph = graph.message(5, &tensor("gain", &[1], &[gain]));
    if work > 0 {
        graph = idle_work(graph, work);
    }
    whole(graph, metadata)
}

/// A model with a transposed convolution over two axes that names the stride of one.
pub(crate) fn of_one_stride(metadata: &[(&str, String)]) -> Vec<u8> {
    let inputs = ["pressure_pa", "kernel"];
    let convolution = node("ConvTranspose", &inputs, "sed_j_per_m3")
        .message(5, &ints("kernel_shape", &[1, 1]))
        .message(5, &ints("strides", &[1]));
    let graph = Message::default().text(2, "test").message(1, &convolution);
    whole(graph.message(5, &tensor("kernel", &[1, 1, 1, 1], &[1.0])), metadata)
}

/// The file of a graph that makes an SED map of a pressure map.
fn whole(graph: Message, metadata: &[(&str, String)]) -> Vec<u8> {
    let graph = graph.message(11, &map_info("pressure_pa")).message(12, &map_info("sed_j_per_m3"));
    let opset = Message::default().text(1, "").int(2, 13);
    let mut model = Message::default().int(1, 8).text(2, "papilla-tests");
    model = model.message(7, &graph).message(8, &opset);
    for (key, value) in metadata {
        model = model.message(14, &Message::default().text(1, key).text(2, value));
    }
    model.0
}

/// Adds the convolutions, the last of which has all weights zero, and the sum.
fn idle_work(mut graph: Message, work: usize) -> Message {
    let mut from = "pressure_pa".to_owned();
    for layer in 0..=work {
        let ins = if layer == 0 { 1 } else { CHANNELS };
        let outs = if layer == work { 1 } else { CHANNELS };
        // An average of the inputs, so that values neither grow nor fade.
        let weight = if layer == work { 0.0 } else { 1.0 / (9.0 * ins as f32) };
        let (to, weights) = (format!("layer{layer}"), format!("weights{layer}"));
        graph = graph.message(1, &convolution(&[&from, &weights], &to));
        let values = vec![weight; (outs * ins * 9) as usize];
        graph = graph.message(5, &tensor(&weights, &[outs, ins, 3, 3], &values));
        from = to;
    }
    graph.message(1, &node("Add", &["scaled", &from], "sed_j_per_m3"))
}
