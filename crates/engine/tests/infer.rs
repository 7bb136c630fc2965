//! A real ONNX file through the engine, against ONNX Runtime's recorded answer.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

mod common;

use common::{TINY, altered, backends, expected, graph, press_pa, set_metadata};
use half::f16;
use papilla_engine::{Backend, Choice, EngineError, MAP_LEN, MAP_SIDE_PX, Model, load, load_with};
use sha2::{Digest, Sha256};
use std::{sync::Arc, time::Duration};
use tract_onnx::pb::{
    AttributeProto, NodeProto, attribute_proto::AttributeType, tensor_proto::DataType,
};

fn assert_equals_reference(sed_j_per_m3: &[f32]) {
    let expected = expected();
    // The project's bar for tract against ONNX Runtime: 1e-5 of the maximum.
    let tolerance = 1e-5 * expected.max_j_per_m3;
    for (i, row) in expected.every_7th_row_and_column.iter().enumerate() {
        for (j, value) in row.iter().enumerate() {
            let found = sed_j_per_m3[7 * i * MAP_SIDE_PX + 7 * j];
            let difference = f64::from(found - value).abs();
            assert!(difference <= tolerance, "row {i}, column {j}: {found}, not {value}");
        }
    }
    let sum: f64 = sed_j_per_m3.iter().map(|&v| f64::from(v)).sum();
    assert!((sum / expected.sum_j_per_m3 - 1.0).abs() < 1e-5, "sum {sum}");
}

/// The same file in every backend of this build.
fn in_each(onnx: &[u8]) -> impl Iterator<Item = Arc<dyn Model>> {
    backends().into_iter().map(|backend| {
        let model = load_with(backend, onnx, None).unwrap();
        assert_eq!(model.backend(), backend);
        model
    })
}

#[test]
fn every_backend_answers_as_onnx_runtime_did() {
    for model in in_each(TINY) {
        let mut session = model.session().unwrap();
        let mut sed_j_per_m3 = vec![f32::NAN; MAP_LEN];
        session.infer(&vec![1_000.0; MAP_LEN], &mut sed_j_per_m3).unwrap();
        session.infer(&press_pa(), &mut sed_j_per_m3).unwrap();
        assert_equals_reference(&sed_j_per_m3);
    }
}

#[test]
fn constants_stored_in_16_bits_are_the_same_network() {
    let halved = |bytes: &[u8; 4]| f16::from_f32(f32::from_le_bytes(*bytes));
    let plain = altered(|model| {
        let weights = graph(model).initializer.iter_mut().find(|t| t.name == "bottom.w").unwrap();
        let (values, _) = weights.raw_data.as_chunks::<4>();
        let rounded = values.iter().flat_map(|b| halved(b).to_f32().to_le_bytes());
        weights.raw_data = rounded.collect();
    });
    let stored = altered(|model| {
        let graph = graph(model);
        let weights = graph.initializer.iter_mut().find(|t| t.name == "bottom.w").unwrap();
        let (values, _) = weights.raw_data.as_chunks::<4>();
        let halves = values.iter().flat_map(|b| halved(b).to_le_bytes());
        weights.raw_data = halves.collect();
        weights.data_type = DataType::Float16 as i32;
        weights.name = "bottom.w.stored".into();
        let to = AttributeProto {
            name: "to".into(),
            r#type: AttributeType::Int as i32,
            i: DataType::Float as i64,
            ..Default::default()
        };
        let cast = NodeProto {
            op_type: "Cast".into(),
            input: vec!["bottom.w.stored".into()],
            output: vec!["bottom.w".into()],
            attribute: vec![to],
            ..Default::default()
        };
        graph.node.insert(0, cast);
    });
    for (plain, stored) in in_each(&plain).zip(in_each(&stored)) {
        let [plain, stored] = [plain, stored].map(|model| {
            let mut sed_j_per_m3 = vec![f32::NAN; MAP_LEN];
            model.session().unwrap().infer(&press_pa(), &mut sed_j_per_m3).unwrap();
            sed_j_per_m3
        });
        assert!(plain == stored, "the answers differ");
        assert!(plain.iter().any(|&v| v > 0.0));
    }
}

#[test]
fn sessions_run_in_threads_and_agree_bit_for_bit() {
    for model in in_each(TINY) {
        let mut first = vec![0.0; MAP_LEN];
        model.session().unwrap().infer(&press_pa(), &mut first).unwrap();
        std::thread::scope(|scope| {
            for _ in 0..3 {
                scope.spawn(|| {
                    let mut session = model.session().unwrap();
                    let mut again = vec![0.0; MAP_LEN];
                    // Other maps between must leave no trace.
                    session.infer(&vec![1_000.0; MAP_LEN], &mut again).unwrap();
                    session.infer(&press_pa(), &mut again).unwrap();
                    assert_eq!(first, again);
                });
            }
        });
    }
}

#[test]
fn says_what_the_model_is() {
    let model = load(TINY, None).unwrap();
    let info = model.info();
    assert_eq!(info.name, "tiny");
    assert_eq!(info.atlas_hash, "ab".repeat(32));
    assert_eq!(info.effects, ["finite_strain", "layers"]);
    assert_eq!(info.network["base"], 2);
    assert_eq!((info.pressure_max_pa, info.sed_max_j_per_m3), (40_000.0, 2_500.0));
    assert_eq!(info.bytes as usize, TINY.len());
    assert!(info.backend.starts_with("tract "));
    assert_eq!(info.onnx_sha256.len(), 64);
}

