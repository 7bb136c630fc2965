//! The ladder on the command line, with the real engine, on data whose errors are known.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

mod bench;

use bench::{Bench, DEPTHS};
use ndarray::Array2;
use ndarray_npy::{NpzReader, NpzWriter};
use papilla_engine::Ladder;
use papilla_engine::ladder::{Kind, Rung};
use serde_json::{Value, json};
use std::fs;
use std::io::Cursor;

const COMMAND: [&str; 7] = ["ladder", "--data", "sets", "--fe", "fe", "--out", "out/ladder"];

/// The bench with its dataset as `sets/s1` and `sets/deep`, an index, and FE rungs: the reference
/// has the held-out indentations' truth, `fe-medium-linear-finite` a tenth more.
fn bench() -> Bench {
    let bench = Bench::new();
    fs::create_dir_all(bench.path("sets/deep/shards")).unwrap();
    for file in ["manifest.json", "atlas.json", "shards/0.npz", "shards/1.npz"] {
        fs::copy(bench.path("data").join(file), bench.path("sets/deep").join(file)).unwrap();
    }
    fs::rename(bench.path("data"), bench.path("sets/s1")).unwrap();
    let index = json!({"default": "tiny", "models": ["tiny"]}).to_string();
    fs::write(bench.path("models/index.json"), index).unwrap();
    fs::create_dir_all(bench.path("fe")).unwrap();
    let shard = fs::read(bench.path("sets/s1/shards/1.npz")).unwrap();
    let mut npz = NpzReader::new(Cursor::new(shard)).unwrap();
    let pressure: Array2<f32> = npz.by_name("pressure_pa.npy").unwrap();
    let sed: Array2<f32> = npz.by_name("sed_dermis_j_per_m3.npy").unwrap();
    let mut rungs = Vec::new();
    for (name, scale, seconds, reference) in
        [("fe-medium-linear-finite", 1.1f32, 2.0, false), ("fe-fine", 1.0, 10.0, true)]
    {
        let mut npz = NpzWriter::new(Cursor::new(Vec::new()));
        npz.add_array("pressure_pa", &pressure).unwrap();
        npz.add_array("sed_dermis_j_per_m3", &(scale * &sed)).unwrap();
        let bytes = npz.finish().unwrap().into_inner();
        fs::write(bench.path(&format!("fe/{name}.npz")), bytes).unwrap();
        let mut rung = json!({"name": name, "density": "fine", "order": "linear",
            "kinematics": "finite", "unknowns": 99, "reference": reference,
            "seconds": vec![seconds; DEPTHS.len()], "file": format!("{name}.npz")});
        if reference {
            rung["discretisation_error"] = json!({"sed_relative_l2": 0.01, "how": "by hand"});
        }
        rungs.push(rung);
    }
    let manifest = fs::read_to_string(bench.path("sets/s1/manifest.json")).unwrap();
    let manifest: Value = serde_json::from_str(&manifest).unwrap();
    let listing = json!({"format": 1, "atlas_hash": manifest["atlas_hash"], "campaign": "test",
        "states": vec![json!({}); DEPTHS.len()], "rungs": rungs});
    fs::write(bench.path("fe/rungs.json"), listing.to_string()).unwrap();
    bench
}

fn rung<'a>(ladder: &'a Ladder, name: &str) -> &'a Rung {
    ladder.rungs.iter().find(|rung| rung.name == name).unwrap()
}

fn near(found: Option<f64>, due: f64) {
    assert!((found.unwrap() - due).abs() < 1e-5, "{found:?}, not {due}");
}

