//! The ladder on the command line, with the real engine, on data whose errors are known.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

mod bench;

use bench::{Bench, FILES};
use papilla_engine::Ladder;
use papilla_engine::ladder::{Kind, Rung};
use serde_json::json;
use std::fs;

const COMMAND: [&str; 8] =
    ["ladder", "--data", "sets", "--fe", "fe/final", "fe/medium", "--out", "out"];

/// The bench with its dataset as `sets/s1-graded` and the reference, `sets/final`; in `fe`
/// the reference and a coarser mesh, whose SED is a tenth more, with what each took.
fn bench() -> Bench {
    let bench = Bench::new();
    bench.copy("data", "sets/final");
    fs::rename(bench.path("data"), bench.path("sets/s1-graded")).unwrap();
    let index = json!({"default": "tiny", "models": ["tiny"]}).to_string();
    fs::write(bench.path("models/index.json"), index).unwrap();
    for (name, mesh, [scale, seconds]) in
        [("final", ["fine", "graded"], [1.0, 30.0]), ("medium", ["medium", "graded"], [1.1, 6.0])]
    {
        let folder = format!("fe/{name}");
        bench.copy("sets/final", &folder);
        bench.resolve(&folder, mesh, scale);
        fs::create_dir_all(bench.path(&folder).join("progress")).unwrap();
        for id in 0..2 {
            let record = json!({"seconds": 99.0, "processor_s": seconds}).to_string();
            let file = format!("progress/press-{id:05}.json");
            fs::write(bench.path(&folder).join(file), record).unwrap();
        }
    }
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
    let json = fs::read_to_string(bench.path("out/accuracy-vs-time.json")).unwrap();
    assert_eq!(json, fs::read_to_string(bench.path("models/ladder.json")).unwrap());
    let ladder = Ladder::from_json(&json).unwrap();
    let samples: Vec<(&str, usize)> =
        ladder.sets.iter().map(|set| (set.name.as_str(), set.samples)).collect();
    let due = [
        ("heldout-presses", 0),
        ("heldout-shapes", 0),
        ("reference", 6),
        ("reference-anew", 0),
        ("reference-shapes", 0),
        ("pressed", 0),
        ("s1", 3),
        ("poses", 0),
    ];
    assert_eq!(samples, due);
    assert!(ladder.sets[0].about.contains("no dataset 'broad-graded'"), "{:?}", ladder.sets[0]);

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

    let zero = rung(&ladder, "zero");
    assert_eq!((zero.kind, zero.time_ms()), (Kind::Floor, None));
    near(zero.relative_l2("reference"), 1.0);

    let medium = rung(&ladder, "fe-medium-graded");
    near(medium.relative_l2("reference"), 0.1);
    near(medium.seconds.map(|s| s.p50), 2.0);
    let reference = rung(&ladder, "fe-fine-graded");
    assert!(reference.reference && reference.kind == Kind::Fe && reference.bytes.is_none());
    near(reference.relative_l2("reference"), 0.0);
    near(reference.seconds.map(|s| s.p50), 10.0);
    let error = ladder.discretisation_error.as_ref().unwrap();
    near(Some(error.sed_relative_l2), 0.1 / (25.0 / 9.0 - 1.0));
    let readings = ladder.readings.as_ref().unwrap();
    assert_eq!((readings.states, readings.mesh.as_str()), (6, "fe-medium-graded"));
    // The bench's meshes differ in SED alone.
    near(Some(readings.pressure.p95), 0.0);
    near(readings.answers.get("tiny").map(|s| s.median), 0.0);
    assert_eq!(ladder.pareto_set.as_deref(), Some("reference"));
    for rung in &ladder.rungs {
        // Each is the faster or the better one; a floor takes no time and is no choice.
        assert_eq!(rung.pareto, rung.kind != Kind::Floor, "{}", rung.name);
    }
}

#[test]
fn the_page_and_the_pictures_name_every_rung_and_every_gap() {
    let bench = bench();
    bench.done(&COMMAND);
    let read = |name: &str| fs::read_to_string(bench.path(name)).unwrap();
    let page = read("out/accuracy-vs-time.md");
    for word in [
        "not measured: there is no dataset 'broad-graded'",
        "](accuracy-vs-time.svg)",
        "](accuracy-vs-time-zone.svg)",
        "| tiny | network |",
        "the truth",
        "errs by about 5.6 %",
        "| SED that `tiny` answers | 0.0 % | 0.0 % |",
    ] {
        assert!(page.replace("**tiny**", "tiny").contains(word), "{word}: {page}");
    }
    for table in page.split("\n\n").filter(|block| block.starts_with('|')) {
        let columns = |line: &str| line.matches('|').count();
        let first = table.lines().next().map(columns);
        assert!(table.lines().all(|line| Some(columns(line)) == first), "{table}");
    }
    let plot = read("out/accuracy-vs-time.svg");
    for word in ["tiny", "fe-fine-graded", "fe-medium-graded", "discretisation", "Pareto"] {
        assert!(plot.contains(word), "{word}");
    }
    for svg in [plot, read("out/accuracy-vs-time-zone.svg")] {
        assert!(svg.contains("</svg>") && !svg.contains("NaN") && !svg.contains("inf"));
    }
}

#[test]
fn quick_leaves_the_shipped_ladder_alone() {
    let bench = bench();
    let text = bench.done(&[&COMMAND[..], &["--quick", "--json"]].concat());
    let ladder = Ladder::from_json(&text).unwrap();
    assert!(ladder.quick && bench.path("out/accuracy-vs-time.json").is_file());
    assert!(!bench.path("models/ladder.json").exists());
    // Without FE and without data there is nothing to judge by, and it says so.
    let text =
        bench.done(&["ladder", "--data", "nowhere", "--out", "out/bare", "--quick", "--json"]);
    let bare = Ladder::from_json(&text).unwrap();
    assert!(bare.sets.iter().all(|set| set.samples == 0 && set.about.starts_with("not measured")));
    assert!(bare.rungs[0].errors.is_empty() && bare.pareto_set.is_none());
}

#[test]
fn a_mesh_that_did_not_reach_a_state_is_said_to_have_refused_it() {
    let bench = bench();
    bench.drop_last_depth("fe/medium");
    let ladder = Ladder::from_json(&bench.done(&[&COMMAND[..], &["--json"]].concat())).unwrap();
    let medium = rung(&ladder, "fe-medium-graded");
    assert_eq!((medium.refused, medium.errors["reference"].samples), (2, 4));
    near(medium.seconds.map(|s| s.p50), 3.0);
}

#[test]
fn fe_folders_that_break_their_contract_are_refused() {
    let bench = bench();
    bench.refused(3, &["ladder", "--data", "sets", "--fe", "fe/none"]);
    fs::write(bench.path("fe/medium/progress/press-00001.json"), "{").unwrap();
    assert!(bench.refused(1, &COMMAND).contains("not the record of an indentation"));
    fs::write(bench.path("fe/medium").join(FILES[1]), "no").unwrap();
    assert!(bench.refused(1, &COMMAND).contains(FILES[1]));
}
