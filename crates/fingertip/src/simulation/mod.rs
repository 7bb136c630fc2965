//! The indentation of one scene: a body, an indenter on its way, and what is recorded.
//!
//! ```
//! use papilla_fingertip::scene::Scene;
//! use papilla_fingertip::simulation::Simulation;
//!
//! let text = r#"
//!     [geometry]
//!     kind = "block"
//!     size_mm = [6.0, 6.0]
//!     elements = [4, 4]
//!     layers = [{ tissue = "dermis", thickness_mm = 2.0, elements = 2 }]
//!     [indenter]
//!     shape = "sphere"
//!     radius_mm = 4.0
//!     [motion]
//!     depth_mm = 0.3
//!     increments = 2
//! "#;
//! let scene = Scene::parse("scene.toml".as_ref(), text.into())?;
//! let mut forces_n = Vec::new();
//! Simulation::new(&scene)?.run(&mut |_, record, _| forces_n.push(record.force_n[2]))?;
//! assert!(forces_n.len() == 2 && forces_n[1] > forces_n[0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod balanced;
pub mod body;
pub mod drive;
pub mod fields;
mod finger;
mod fit;
mod fluid;
mod guide;
pub mod laws;
pub mod maps;
mod missed;
pub mod pressed;
pub mod record;
pub mod sample;
pub mod section;
mod setup;
mod skin;
mod touch;
mod way;

pub use setup::Simulation;
pub(crate) use way::equilibria;

#[cfg(test)]
mod tests;
