//! ONNX Runtime's library: missing, too old, and what a warm session takes of memory.
//!
//! A process opens the library once, so what goes wrong with it is seen in processes of its own.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]
#![cfg(feature = "ort")]

mod common;
#[path = "common/counting.rs"]
mod counting;

use common::{TINY, press_pa};
use counting::ALLOCATIONS;
use papilla_engine::{Backend, Choice, MAP_LEN, load_with};
use std::{env, fs, path::Path, process::Command, time::Duration};

#[test]
fn a_warm_session_allocates_nothing_of_ours() {
    let model = load_with(Backend::Ort, TINY, None).unwrap();
    let mut session = model.session().unwrap();
    let (pressure_pa, mut sed_j_per_m3) = (press_pa(), vec![0.0; MAP_LEN]);
    session.infer(&pressure_pa, &mut sed_j_per_m3).unwrap();
    let before = ALLOCATIONS.get();
    for _ in 0..8 {
        session.infer(&pressure_pa, &mut sed_j_per_m3).unwrap();
    }
    assert_eq!(ALLOCATIONS.get() - before, 0);
}

/// What a process that has this library says of it.
fn told_with(library: &Path) -> String {
    let mut command = Command::new(env::current_exe().unwrap());
    command.args(["--exact", "started_by_the_others", "--ignored", "--nocapture"]);
    let output = command.env("ORT_DYLIB_PATH", library).output().unwrap();
    let told = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{told}");
    told
}

#[test]
#[ignore = "started by the other tests, with another library"]
fn started_by_the_others() {
    println!("{}", Backend::Ort.require().unwrap_err());
    println!("{}", load_with(Backend::Ort, TINY, None).map(|_| ()).unwrap_err());
    // A service that may choose does without.
    let chosen = Choice::Auto.load(TINY, None, Duration::from_millis(1)).unwrap();
    println!("chosen: {}", chosen.backend());
}

#[test]
fn a_missing_library_is_named_with_what_to_install() {
    let told = told_with(Path::new("/no/such/libonnxruntime.so"));
    assert_eq!(told.matches("/no/such/libonnxruntime.so").count(), 2, "{told}");
    assert_eq!(told.matches("pip install onnxruntime").count(), 2, "{told}");
    assert!(told.contains("chosen: tract"), "{told}");
}

#[test]
fn a_library_that_is_too_old_is_named_with_its_version() {
    let folder = env::temp_dir().join(format!("papilla-old-library-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    let (source, library) = (folder.join("old.c"), folder.join("libonnxruntime.so"));
    let text = "static const char *version(void) { return \"1.12.1\"; }\n\
                static const void *base[] = {0, (const void *)version};\n\
                const void *OrtGetApiBase(void) { return base; }\n";
    fs::write(&source, text).unwrap();
    let built =
        Command::new("cc").args(["-shared", "-fPIC", "-o"]).args([&library, &source]).status();
    assert!(built.unwrap().success());
    let told = told_with(&library);
    fs::remove_dir_all(&folder).unwrap();
    assert!(told.contains("1.12.1") && told.contains("ONNX Runtime 1.17 or newer"), "{told}");
    assert!(told.contains("chosen: tract"), "{told}");
}