#[test]
fn a_model_of_several_datasets_names_them_if_their_hash_is_its_own() {
    let parts = ["1".repeat(64), "2".repeat(64)];
    let own = Sha256::digest(parts.concat());
    let own: String = own.iter().map(|byte| format!("{byte:02x}")).collect();
    let of = |hash: &str| {
        let onnx = altered(|model| {
            let training = serde_json::json!({"seed": 7, "datasets": &parts}).to_string();
            set_metadata(model, "papilla.training", &training);
            set_metadata(model, "papilla.dataset_sha256", hash);
        });
        let model = load(&onnx, None).unwrap();
        model.info().datasets().into_iter().map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(of(&own), parts);
    // A list that does not belong to the hash counts for nothing.
    assert_eq!(of(&"3".repeat(64)), ["3".repeat(64)]);
    let alone = load(TINY, None).unwrap();
    assert_eq!(alone.info().datasets(), [alone.info().dataset_sha256.as_str()]);
}

#[test]
fn the_named_tract_version_is_the_locked_one() {
    let lock = include_str!("../../../Cargo.lock");
    let at = lock.find("name = \"tract-onnx\"\nversion = \"").unwrap();
    let version = lock[at..].split('"').nth(3).unwrap();
    let model = load(TINY, None).unwrap();
    assert_eq!(model.info().backend, format!("tract {version}"));
}

#[test]
fn refuses_maps_of_another_length_and_goes_on() {
    for model in in_each(TINY) {
        let mut session = model.session().unwrap();
        let mut sed_j_per_m3 = vec![0.0; MAP_LEN];
        for length in [0, MAP_LEN - 1, MAP_LEN + 1] {
            let error = session.infer(&vec![0.0; length], &mut sed_j_per_m3).unwrap_err();
            assert!(
                matches!(error, EngineError::WrongLength { map: "pressure_pa", found, .. } if found == length)
            );
        }
        let error = session.infer(&press_pa(), &mut sed_j_per_m3[1..]).unwrap_err();
        assert!(matches!(error, EngineError::WrongLength { map: "sed_j_per_m3", .. }));
        session.infer(&press_pa(), &mut sed_j_per_m3).unwrap();
        assert_equals_reference(&sed_j_per_m3);
    }
}

#[test]
fn an_infinite_answer_is_an_error_not_a_map() {
    // Scaled so far up that a pressure beyond the trained range overflows.
    let onnx = altered(|model| {
        let scale = graph(model).initializer.iter_mut().find(|t| t.name == "scale_out").unwrap();
        scale.raw_data = 1e36f32.to_le_bytes().to_vec();
    });
    for model in in_each(&onnx) {
        let mut session = model.session().unwrap();
        let mut sed_j_per_m3 = vec![0.0; MAP_LEN];
        let hard: Vec<f32> = press_pa().iter().map(|p| 1e4 * p).collect();
        let error = session.infer(&hard, &mut sed_j_per_m3).unwrap_err();
        assert!(matches!(error, EngineError::NonFiniteOutput { .. }), "{error}");
        session.infer(&press_pa(), &mut sed_j_per_m3).unwrap();
    }
}

#[test]
fn input_that_is_not_finite_is_refused() {
    for model in in_each(TINY) {
        let mut session = model.session().unwrap();
        let mut sed_j_per_m3 = vec![0.0; MAP_LEN];
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut pressure_pa = press_pa();
            pressure_pa[3 * MAP_SIDE_PX + 5] = bad;
            let error = session.infer(&pressure_pa, &mut sed_j_per_m3).unwrap_err();
            assert!(
                matches!(error, EngineError::NonFiniteInput { row: 3, column: 5, .. }),
                "{error}"
            );
        }
        session.infer(&press_pa(), &mut sed_j_per_m3).unwrap();
        assert_equals_reference(&sed_j_per_m3);
    }
}

#[test]
fn zero_in_leaves_only_the_biases() {
    for model in in_each(TINY) {
        let mut sed_j_per_m3 = vec![f32::NAN; MAP_LEN];
        model.session().unwrap().infer(&vec![0.0; MAP_LEN], &mut sed_j_per_m3).unwrap();
        let max = sed_j_per_m3.iter().copied().fold(0.0, f32::max);
        assert!(f64::from(max) < 0.2 * expected().max_j_per_m3, "{max}");
    }
}

#[cfg(not(feature = "ort"))]
#[test]
fn ort_is_refused_where_it_was_not_built() {
    let Err(error) = load_with(Backend::Ort, TINY, None) else { panic!("loaded") };
    assert!(matches!(error, EngineError::BackendMissing { backend: Backend::Ort, .. }));
}

#[test]
fn a_choice_reads_back_as_it_is_written() {
    for text in ["auto", "tract", "ort"] {
        assert_eq!(text.parse::<Choice>().unwrap().to_string(), text);
    }
    let error = "onnx".parse::<Choice>().unwrap_err();
    assert!(["auto", "tract", "ort"].iter().all(|name| error.contains(name)), "{error}");
}

#[test]
fn auto_takes_what_is_there_and_without_time_tract() {
    let at_once = Choice::Auto.load(TINY, None, Duration::ZERO).unwrap();
    assert_eq!(at_once.backend(), Backend::Tract);
    let chosen = Choice::Auto.load(TINY, None, Duration::from_millis(5)).unwrap();
    assert!(backends().contains(&chosen.backend()));
    let mut sed_j_per_m3 = vec![f32::NAN; MAP_LEN];
    chosen.session().unwrap().infer(&press_pa(), &mut sed_j_per_m3).unwrap();
    assert_equals_reference(&sed_j_per_m3);
    for backend in backends() {
        let model = Choice::Only(backend).load(TINY, None, Duration::ZERO).unwrap();
        assert_eq!(model.backend(), backend);
        let name = if backend == Backend::Ort { "onnxruntime " } else { "tract " };
        assert!(model.info().backend.starts_with(name), "{}", model.info().backend);
    }
}
