//! Shapes of the body, before any mesh.

pub mod fingertip;
pub mod section;
