//! The whole way on the command line: a dataset whose truth is the model's own answer times
//! 0.8, so that every figure is known in closed form.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

mod bench;

use bench::{Bench, DEPTHS, FILES, TINY, read_card, replaced};
use papilla_engine::card::Index;
use serde_json::{Value, json};
use std::fs;

#[test]
fn a_card_tells_the_known_errors() {
    let bench = Bench::new();
    let text = bench.done(&[
        "evaluate",
        "models/tiny.onnx",
        "data",
        "--card",
        "models/tiny.json",
        "--pictures",
        "pictures",
        "--reference",
        "reference.npz",
    ]);
    assert!(text.contains("relative L2") && text.contains("wrote models/tiny.json"), "{text}");
    let card = read_card(&bench.path("models/tiny.json"));
    let m = &card.metrics;
    assert_eq!((m.split.as_str(), m.samples), ("test", DEPTHS.len()));
    for spread in [m.relative_l2, m.peak_error, m.total_energy_error] {
        assert!((spread.median - 0.25).abs() < 1e-5, "{m:?}");
        assert!((spread.p95 - 0.25).abs() < 1e-5, "{m:?}");
    }
    assert!(m.ssim.median > 0.5 && m.ssim.median < 1.0, "{m:?}");
    assert!(card.onnxruntime_difference_max.unwrap() < 1e-6);
    assert!(card.latency_ms.p50 > 0.0 && card.latency_ms.p99 >= card.latency_ms.p50);
    assert!(card.latency_ms.backend.starts_with("tract "));
    for word in ["best", "median", "worst"] {
        let path = bench.path(&format!("pictures/tiny-{word}.png"));
        let picture = image::open(path).unwrap().into_rgb8();
        assert!(picture.width() > 4 * 448 && picture.height() > 448);
        let colours: std::collections::HashSet<_> = picture.pixels().collect();
        assert!(colours.len() > 100, "an empty picture");
    }

    // The card goes with the model: check, index and table take it.
    let models = ["check", "models/tiny.onnx", "--card", "models/tiny.json"];
    assert!(bench.done(&models).contains("keeps the contract"));
    bench.done(&["index", "models", "--default", "tiny"]);
    let index = fs::read_to_string(bench.path("models/index.json")).unwrap();
    assert_eq!(Index::from_json(&index).unwrap().models, ["tiny"]);
    let table = bench.done(&["table", "models/tiny.json", "models/index.json"]);
    assert!(table.contains("| tiny | 53 | 25.00 % | 25.00 % |"), "{table}");
    let columns = |line: &str| line.matches('|').count();
    assert!(table.lines().all(|line| columns(line) == columns(&table) / table.lines().count()));
}

