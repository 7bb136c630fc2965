//! The whole way on the command line: a dataset whose truth is the model's own answer times
//! 0.8, so that every figure is known in closed form.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

use ndarray::{Array1, Array2, Array3, Axis};
use ndarray_npy::NpzWriter;
use papilla_engine::{Card, MAP_LEN, MAP_SIDE_PX, card::Index, load};
use papilla_proto::atlas::{Atlas, PatchVertices};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const TINY: &[u8] = include_bytes!("../../engine/tests/assets/tiny.onnx");
/// The patch: one vertex on the centre of each pixel of these rows and columns.
const FIRST: [usize; 2] = [80, 90];
const SIDE: usize = 60;
const DEPTHS: [f32; 3] = [0.5, 1.0, 1.5];

struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    /// A model, a dataset of two presses (one held out) and a recorded reference.
    fn new() -> Self {
        let bench = Self { folder: tempfile::tempdir().unwrap() };
        let atlas = atlas();
        let onnx = replaced(TINY, &"ab".repeat(32), atlas.hash());
        let shards = [0.9f32, 1.0].map(|force| shard(&onnx, force));
        let hashes: Vec<String> = shards.iter().map(|bytes| sha256_hex(bytes)).collect();
        let dataset = sha256_hex(hashes.concat().as_bytes());
        let onnx = replaced(&onnx, &"cd".repeat(32), &dataset);
        fs::create_dir_all(bench.path("data/shards")).unwrap();
        fs::create_dir_all(bench.path("models")).unwrap();
        fs::write(bench.path("models/tiny.onnx"), &onnx).unwrap();
        for folder in ["data", "models"] {
            let path = bench.path(folder).join("atlas.json");
            fs::write(path, atlas.to_json().unwrap()).unwrap();
        }
        for (id, bytes) in shards.iter().enumerate() {
            fs::write(bench.path("data/shards").join(format!("{id}.npz")), bytes).unwrap();
        }
        let presses: Vec<Value> = (0..2)
            .map(|id| {
                json!({"id": id, "file": format!("shards/{id}.npz"), "sha256": hashes[id],
                    "split": if id == 0 {"train"} else {"test"}, "samples": DEPTHS.len(),
                    "pitch_deg": 10.0, "roll_deg": -5.0, "yaw_deg": 0.0, "checks": {}})
            })
            .collect();
        let manifest = json!({"format": 1, "atlas_hash": atlas.hash(), "effects": ["layers"],
            "vertex_count": SIDE * SIDE, "pressure_max_pa": 4e4, "sed_max_j_per_m3": 2500.0,
            "presses": presses, "splits": {"train": [0], "test": [1]}, "dataset_sha256": dataset});
        fs::write(bench.path("data/manifest.json"), manifest.to_string()).unwrap();
        bench.write_reference(&onnx, 1.0);
        bench
    }

    /// What another engine would have recorded, were its answers `scale` times ours.
    fn write_reference(&self, onnx: &[u8], scale: f32) {
        let pressure: Vec<f32> = press(1.0);
        let sed: Vec<f32> = infer(onnx, &pressure).iter().map(|v| scale * v).collect();
        let maps = [pressure, sed]
            .map(|m| Array3::from_shape_vec((1, MAP_SIDE_PX, MAP_SIDE_PX), m).unwrap());
        let mut npz = NpzWriter::new(Cursor::new(Vec::new()));
        npz.add_array("pressure_pa", &maps[0]).unwrap();
        npz.add_array("sed_j_per_m3", &maps[1]).unwrap();
        fs::write(self.path("reference.npz"), npz.finish().unwrap().into_inner()).unwrap();
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn run(&self, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_model-export"))
            .args(arguments)
            .current_dir(self.folder.path())
            .output()
            .unwrap()
    }

    /// Runs, expects success, gives stdout.
    fn done(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {stderr}");
        String::from_utf8(output.stdout).unwrap()
    }

    /// Runs, expects this exit status, gives stderr.
    fn refused(&self, status: i32, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(status), "{arguments:?}: {stderr}");
        stderr
    }
}

fn atlas() -> Atlas {
    let mut patch = PatchVertices::default();
    let mut triangles = Vec::new();
    for i in 0..SIDE * SIDE {
        let (row, column) = (i / SIDE, i % SIDE);
        let (u, v) = ((FIRST[1] + column) as f32 + 0.5, (FIRST[0] + row) as f32 + 0.5);
        patch.uv_px.push([u, v]);
        patch.positions_mm.push([0.1 * v, -0.1 * u, -6.0]);
        if row + 1 < SIDE && column + 1 < SIDE {
            let [a, b, c, d] = [i, i + SIDE, i + 1, i + SIDE + 1].map(|i| i as u32);
            triangles.extend([[a, b, c], [c, b, d]]);
        }
    }
    Atlas::new(0.1, triangles, patch.clone(), patch).unwrap()
}

/// Pixels of the patch, in the order of the vertices.
fn pixels() -> impl Iterator<Item = usize> {
    (0..SIDE * SIDE).map(|i| (FIRST[0] + i / SIDE) * MAP_SIDE_PX + FIRST[1] + i % SIDE)
}

