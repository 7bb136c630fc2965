//! Biphasic bodies against closed forms and an independent solution.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::float_cmp, clippy::unwrap_used)]

mod bodies;
mod column;
mod confined;
mod cryer;
mod mandel;
mod refused;
