//! The whole service, from the outside: every route, every error path, real models.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

mod binary;
mod drain;
mod effects;
mod hostile;
mod information;
mod ladder;
mod page;
mod rendering;
mod session;
mod start;
mod support;
