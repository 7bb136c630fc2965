//! The fuzz corpus of this crate, replayed and mutated; see `tests/fuzz/run` for the long form.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

#[path = "../fuzz/entries.rs"]
mod entries;
#[path = "../../tests/fuzz/replay.rs"]
mod replay;

use replay::replay;

const CORPUS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/fuzz/corpus");

#[test]
fn frames() {
    replay(CORPUS, "frame", entries::frame);
}

#[test]
fn messages_of_a_session() {
    replay(CORPUS, "session", entries::session);
}

#[test]
fn samples() {
    replay(CORPUS, "samples", entries::samples);
}

#[test]
fn atlases() {
    replay(CORPUS, "atlas", entries::atlas);
}
