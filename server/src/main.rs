//! Papilla service.
fn main() {}
