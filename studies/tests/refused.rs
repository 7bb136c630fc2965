//! What studies refuse is said once, with a cure.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::process::{Command, Output};

const FINGER: &str = "effects = [\"finite_strain\", \"layers\"]

[geometry]
kind = \"fingertip\"
density = \"coarse\"
order = \"linear\"
[motion]
depth_mm = 1.0
";

fn run(folder: &Path, arguments: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_papilla-studies");
    Command::new(program).args(arguments).current_dir(folder).output().unwrap()
}

fn refused(output: Output) -> String {
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{error}");
    error
}

#[test]
fn a_file_that_cannot_be_read_or_written_is_named_once() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("folder")).unwrap();
    std::fs::write(folder.path().join("empty.toml"), "").unwrap();
    std::fs::write(folder.path().join("good.toml"), FINGER).unwrap();
    for (arguments, words) in [
        (&["effects", "folder"][..], &["folder", "Is a directory"]),
        (&["effects", "good.toml", "--out", "empty.toml"], &["empty.toml", "a folder is due"]),
        (&["wedge", "--out", "empty.toml"], &["empty.toml", "a folder is due"]),
        (&["operators", "none.onnx"], &["none.onnx", "No such file"]),
        (&["actuators", "none", "--network", "none.onnx"], &["none.onnx", "No such file"]),
    ] {
        let error = refused(run(folder.path(), arguments));
        for word in words {
            let count = error.matches(word).count();
            assert_eq!(count, 1, "{arguments:?}: {error}should say {word} once");
        }
    }
}

#[test]
fn a_depth_has_no_time_to_be_taken_in() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bad.toml"), FINGER).unwrap();
    let error = refused(run(folder.path(), &["effects", "bad.toml", "--seconds", "0.1,1"]));
    for word in ["error: bad.toml:7:", "motion.path", "path = [{ time_s = 1.0, depth_mm = 1.0 }]"] {
        assert!(error.contains(word), "{error}should say {word}");
    }
}

#[test]
fn a_record_is_refused_by_line() {
    let folder = tempfile::tempdir().unwrap();
    let rows = "press,indenter,radius_mm,pitch_deg,time_s,depth_mm,force_n\n\
                a,plate,,0,1,0.2,0.1\na,plate,,0,2,400,0.2\na,plate,,0,3,0.6,0.4\n";
    std::fs::write(folder.path().join("me.csv"), rows).unwrap();
    let error = refused(run(folder.path(), &["fit", "--record", "me.csv", "--out", "out"]));
    for word in ["me.csv:3", "depth_mm", "was um meant?"] {
        assert!(error.contains(word), "{error}should say {word}");
    }
    assert!(!folder.path().join("out").exists(), "nothing is written");
}
