//! Meshes of the finger: the solid fingertip and its cross-section.

mod extrude;
pub mod fingertip;
pub mod grading;
mod half_cube;
mod mirror;
mod nail;
#[cfg(test)]
mod quality;
pub mod section;
