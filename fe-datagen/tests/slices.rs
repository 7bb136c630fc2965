//! Slices of a real campaign, as a scheduler treats them.
#![cfg(unix)]
// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const CAMPAIGN: &str = r#"
name = "slices"
seed = 7
presses = 2
depths_mm = [0.05, 0.08, 0.11, 0.14]
test_fraction = 0.5
density = "coarse"
order = "linear"
effects = ["finite_strain", "layers"]
indenter = { shape = "plate" }
pose = { pitch_deg = [0.0, 30.0], roll_deg = [-15.0, 15.0], yaw_deg = [0.0, 0.0] }
"#;

fn program(folder: &Path, arguments: &str) -> Command {
    std::fs::write(folder.join("c.toml"), CAMPAIGN).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_fe-datagen"));
    command.args(arguments.split_whitespace()).current_dir(folder);
    for name in ["ID", "COUNT", "MIN", "MAX", "STEP"] {
        command.env_remove(format!("SLURM_ARRAY_TASK_{name}"));
    }
    command.stdout(Stdio::null());
    command
}

fn code(folder: &Path, arguments: &str) -> i32 {
    program(folder, arguments).status().unwrap().code().unwrap()
}

/// What is stored of indentations under way.
fn stored(folder: &Path) -> Vec<Vec<u8>> {
    let progress = std::fs::read_dir(folder.join("out/progress")).into_iter().flatten();
    let paths = progress.flatten().map(|entry| entry.path());
    let states = paths.filter(|path| path.extension().is_some_and(|x| x == "state"));
    states.filter_map(|path| std::fs::read(path).ok()).collect()
}

/// Starts to solve, sends signals once an indentation has stored a further state, and returns how
/// that ended: `None` by a signal, 0 where the slice was done before.
fn signalled(folder: &Path, arguments: &str, signals: &[&str]) -> Option<i32> {
    let before = stored(folder);
    let mut child = program(folder, arguments).spawn().unwrap();
    let begun = Instant::now();
    while stored(folder) == before && child.try_wait().unwrap().is_none() {
        assert!(begun.elapsed() < Duration::from_secs(300), "waited for a stored state");
        std::thread::sleep(Duration::from_millis(5));
    }
    for signal in signals {
        // It may have ended meanwhile.
        Command::new("kill").args([*signal, &child.id().to_string()]).status().unwrap();
    }
    child.wait().unwrap().code()
}

/// TERM, USR1 and kill -9 in the midst of an indentation; what is started again after each makes
/// the manifest, and so the hashes of all shards, of a run that nothing disturbed.
#[test]
fn a_campaign_that_is_asked_to_leave_ends_in_the_same_bytes() {
    let [whole, asked] = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let generate = "generate c.toml --out out --threads 1 --checkpoint-s 0";
    assert_eq!(code(whole.path(), generate), 0);
    let folder = asked.path();
    let slice = format!("{generate} --slice 1/2");
    assert_eq!(signalled(folder, &slice, &["-TERM"]), Some(75));
    assert_eq!(stored(folder).len(), 1);
    let left = signalled(folder, &slice, &["-USR1"]);
    assert!(left == Some(75) || left == Some(0), "{left:?}");
    assert_eq!(code(folder, "dataset merge c.toml --out out"), 1, "there are holes");
    let second = slice.replace("1/2", "2/2");
    assert_eq!(signalled(folder, &second, &["-TERM", "-TERM"]), Some(75));
    assert_eq!(signalled(folder, &second, &["-KILL"]), None);
    // As a task of an array, without the flag.
    for task in ["0", "1"] {
        let mut command = program(folder, generate);
        for (name, value) in [("ID", task), ("COUNT", "2"), ("MIN", "0"), ("MAX", "1")] {
            command.env(format!("SLURM_ARRAY_TASK_{name}"), value);
        }
        assert_eq!(command.status().unwrap().code(), Some(0));
    }
    assert!(!folder.join("out/manifest.json").exists(), "slices make no dataset");
    assert_eq!(code(folder, "dataset merge c.toml --out out"), 0);
    assert_eq!(code(folder, "dataset verify out"), 0);
    let manifest = |folder: &Path| std::fs::read(folder.join("out/manifest.json")).unwrap();
    assert!(manifest(folder) == manifest(whole.path()));
}

/// What another mesh makes of a campaign says that it is another mesh's; a folder holds one.
#[test]
fn presses_on_another_mesh_are_a_dataset_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let generate = "generate c.toml --out out --slice 1/3";
    assert_eq!(code(folder.path(), &format!("{generate} --mesh fines")), 1);
    assert!(!folder.path().join("out").exists(), "refused before anything is solved");
    // The first of three parts of two indentations is empty: nothing is solved here.
    assert_eq!(code(folder.path(), &format!("{generate} --mesh coarse-graded")), 0);
    assert_eq!(code(folder.path(), generate), 1, "the folder is of another mesh");
    assert_eq!(code(folder.path(), "dataset status c.toml --mesh coarse-graded --out out"), 0);
    assert_eq!(code(folder.path(), "dataset status c.toml --out out"), 1);
}

#[test]
fn wrong_slices_are_wrong_usage() {
    let folder = tempfile::tempdir().unwrap();
    for slice in ["0/4", "5/4", "x"] {
        assert_eq!(code(folder.path(), &format!("generate c.toml --out out --slice {slice}")), 2);
    }
    let mut command = program(folder.path(), "generate c.toml --out out");
    for (name, value) in [("ID", "7"), ("COUNT", "2"), ("MIN", "3"), ("MAX", "7")] {
        command.env(format!("SLURM_ARRAY_TASK_{name}"), value);
    }
    let output = command.stderr(Stdio::piped()).output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains("--slice I/N"), "{text}");
    assert!(!folder.path().join("out").exists());
    assert_eq!(code(folder.path(), "dataset status c.toml --out out"), 1);
}