/// A paraboloid on the patch, zero outside it.
fn press(force: f32) -> Vec<f32> {
    let mut map = vec![0.0; MAP_LEN];
    for i in pixels() {
        let (row, column) = ((i / MAP_SIDE_PX) as f32, (i % MAP_SIDE_PX) as f32);
        let r2 = ((row - 110.0) / 28.0).powi(2) + ((column - 120.0) / 25.0).powi(2);
        map[i] = 25_000.0 * force * (1.0 - r2).max(0.0);
    }
    map
}

fn infer(onnx: &[u8], pressure_pa: &[f32]) -> Vec<f32> {
    let mut sed = vec![0.0; MAP_LEN];
    load(onnx, None).unwrap().session().unwrap().infer(pressure_pa, &mut sed).unwrap();
    sed
}

fn shard(onnx: &[u8], force: f32) -> Vec<u8> {
    let (d, v) = (DEPTHS.len(), SIDE * SIDE);
    let [mut pressure, mut sed] = [0, 1].map(|_| Array2::<f32>::zeros((d, v)));
    for (k, depth) in DEPTHS.iter().enumerate() {
        let map = press(force * depth);
        let answer = infer(onnx, &map);
        for (vertex, pixel) in pixels().enumerate() {
            pressure[[k, vertex]] = map[pixel];
            sed[[k, vertex]] = 0.8 * answer[pixel];
        }
    }
    assert!(sed.lanes(Axis(1)).into_iter().all(|row| row.iter().any(|v| *v > 1.0)));
    let mut npz = NpzWriter::new_compressed(Cursor::new(Vec::new()));
    npz.add_array("pressure_pa", &pressure).unwrap();
    npz.add_array("sed_dermis_j_per_m3", &sed).unwrap();
    npz.add_array("depth_mm", &Array1::from(DEPTHS.to_vec())).unwrap();
    npz.finish().unwrap().into_inner()
}

fn sha256_hex(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The file with one text in it replaced by another of the same length.
fn replaced(bytes: &[u8], old: &str, new: &str) -> Vec<u8> {
    assert_eq!(old.len(), new.len());
    let at = bytes.windows(old.len()).position(|window| window == old.as_bytes()).unwrap();
    let mut bytes = bytes.to_vec();
    bytes[at..at + new.len()].copy_from_slice(new.as_bytes());
    bytes
}

fn read_card(path: &Path) -> Card {
    Card::from_json(&fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn a_card_tells_the_known_errors() {
    let bench = Bench::new();
    let text = bench.done(&[
        "evaluate",
        "models/tiny.onnx",
        "data",
        "--out",
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
    let info: Value =
        serde_json::from_str(&bench.done(&["check", "models/tiny.onnx", "--json"])).unwrap();
    assert_eq!(info["name"], "tiny");
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let bench = Bench::new();
    let model = fs::read(bench.path("models/tiny.onnx")).unwrap();
    let evaluate = ["evaluate", "models/tiny.onnx", "data", "--out", "models/tiny.json"];

    // An engine that answers otherwise.
    bench.write_reference(&model, 1.01);
    let with_reference = [&evaluate[..], &["--reference", "reference.npz"]].concat();
    let stderr = bench.refused(1, &with_reference);
    assert!(stderr.contains("differs from reference.npz"), "{stderr}");
    assert!(!bench.path("models/tiny.json").exists());

    // A card of training presses, or of another dataset.
    bench.refused(1, &[&evaluate[..], &["--split", "train"]].concat());
    let manifest = fs::read_to_string(bench.path("data/manifest.json")).unwrap();
    let trained = sha256_of(&manifest);
    fs::write(bench.path("models/other.onnx"), replaced(&model, &trained, &"0".repeat(64)))
        .unwrap();
    let stderr =
        bench.refused(1, &["evaluate", "models/other.onnx", "data", "--out", "models/other.json"]);
    assert!(stderr.contains("was trained on dataset 0000"), "{stderr}");
    bench.done(&["evaluate", "models/other.onnx", "data"]);

    // Another atlas.
    fs::write(bench.path("models/stranger.onnx"), TINY).unwrap();
    let stderr = bench.refused(1, &["evaluate", "models/stranger.onnx", "data"]);
    assert!(stderr.contains("atlas"), "{stderr}");

    // A damaged shard, a press in both splits, a path that leads outside.
    let shard = bench.path("data/shards/1.npz");
    let mut bytes = fs::read(&shard).unwrap();
    bytes[40] ^= 1;
    fs::write(&shard, bytes).unwrap();
    let stderr = bench.refused(1, &["evaluate", "models/tiny.onnx", "data"]);
    assert!(stderr.contains("shards/1.npz") && stderr.contains("hash"), "{stderr}");
    for (old, new, word) in [
        ("\"train\":[0]", "\"train\":[0,1]", "both splits"),
        ("shards/1.npz", "../1.npz", "no path inside"),
        ("\"format\":1", "\"format\":2", "format 2"),
        (trained.as_str(), &"1".repeat(64), "does not follow"),
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
