//! What is left of a solve that is given up.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

use std::process::Command;

/// A block 1 mm thick that is to be squeezed to nothing: no mesh of eight elements does that.
const TOO_FAR: &str = r#"
[geometry]
kind = "block"
size_mm = [2.0, 2.0]
elements = [2, 2]
layers = [{ tissue = "dermis", thickness_mm = 1.0, elements = 2 }]
[indenter]
shape = "sphere"
radius_mm = 2.0
[motion]
depth_mm = 1.5
increments = 3
"#;

/// The solve is given up with a typed error; its story is told on demand, the states before it
/// and its last equilibrium are kept.
#[test]
fn a_solve_that_is_given_up_tells_its_story_and_leaves_its_last_state() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("too-far.toml");
    std::fs::write(&scene, TOO_FAR).unwrap();
    let out = folder.path().join("out");
    let found = Command::new(env!("CARGO_BIN_EXE_fe-datagen"))
        .args(["solve".as_ref(), scene.as_os_str(), "--out".as_ref(), out.as_os_str()])
        .env("RUST_LOG", "papilla=debug")
        .env_remove("NO_COLOR")
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&found.stderr);
    assert_eq!(found.status.code(), Some(1), "{text}");
    assert!(!text.contains('\u{1b}'), "a redirected log has no colours:\n{text}");
    for event in ["load step cut", "solve given up", "no equilibrium beyond load fraction"] {
        assert!(text.contains(event), "'{event}' is missing:\n{text}");
    }
    // Where, how deep and how hard.
    for word in ["block=", "element=", "j_min=", "condition_at_least=", "cuts=", "iterations="] {
        assert!(text.contains(word), "'{word}' is missing:\n{text}");
    }
    // Raw numbers follow the header.
    let state = std::fs::read(out.join("last-state.vtu")).unwrap();
    let head = String::from_utf8_lossy(&state[..state.len().min(400)]).into_owned();
    assert!(head.contains("<UnstructuredGrid") && head.contains("NumberOfCells=\"8\""), "{head}");
    let summary = std::fs::read_to_string(out.join("summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    let states = summary["increments"].as_array().unwrap();
    assert!(!states.is_empty(), "no state before the error was kept");
    for state in states {
        assert!(state["checks"]["j_min"].as_f64().unwrap() > 0.0);
        assert!(state["condition_at_least"].as_f64().unwrap() > 1.0);
        assert_eq!(state["j_min_at"].as_array().unwrap().len(), 2);
        for figure in ["outside_calibration", "effort", "force_n"] {
            assert!(state.get(figure).is_some(), "{figure} is missing");
        }
    }
}
