//! Files for people and other programs: maps as images, arrays, meshes.
//!
//! Every writer here is atomic ([`atomic::write`]) and deterministic: the same
//! values give the same bytes, whatever the clock says.
//!
//! ```
//! use papilla_output::npz::{NpzArrays, NpzBuilder};
//!
//! let mut npz = NpzBuilder::new();
//! npz.add_slice("depth_mm", &[3], &[0.5f32, 1.0, 1.5])?;
//! let bytes = npz.finish()?;
//! let mut arrays = NpzArrays::new("depths.npz".as_ref(), &bytes)?;
//! assert_eq!(arrays.get::<f32, ndarray::Ix1>("depth_mm")?[2], 1.5);
//! # Ok::<(), papilla_output::OutputError>(())
//! ```

pub mod atomic;
pub mod canvas;
mod error;
pub mod map_image;
pub mod npz;
pub mod plot;
pub mod png_file;
pub mod vtu;

pub use error::{OutputError, told};