#[test]
fn json_holds_every_sample() {
    let bench = Bench::new();
    let text = bench.done(&["--json", "evaluate", "models/tiny.onnx", "data", "--split", "train"]);
    let report: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(report["card"]["metrics"]["split"], "train");
    let samples = report["samples"].as_array().unwrap();
    assert_eq!(samples.len(), DEPTHS.len());
    for (sample, depth) in samples.iter().zip(DEPTHS) {
        assert_eq!(sample["press"], 0);
        assert!((sample["depth_mm"].as_f64().unwrap() - f64::from(depth)).abs() < 1e-6);
        assert!((sample["relative_l2"].as_f64().unwrap() - 0.25).abs() < 1e-5);
    }
    // The tiny model answers a quarter too much.
    let by_indenter = report["by_indenter"].as_array().unwrap();
    assert_eq!((by_indenter.len(), &by_indenter[0]["samples"]), (1, &json!(DEPTHS.len())));
    let factor = by_indenter[0]["closest_factor"].as_f64().unwrap();
    assert!((factor - 0.8).abs() < 1e-5, "{factor}");
    let text = bench.done(&["--json", "evaluate", "models/tiny.onnx", "data", "--split", "all"]);
    let all: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(all["card"]["metrics"]["split"], "all");
    assert_eq!(all["samples"].as_array().unwrap().len(), 2 * DEPTHS.len());
    let info: Value =
        serde_json::from_str(&bench.done(&["check", "models/tiny.onnx", "--json"])).unwrap();
    assert_eq!(info["name"], "tiny");
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let bench = Bench::new();
    let model = fs::read(bench.path("models/tiny.onnx")).unwrap();
    let evaluate = ["evaluate", "models/tiny.onnx", "data", "--card", "models/tiny.json"];

    // An engine that answers otherwise.
    bench.write_reference(&model, 1.01);
    let with_reference = [&evaluate[..], &["--reference", "reference.npz"]].concat();
    let stderr = bench.refused(1, &with_reference);
    assert!(stderr.contains("differs from reference.npz"), "{stderr}");
    assert!(!bench.path("models/tiny.json").exists());

    // A card of training indentations, or of another dataset.
    bench.refused(1, &[&evaluate[..], &["--split", "train"]].concat());
    let manifest = fs::read_to_string(bench.path("data/manifest.json")).unwrap();
    let trained = sha256_of(&manifest);
    fs::write(bench.path("models/other.onnx"), replaced(&model, &trained, &"0".repeat(64)))
        .unwrap();
    let stderr =
        bench.refused(1, &["evaluate", "models/other.onnx", "data", "--card", "models/other.json"]);
    assert!(stderr.contains("was trained on dataset 0000"), "{stderr}");
    bench.done(&["evaluate", "models/other.onnx", "data"]);

    // Another atlas.
    fs::write(bench.path("models/stranger.onnx"), TINY).unwrap();
    let stderr = bench.refused(1, &["evaluate", "models/stranger.onnx", "data"]);
    assert!(stderr.contains("atlas"), "{stderr}");

    // A damaged shard, an indentation in both splits, a path that leads outside.
    let shard = bench.path("data").join(FILES[1]);
    let mut bytes = fs::read(&shard).unwrap();
    bytes[40] ^= 1;
    fs::write(&shard, bytes).unwrap();
    let stderr = bench.refused(1, &["evaluate", "models/tiny.onnx", "data"]);
    assert!(stderr.contains(FILES[1]) && stderr.contains("sha256"), "{stderr}");
    for (old, new, word) in [
        ("\"train\":[0]", "\"train\":[0,1]", "list of splits"),
        (FILES[1], "../1.npz", "outside the dataset"),
        ("\"format\":2", "\"format\":3", "format 3"),
        (trained.as_str(), &"1".repeat(64), "dataset_sha256"),
    ] {
        assert!(manifest.contains(old), "{old}");
        fs::write(bench.path("data/manifest.json"), manifest.replace(old, new)).unwrap();
        let stderr = bench.refused(1, &["evaluate", "models/tiny.onnx", "data"]);
        assert!(stderr.contains(word), "{stderr}");
    }
}

fn sha256_of(manifest: &str) -> String {
    let manifest: Value = serde_json::from_str(manifest).unwrap();
    manifest["dataset_sha256"].as_str().unwrap().to_owned()
}

#[test]
fn exit_codes_are_the_documented_ones() {
    let bench = Bench::new();
    let help = bench.done(&["evaluate", "--help"]);
    assert!(help.contains("Exit status:") && help.contains("far field"), "{help}");
    bench.refused(2, &["evaluate"]);
    bench.refused(2, &["check", "models/tiny.onnx", "--backend", "abacus"]);
    bench.refused(3, &["check", "models/nowhere.onnx"]);
    bench.refused(3, &["evaluate", "models/tiny.onnx", "nowhere"]);
    fs::write(bench.path("models/cut.onnx"), &TINY[..TINY.len() / 2]).unwrap();
    let stderr = bench.refused(1, &["check", "models/cut.onnx"]);
    assert_eq!(stderr.matches("not a whole ONNX file").count(), 1, "{stderr}");
    let output = bench.run(&["check", "models/cut.onnx", "--json"]);
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["error"]["exit_code"], 1);
}