#[test]
fn every_rung_has_the_known_errors() {
    let bench = bench();
    let text = bench.done(&COMMAND);
    assert!(text.contains("wrote models/ladder.json"), "{text}");
    let json = fs::read_to_string(bench.path("out/ladder.json")).unwrap();
    assert_eq!(json, fs::read_to_string(bench.path("models/ladder.json")).unwrap());
    let ladder = Ladder::from_json(&json).unwrap();
    let samples: Vec<(&str, usize)> =
        ladder.sets.iter().map(|set| (set.name.as_str(), set.samples)).collect();
    let due =
        [("heldout-presses", 0), ("heldout-shapes", 0), ("reference", 3), ("s1", 3), ("deep", 0)];
    assert_eq!(samples, due);
    assert!(ladder.sets[0].about.contains("no dataset 'broad'"), "{:?}", ladder.sets[0]);
    assert!(ladder.sets[4].about.contains("no such state"), "none is deeper than 2 mm");

    let tiny = rung(&ladder, "tiny");
    assert_eq!((tiny.kind, tiny.model.as_deref()), (Kind::Network, Some("tiny")));
    for set in ["s1", "reference"] {
        near(tiny.relative_l2(set), 0.25);
        near(Some(tiny.errors[set].peak_error.p95), 0.25);
        near(tiny.errors[set].peak_distance_mm.map(|s| s.p95), 0.0);
        // Rows 120 to 139 of the patch lie 12 to 14 mm from the tip.
        near(tiny.errors[set].nail_base_error.map(|s| s.median), 0.25);
    }
    assert!(!tiny.errors.contains_key("heldout-presses"));
    let tract = tiny.latency_ms.as_ref().unwrap().tract;
    assert!(tract.p50 > 0.0 && tract.p99 >= tract.p50);
    assert!(tiny.load_ms.unwrap() > 0.0);
    if cfg!(target_os = "linux") {
        assert!(tiny.memory_mib.unwrap() > 0.1);
    }
    assert_eq!(tiny.refused, 0);

    near(rung(&ladder, "fe-medium-linear-finite").relative_l2("reference"), 0.1);
    let reference = rung(&ladder, "fe-fine");
    assert!(reference.reference && reference.kind == Kind::Fe && reference.bytes.is_none());
    near(reference.relative_l2("reference"), 0.0);
    near(reference.seconds.map(|s| s.p50), 10.0);
    assert_eq!(ladder.pareto_set.as_deref(), Some("reference"));
    assert!(ladder.rungs.iter().all(|rung| rung.pareto), "each is the faster or the better one");
}

#[test]
fn the_page_and_the_pictures_name_every_rung_and_every_gap() {
    let bench = bench();
    bench.done(&COMMAND);
    let read = |name: &str| fs::read_to_string(bench.path(name)).unwrap();
    let page = read("out/ladder.md");
    for word in [
        "Not measured",
        "there is no dataset 'broad'",
        "](ladder.svg)",
        "](ladder-zone.svg)",
        "| tiny | network |",
        "the truth",
        "good to 1.00 %",
    ] {
        assert!(page.replace("**tiny**", "tiny").contains(word), "{word}: {page}");
    }
    for table in page.split("\n\n").filter(|block| block.starts_with('|')) {
        let columns = |line: &str| line.matches('|').count();
        let first = table.lines().next().map(columns);
        assert!(table.lines().all(|line| Some(columns(line)) == first), "{table}");
    }
    let plot = read("out/ladder.svg");
    for word in ["tiny", "fe-fine", "fe-medium-linear-finite", "discretisation", "Pareto"] {
        assert!(plot.contains(word), "{word}");
    }
    for svg in [plot, read("out/ladder-zone.svg")] {
        assert!(svg.contains("</svg>") && !svg.contains("NaN") && !svg.contains("inf"));
    }
}

#[test]
fn quick_leaves_the_shipped_ladder_alone() {
    let bench = bench();
    let text = bench.done(&[&COMMAND[..], &["--quick", "--json"]].concat());
    let ladder = Ladder::from_json(&text).unwrap();
    assert!(ladder.quick && bench.path("out/ladder.json").is_file());
    assert!(!bench.path("models/ladder.json").exists());
    // Without FE and without data there is nothing to judge by, and it says so.
    let text =
        bench.done(&["ladder", "--data", "nowhere", "--out", "out/bare", "--quick", "--json"]);
    let bare = Ladder::from_json(&text).unwrap();
    assert!(bare.sets.iter().all(|set| set.samples == 0 && set.about.starts_with("not measured")));
    assert!(bare.rungs[0].errors.is_empty() && bare.pareto_set.is_none());
}

#[test]
fn fe_folders_that_break_their_contract_are_refused() {
    let bench = bench();
    let path = bench.path("fe/rungs.json");
    let good = fs::read_to_string(&path).unwrap();
    for (old, new, word) in [
        ("\"format\":1", "\"format\":2", "format 2"),
        ("\"reference\":true", "\"reference\":false", "marked as the reference"),
        ("fe-fine.npz", "../fe-fine.npz", "no path inside"),
        ("[10.0,10.0,10.0]", "[10.0]", "1 times for 3 states"),
    ] {
        assert!(good.contains(old), "{old}: {good}");
        fs::write(&path, good.replace(old, new)).unwrap();
        let stderr = bench.refused(1, &COMMAND);
        assert!(stderr.contains(word), "{word}: {stderr}");
    }
    let mut listing: Value = serde_json::from_str(&good).unwrap();
    listing["atlas_hash"] = json!("f".repeat(64));
    fs::write(&path, listing.to_string()).unwrap();
    assert!(bench.refused(1, &COMMAND).contains("of atlas ffff"));
    fs::write(&path, good.replace("[{},{},{}]", "[{}]")).unwrap();
    let stderr = bench.refused(1, &COMMAND);
    assert!(stderr.contains("3 times for 1 states"), "{stderr}");
    fs::remove_file(&path).unwrap();
    bench.refused(3, &COMMAND);
}
