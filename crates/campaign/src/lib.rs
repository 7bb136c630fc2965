//! Campaigns: many simulations of one finger, solved in parallel into a dataset.
//!
//! A campaign is a TOML file ([`CampaignSpec`]). [`CampaignCost`] says what it is going to cost.
//! [`generate`] solves one [`Slice`] of it on the campaign's own meshes; [`solve`] does the same with
//! a solver of the caller's. Any number of slices may share a folder; a run without slices is one
//! slice that holds all. [`merge`] writes the dataset, in the format of [`papilla_dataset`]. Every
//! process can be killed at any time and started again: a simulation is one shard, which is written
//! atomically, and then a record of it is written into `DIR/progress`. The bytes of the dataset
//! depend on the campaign alone, not on slices, threads, kills or the clock.
//!
//! ```
//! use papilla_dataset::{Sample, testing};
//! use papilla_campaign::{
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
//!
//! [`CampaignSpec`]: papilla_fingertip::campaign::CampaignSpec
//! [`Slice`]: papilla_fingertip::campaign::Slice

// Determinism is tested: the same bits, not nearly the same.
#![cfg_attr(test, allow(clippy::float_cmp))]

mod assemble;
mod beat;
mod checkpoint;
mod cost;
mod error;
mod generate;
mod merge;
mod queue;
mod report;
mod run;
mod solver;
mod state;
mod status;
#[cfg(test)]
mod tests;

pub use beat::{Beat, Ended, Running};
pub use checkpoint::{Checkpoints, PressError};
pub use cost::CampaignCost;
pub use error::{BoxError, CampaignError};
pub use generate::{Generated, generate};
pub use merge::merge;
pub use report::{CampaignReport, Failure, SliceReport};
pub use run::solve;
pub use solver::{Count, IndentationSolver, RunOptions};
pub use status::{Heard, Status, StatusReader};
