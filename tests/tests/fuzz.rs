//! The fuzz corpus of the FE code's readers, replayed and mutated; see `tests/fuzz/run` for the
//! long form.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

#[path = "../../crates/fingertip/fuzz/entries.rs"]
mod entries;
#[path = "../fuzz/replay.rs"]
mod replay;

use replay::replay;

const CORPUS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../crates/fingertip/fuzz/corpus");

#[test]
fn scenes() {
    replay(CORPUS, "scene", entries::scene);
}

#[test]
fn meshes() {
    replay(CORPUS, "msh", entries::msh);
}
