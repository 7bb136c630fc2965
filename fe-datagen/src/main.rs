//! `fe-datagen` command line.
fn main() {}
