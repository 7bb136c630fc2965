//! Does nothing: a crate without it has no dependencies of its build.

fn main() {}
