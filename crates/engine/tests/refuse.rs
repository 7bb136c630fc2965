//! Files that are no Papilla model: each is refused with an error that names the fault.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used, clippy::type_complexity)]

mod common;

use common::{TINY, altered, graph, node, set_metadata};
use papilla_engine::card::{Card, Index, Latency, Metrics, Similarity, Spread};
use papilla_engine::{EngineError, Model, ModelInfo, load};
use serde_json::json;
use std::sync::Arc;
use tract_onnx::pb::{
    StringStringEntryProto, ValueInfoProto, tensor_proto::DataType,
    tensor_shape_proto::dimension::Value, type_proto,
};

fn refused(onnx: &[u8]) -> EngineError {
    refused_with(onnx, None)
}

fn refused_with(onnx: &[u8], card: Option<&Card>) -> EngineError {
    let result: Result<Arc<dyn Model>, _> = load(onnx, card);
    let Err(error) = result else { panic!("loaded a model that breaks the contract") };
    error
}

fn dims(value: &mut ValueInfoProto) -> &mut type_proto::Tensor {
    let Some(type_proto::Value::TensorType(tensor)) = value.r#type.as_mut().unwrap().value.as_mut()
    else {
        panic!("not a tensor")
    };
    tensor
}

#[test]
fn what_is_not_onnx() {
    for bytes in [&b""[..], b"\x00", b"<html>not found</html>", &[0xff; 300]] {
        let error = refused(bytes);
        assert!(matches!(error, EngineError::NotOnnx { .. }), "{error}");
    }
}

#[test]
fn a_model_cut_short_at_any_place() {
    for length in (0..TINY.len()).step_by(211).chain([TINY.len() - 1]) {
        let error = refused(&TINY[..length]);
        assert!(
            matches!(error, EngineError::NotOnnx { .. } | EngineError::MissingMetadata { .. }),
            "{length} bytes: {error}"
        );
    }
}

#[test]
fn a_flipped_bit_never_panics_and_never_escapes_the_card() {
    let card = card_of(load(TINY, None).unwrap().info());
    assert!(load(TINY, Some(&card)).is_ok());
    let mut bytes = TINY.to_vec();
    // Wide steps through the mask, which fills bytes 2500 to 51000 or so; narrow elsewhere.
    let places = (0..TINY.len()).filter(|i| i % 4999 == 0 || !(2_500..51_000).contains(i));
    for (n, place) in places.step_by(23).enumerate() {
        bytes[place] ^= 1 << (n % 8);
        let error = refused_with(&bytes, Some(&card));
        assert!(
            !matches!(error, EngineError::Backend { .. } | EngineError::Panicked { .. }),
            "byte {place}: reached the backend: {error}"
        );
        // Without a card it may load (a weight changed a little) but must not panic.
        if let Ok(model) = load(&bytes, None) {
            assert_ne!(model.info().onnx_sha256, card.onnx_sha256);
        }
        bytes[place] ^= 1 << (n % 8);
    }
}

#[test]
fn another_format_version() {
    let error = refused(&altered(|model| set_metadata(model, "papilla.format", "2")));
    assert!(matches!(error, EngineError::UnsupportedFormat { found: 2, .. }), "{error}");
}

#[test]
fn missing_or_senseless_metadata() {
    let error = refused(&altered(|model| model.metadata_props.clear()));
    assert!(matches!(error, EngineError::MissingMetadata { key: "papilla.format" }), "{error}");
    for (key, value) in [
        ("papilla.format", "one"),
        ("papilla.name", "../../etc/passwd"),
        ("papilla.name", ""),
        ("papilla.atlas_hash", "short"),
        ("papilla.atlas_hash", &"AB".repeat(32)),
        ("papilla.dataset_sha256", "?"),
        ("papilla.effects", "layers"),
        ("papilla.network", "{"),
        ("papilla.pressure_max_pa", "NaN"),
        ("papilla.pressure_max_pa", "-1"),
        ("papilla.pressure_max_pa", "inf"),
        ("papilla.sed_max_j_per_m3", "0"),
        ("papilla.sed_max_j_per_m3", "1e999"),
    ] {
        let error = refused(&altered(|model| set_metadata(model, key, value)));
        assert!(
            matches!(&error, EngineError::BadMetadata { key: found, .. } if *found == key),
            "{key}={value}: {error}"
        );
    }
}

