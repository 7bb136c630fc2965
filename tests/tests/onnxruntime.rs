//! The service on the models that ship, run by ONNX Runtime: golden answers, the engine's own answer
//! over the wire, and which backend it says it chose.
//!
//! `ORT_DYLIB_PATH` names the library.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]
#![cfg(feature = "ort")]

use papilla_engine::{Backend, Card, Choice, MAP_LEN, MAP_SIDE_PX, card::Index};
use papilla_server::{Config, Report, check};
use papilla_tests::http::Request;
use serde_json::Value;
use std::{fs, path::Path};

fn read(name: &str) -> Vec<u8> {
    fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../models").join(name)).unwrap()
}

fn names() -> Vec<String> {
    Index::from_json(&String::from_utf8(read("index.json")).unwrap()).unwrap().models
}

/// What a look at the shipped models finds, by tier.
fn tiers(report: &Report) -> Vec<&Value> {
    assert!(report.ok, "{report}");
    let values = report.findings.iter().map(|finding| &finding.values);
    let tiers: Vec<&Value> = values.filter(|values| values["tier"].is_string()).collect();
    assert_eq!(tiers.len(), names().len(), "{report}");
    tiers
}

#[test]
fn every_shipped_tier_gives_its_golden_answers() {
    let mut errors = Vec::new();
    for backend in [Backend::Tract, Backend::Ort] {
        let backend = Choice::Only(backend);
        let report = check(&Config { backend, calibration_ms: 0, ..Config::default() });
        let golden = |tier: &&Value| tier["golden"]["relative_l2"].as_f64().unwrap();
        errors.push(tiers(&report).iter().map(golden).collect::<Vec<f64>>());
        let runs = |tier: &&Value| tier["backend"].as_str().unwrap().starts_with("onnxruntime");
        assert!(tiers(&report).iter().all(|t| runs(t) == (backend == Choice::Only(Backend::Ort))));
    }
    for (tract, ort) in errors[0].iter().zip(&errors[1]) {
        assert!((tract - ort).abs() < 1e-4, "{tract} and {ort}");
    }
}

#[test]
fn a_start_chooses_for_each_tier_and_without_time_takes_tract() {
    let backends = |calibration_ms| {
        let report = check(&Config { calibration_ms, ..Config::default() });
        let of = |tier: &&Value| tier["backend"].as_str().unwrap().to_owned();
        println!("{report}");
        tiers(&report).iter().map(of).collect::<Vec<_>>()
    };
    assert!(backends(0).iter().all(|backend| backend.starts_with("tract ")));
    let known =
        |backend: &String| ["tract ", "onnxruntime "].iter().any(|b| backend.starts_with(b));
    assert!(backends(500).iter().all(known));
}

#[tokio::test(flavor = "multi_thread")]
async fn what_arrives_is_the_engines_own_answer() {
    let backend = Choice::Only(Backend::Ort);
    let config = Config { backend, calibration_ms: 0, ..Config::default() };
    let server = papilla_server::start(&config).await.unwrap();
    let address = server.address().to_string();
    for name in names() {
        let card = Card::from_json(&String::from_utf8(read(&format!("{name}.json"))).unwrap());
        let card = card.unwrap();
        let model = papilla_engine::load(&read(&format!("{name}.onnx")), Some(&card)).unwrap();
        let pressure_pa = contact(0.5 * card.pressure_range_pa[1]);
        let mut due = vec![0.0; MAP_LEN];
        model.session().unwrap().infer(&pressure_pa, &mut due).unwrap();
        let bytes: Vec<u8> = pressure_pa.iter().flat_map(|value| value.to_le_bytes()).collect();
        let request = Request::post(&format!("/v1/sed?tier={name}"), bytes);
        let answer = request.send(&address).await.unwrap();
        assert_eq!(answer.status, 200, "{name}");
        let (found, _) = answer.body.as_chunks::<4>();
        let greatest = due.iter().copied().fold(0.0, f32::max);
        let apart = found.iter().zip(&due).map(|(f, d)| (f32::from_le_bytes(*f) - d).abs());
        let apart = apart.fold(0.0, f32::max);
        assert!(
            found.len() == MAP_LEN && apart <= 1e-5 * greatest,
            "{name}: {apart} of {greatest}"
        );
    }
    // Every tier has been named, so all are loaded.
    let tiers: Value =
        serde_json::from_slice(&Request::get("/v1/tiers").send(&address).await.unwrap().body)
            .unwrap();
    for tier in tiers["tiers"].as_array().unwrap() {
        assert!(tier["backend"].as_str().unwrap().starts_with("onnxruntime "), "{tier}");
    }
    server.drain().await.unwrap();
}

/// A round contact on the pad, Pa.
fn contact(peak_pa: f32) -> Vec<f32> {
    let pressure_pa = |i: usize| {
        let (row, column) = ((i / MAP_SIDE_PX) as f32, (i % MAP_SIDE_PX) as f32);
        let r2 = ((row - 80.0) / 34.0).powi(2) + ((column - 112.0) / 30.0).powi(2);
        peak_pa * (1.0 - r2).max(0.0).sqrt()
    };
    (0..MAP_LEN).map(pressure_pa).collect()
}
