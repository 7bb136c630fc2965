//! `model-export` command line.
fn main() {}