#[test]
fn other_inputs_and_outputs() {
    let wrong_side = |onnx: &[u8], expected: &str, says: &str| {
        let error = refused(onnx);
        let text = error.to_string();
        assert!(
            matches!(error, EngineError::Interface { side, .. } if side == expected)
                && text.contains(says),
            "{text}"
        );
    };
    let onnx = altered(|m| "force".clone_into(&mut graph(m).input[0].name));
    wrong_side(&onnx, "input", "force");
    let onnx = altered(|m| "stress".clone_into(&mut graph(m).output[0].name));
    wrong_side(&onnx, "output", "stress");
    let onnx = altered(|m| {
        let shape = dims(&mut graph(m).input[0]).shape.as_mut().unwrap();
        shape.dim[3].value = Some(Value::DimValue(128));
    });
    wrong_side(&onnx, "input", "[1, 1, 224, 128]");
    let onnx = altered(|m| {
        let shape = dims(&mut graph(m).input[0]).shape.as_mut().unwrap();
        shape.dim[0].value = Some(Value::DimParam("batch".into()));
    });
    wrong_side(&onnx, "input", "[batch, 1, 224, 224]");
    let onnx = altered(|m| dims(&mut graph(m).input[0]).elem_type = 10);
    wrong_side(&onnx, "input", "float16");
    let onnx = altered(|m| {
        let second = graph(m).output[0].clone();
        graph(m).output.push(second);
    });
    wrong_side(&onnx, "output", "sed_j_per_m3 float32 [1, 1, 224, 224], sed_j_per_m3");
    wrong_side(&altered(|m| graph(m).input.clear()), "input", "missing");
}

#[test]
fn weights_of_16_bits_are_checked_too() {
    let with = |bits: u16| {
        altered(|m| {
            let tensor = graph(m).initializer.iter_mut().find(|t| t.name == "bottom.w").unwrap();
            let count = tensor.raw_data.len() / 4;
            tensor.data_type = DataType::Float16 as i32;
            tensor.raw_data = [[0; 2], bits.to_le_bytes()].concat().repeat(count / 2);
        })
    };
    for (bits, infinite) in [(0x7c00, true), (0x7e00, false)] {
        let error = refused(&with(bits));
        let EngineError::NonFiniteWeight { tensor, index: 1, value } = error else {
            panic!("{error}")
        };
        assert_eq!((tensor.as_str(), value.is_infinite()), ("bottom.w", infinite));
    }
}

#[test]
fn weights_that_are_no_numbers_or_not_there() {
    let onnx = altered(|m| {
        let tensor = graph(m).initializer.iter_mut().find(|t| t.name == "bottom.w").unwrap();
        tensor.raw_data[40..44].copy_from_slice(&f32::NAN.to_le_bytes());
    });
    let error = refused(&onnx);
    assert!(
        matches!(&error, EngineError::NonFiniteWeight { tensor, index: 10, .. } if tensor == "bottom.w"),
        "{error}"
    );
    for change in [
        |t: &mut tract_onnx::pb::TensorProto| t.dims = vec![i64::MAX, i64::MAX],
        |t: &mut tract_onnx::pb::TensorProto| t.dims[0] = -1,
        |t: &mut tract_onnx::pb::TensorProto| t.raw_data.truncate(10),
        |t: &mut tract_onnx::pb::TensorProto| t.data_type = 99,
        |t: &mut tract_onnx::pb::TensorProto| t.data_type = 8,
        |t: &mut tract_onnx::pb::TensorProto| {
            t.external_data.push(StringStringEntryProto {
                key: "location".into(),
                value: "/etc/passwd".into(),
            });
        },
    ] {
        let error = refused(&altered(|m| change(&mut graph(m).initializer[1])));
        assert!(matches!(error, EngineError::BrokenTensor { .. }), "{error}");
    }
}

#[test]
fn graphs_the_backend_cannot_run() {
    let onnx = altered(|m| "Convolve".clone_into(&mut node(m, "encoder").op_type));
    assert!(matches!(refused(&onnx), EngineError::Operator { .. }));
    let onnx = altered(|m| "nowhere".clone_into(&mut node(m, "encoder").input[0]));
    assert!(matches!(refused(&onnx), EngineError::Operator { .. }));
    // A decoder fed half the channels it has weights for.
    let onnx = altered(|m| "encoder.relu".clone_into(&mut node(m, "decoder").input[0]));
    assert!(matches!(refused(&onnx), EngineError::Backend { .. } | EngineError::Panicked { .. }));
}

#[test]
fn a_graph_that_asks_for_all_memory() {
    let onnx = altered(|m| {
        for attribute in &mut node(m, "encoder").attribute {
            if attribute.name == "pads" {
                attribute.ints = vec![1 << 20; 4];
            }
        }
    });
    let error = refused(&onnx);
    assert!(matches!(error, EngineError::Operator { .. }), "{error}");
}

