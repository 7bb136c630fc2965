//! Holds the command line of simulations.

// Determinism is tested: the same bits, not nearly the same.
#![cfg_attr(test, allow(clippy::float_cmp))]

pub mod cli;
mod contact_model;
pub mod influence_file;
