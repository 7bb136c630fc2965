//! Campaigns of indentations into datasets, and the command line over all that is offline.

// Determinism is tested: the same bits, not nearly the same.
#![cfg_attr(test, allow(clippy::float_cmp))]

mod body_file;
pub mod campaign;
pub mod cli;
pub mod influence_file;
mod progress;