#[test]
fn a_network_that_answers_nonsense() {
    let onnx = altered(|m| "Identity".clone_into(&mut node(m, "head.relu").op_type));
    let negative = altered(|m| {
        "Identity".clone_into(&mut node(m, "head.relu").op_type);
        let head = graph(m).initializer.iter_mut().find(|t| t.name == "head.w").unwrap();
        for weight in head.raw_data.chunks_exact_mut(4) {
            weight[3] |= 0x80; // the sign
        }
    });
    assert!(load(&onnx, None).is_ok(), "positive weights need no ReLU here");
    let error = refused(&negative);
    assert!(matches!(error, EngineError::NegativeOutput { .. }), "{error}");
}

#[test]
fn the_card_of_another_model() {
    let info = load(TINY, None).unwrap().info().clone();
    let good = card_of(&info);
    let changes: [(&str, fn(&mut Card)); 7] = [
        ("name", |c| c.name.push('x')),
        ("onnx_sha256", |c| c.onnx_sha256 = "0".repeat(64)),
        ("atlas_hash", |c| c.atlas_hash = "0".repeat(64)),
        ("dataset_sha256", |c| c.dataset_sha256 = "0".repeat(64)),
        ("pressure_range_pa", |c| c.pressure_range_pa[1] *= 2.0),
        ("effects", |c| c.effects.clear()),
        ("network", |c| c.network["kind"] = json!("x")),
    ];
    for (name, change) in changes {
        let mut card = good.clone();
        change(&mut card);
        let error = refused_with(TINY, Some(&card));
        assert!(
            matches!(&error, EngineError::CardMismatch { field, .. } if *field == name),
            "{name}: {error}"
        );
    }
}

#[test]
fn cards_and_indices_are_checked_when_read() {
    let card = card_of(load(TINY, None).unwrap().info());
    let text = card.to_json().unwrap();
    assert_eq!(Card::from_json(&text).unwrap(), card);
    let newer = text.replace("\"format\": 1", "\"format\": 9");
    assert!(matches!(
        Card::from_json(&newer),
        Err(EngineError::UnsupportedFormat { found: 9, .. })
    ));
    assert!(matches!(Card::from_json(&text[..80]), Err(EngineError::BadCard { .. })));
    let marked = format!("\u{feff}{text}");
    assert_eq!(Card::from_json(&marked).unwrap(), card);
    for (known, slip) in [("\"effects\"", "patern_max"), ("\"p50\"", "p51"), ("\"ssim\"", "ssmi")] {
        let more = text.replacen(known, &format!("\"{slip}\": 1, {known}"), 1);
        let error = Card::from_json(&more).unwrap_err().to_string();
        assert!(error.contains(slip), "{slip}: {error}");
    }
    let index = Index::from_json(r#"{"default":"a","models":["a","b"]}"#).unwrap();
    assert_eq!(index.models, ["a", "b"]);
    let misspelt = r#"{"default":"a","models":["a"],"defualt":"b"}"#;
    let error = Index::from_json(misspelt).unwrap_err().to_string();
    assert!(error.contains("defualt"), "{error}");
    assert!(index.on_demand.is_empty());
    let late = Index::from_json(r#"{"default":"a","models":["a","b"],"on_demand":["b"]}"#).unwrap();
    assert_eq!(late.on_demand, ["b"]);
    for bad in [
        r#"{"default":"c","models":["a","b"]}"#,
        "{}",
        r#"{"default":1,"models":[]}"#,
        r#"{"default":"a","models":["a","b"],"on_demand":["c"]}"#,
        r#"{"default":"a","models":["a","b"],"on_demand":["b","a"]}"#,
    ] {
        let error = Index::from_json(bad).unwrap_err();
        assert!(matches!(error, EngineError::BadIndex { .. }), "{error}");
        assert!(!error.to_string().contains("card"), "{error}");
    }
}

fn card_of(info: &ModelInfo) -> Card {
    let spread = Spread { median: 0.1, p95: 0.2 };
    let metrics = Metrics {
        dataset_sha256: None,
        split: "test".into(),
        samples: 1,
        relative_l2: spread,
        far_field_relative_l2: None,
        peak_error: spread,
        peak_distance_mm: None,
        nail_base_error: None,
        total_energy_error: spread,
        ssim: Similarity { median: 0.9, p5: 0.8 },
    };
    let latency_ms = Latency { backend: info.backend.clone(), threads: 1, p50: 1.0, p99: 2.0 };
    Card { training: json!({"seed": 7}), ..Card::of(info, metrics, latency_ms) }
}
