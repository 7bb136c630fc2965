//! Ctrl-C in a solve: what is done is kept.
#![cfg(unix)]
// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

use ndarray::Ix3;
use papilla_output::npz::NpzArrays;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

const STATES: usize = 24;
const SCENE: &str = r#"
[geometry]
kind = "fingertip"
density = "coarse"
order = "linear"
[motion]
depth_mm = 1.2
increments = 24
"#;

/// Waits until the file is there; the solve must not end before.
fn wait_for(file: &Path, solve: &mut Child) {
    let begun = Instant::now();
    while !file.exists() {
        assert!(begun.elapsed() < Duration::from_secs(300), "{} never came", file.display());
        assert!(solve.try_wait().unwrap().is_none(), "the solve ended before {}", file.display());
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Solves, is interrupted once the first state is there, and ends.
fn interrupted(folder: &Path) -> Output {
    std::fs::write(folder.join("scene.toml"), SCENE).unwrap();
    let mut solve = Command::new(env!("CARGO_BIN_EXE_fe-datagen"))
        .current_dir(folder)
        .args(["solve", "scene.toml", "--out", "out"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    wait_for(&folder.join("out/state-000.vtu"), &mut solve);
    let kill = Command::new("kill").args(["-INT", &solve.id().to_string()]).status().unwrap();
    assert!(kill.success());
    solve.wait_with_output().unwrap()
}

#[test]
fn an_interrupted_solve_keeps_the_states_that_are_done() {
    let folder = tempfile::tempdir().unwrap();
    let found = interrupted(folder.path());
    let told = String::from_utf8_lossy(&found.stderr);
    assert_eq!(found.status.code(), Some(130), "{told}");
    let out = folder.path().join("out");
    let text = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&text("summary.json")).unwrap();
    let states = summary["increments"].as_array().unwrap().len();
    assert_eq!(summary["stopped"], true);
    assert!((1..STATES).contains(&states), "{states} states");
    assert!(told.contains(&format!("stopped: {states} of {STATES} states are done")), "{told}");
    assert_eq!(text("series.pvd").matches("<DataSet").count(), states);
    for state in 0..states {
        let bytes = std::fs::read(out.join(format!("state-{state:03}.vtu"))).unwrap();
        assert!(bytes.ends_with(b"</VTKFile>\n"), "state {state} is cut off");
    }
    let bytes = std::fs::read(out.join("maps.npz")).unwrap();
    let mut npz = NpzArrays::new("maps.npz".as_ref(), &bytes).unwrap();
    assert_eq!(npz.get::<f32, Ix3>("pressure_pa").unwrap().dim(), (states, 224, 224));
    assert!(out.join("sed.png").exists() && !out.join("last-state.vtu").exists());
}
