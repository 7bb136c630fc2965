//! Files for people and other programs: maps as images, arrays, meshes.
//!
//! Every writer here is atomic ([`atomic::write`]) and deterministic: the same
//! values give the same bytes, whatever the clock says.

pub mod atomic;
pub mod canvas;
mod error;
pub mod map_image;
pub mod npz;
pub mod plot;
pub mod png_file;
pub mod vtu;

pub use error::OutputError;
