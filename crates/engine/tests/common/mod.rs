//! The small model the tests share, and a pressure map for it.
#![allow(dead_code, reason = "each test program uses a part")]

use papilla_engine::{Backend, MAP_LEN, MAP_SIDE_PX};
use prost::Message;
use serde::Deserialize;
use tract_onnx::pb::{GraphProto, ModelProto, NodeProto};

/// A network of the operators that Papilla's models use; made by `assets/make.py`.
pub(crate) const TINY: &[u8] = include_bytes!("../assets/tiny.onnx");

/// What this build runs models in. ONNX Runtime's library is named by `ORT_DYLIB_PATH`.
pub(crate) fn backends() -> Vec<Backend> {
    let ort = cfg!(feature = "ort").then_some(Backend::Ort);
    [Backend::Tract].into_iter().chain(ort).collect()
}

/// What ONNX Runtime answers for [`press_pa`].
#[derive(Deserialize)]
pub(crate) struct Expected {
    pub(crate) max_j_per_m3: f64,
    pub(crate) sum_j_per_m3: f64,
    pub(crate) every_7th_row_and_column: Vec<Vec<f32>>,
}

pub(crate) fn expected() -> Expected {
    serde_json::from_str(include_str!("../assets/tiny.expected.json")).unwrap()
}

/// The same pressure as in `assets/make.py`, in the same f32 arithmetic.
pub(crate) fn press_pa() -> Vec<f32> {
    (0..MAP_LEN)
        .map(|i| {
            let row = (i / MAP_SIDE_PX) as f32 + 0.5;
            let column = (i % MAP_SIDE_PX) as f32 + 0.5;
            let (a, b) = ((row - 90.0) / 50.0, (column - 120.0) / 40.0);
            30_000.0 * (1.0 - (a * a + b * b)).max(0.0)
        })
        .collect()
}

/// [`TINY`] with one change, encoded again.
pub(crate) fn altered(change: impl FnOnce(&mut ModelProto)) -> Vec<u8> {
    let mut model = ModelProto::decode(TINY).unwrap();
    change(&mut model);
    model.encode_to_vec()
}

pub(crate) fn graph(model: &mut ModelProto) -> &mut GraphProto {
    model.graph.as_mut().unwrap()
}

pub(crate) fn node<'m>(model: &'m mut ModelProto, name: &str) -> &'m mut NodeProto {
    graph(model).node.iter_mut().find(|node| node.name == name).unwrap()
}

pub(crate) fn set_metadata(model: &mut ModelProto, key: &str, value: &str) {
    let entry = model.metadata_props.iter_mut().find(|entry| entry.key == key).unwrap();
    value.clone_into(&mut entry.value);
}
