//! Meshes of the finger: the solid fingertip and its cross-section.

mod extrude;
pub mod fingertip;
pub mod grading;
mod half_cube;
mod leaves;
mod mirror;
mod nail;
pub mod named;
mod patch;
mod quality;
mod refined;
pub mod section;
mod transfer;

pub use transfer::Transfer;
