//! Meshes with hanging nodes, points found in a mesh, and strain energy density read at an interface.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::float_cmp, clippy::unwrap_used)]

mod hanging;
mod probe;
mod recovery;
