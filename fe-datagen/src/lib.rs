//! Solves campaigns into datasets, and holds the command line of simulations.
//!
//! ```
//! use papilla_dataset::{Sample, testing};
//! use papilla_fe_datagen::campaign::{
//!     Checkpoints, IndentationSolver, PressError, RunOptions, merge, solve,
//! };
//! use papilla_fingertip::campaign::Indentation;
//!
//! /// A formula in place of the finite elements.
//! struct Formula(usize);
//!
//! impl IndentationSolver for Formula {
//!     fn solve(
//!         &mut self,
//!         indentation: &Indentation,
//!         _: &mut Checkpoints<'_>,
//!     ) -> Result<Vec<Sample>, PressError> {
//!         Ok(indentation.depths_mm.iter().map(|d| testing::record(*d, self.0)).collect())
//!     }
//! }
//!
//! let spec = toml::from_str(
//!     r#"
//!     name = "example"
//!     seed = 1
//!     presses = 2
//!     depths_mm = [0.25, 0.5]
//!     test_fraction = 0.5
//!     density = "coarse"
//!     order = "linear"
//!     effects = ["finite_strain", "layers"]
//!     indenter = { shape = "sphere" }
//!     pose = { pitch_deg = [0.0, 30.0], roll_deg = [0.0, 0.0], yaw_deg = [0.0, 0.0] }
//!     "#,
//! )?;
//! let (atlas, folder) = (testing::atlas(4), tempfile::tempdir()?);
//! let solver = || Ok(Formula(atlas.vertex_count()));
//! solve(&spec, (&atlas, None), solver, folder.path(), &RunOptions::default())?;
//! let report = merge(&spec, folder.path())?;
//! assert_eq!((report.is_complete(), report.samples), (true, 4));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

// Determinism is tested: the same bits, not nearly the same.
#![cfg_attr(test, allow(clippy::float_cmp))]

pub mod campaign;
pub mod cli;
mod contact_model;
pub mod influence_file;
