//! Finite-element fingertip: scenes, solver, atlas, dataset.

// Determinism is tested: the same bits, not nearly the same.
#![cfg_attr(test, allow(clippy::float_cmp))]

pub use papilla_atlas::flatten as atlas;
pub mod campaign;
pub mod cli;
pub mod contact;
pub mod dataset;
pub mod element;
pub mod export;
pub mod forecast;
pub mod geometry;
pub mod indenter;
pub mod linear;
pub mod material;
pub mod mesh;
pub mod operator;
pub use papilla_output as output;
pub mod press;
pub mod processor;
pub mod rungs;
pub mod s2;
pub mod scene;
pub mod solve;
pub mod stability;
pub mod verify;
