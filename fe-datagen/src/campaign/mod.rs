//! Campaigns: many simulations of one finger, solved in parallel into a dataset.
//!
//! A campaign is a TOML file ([`CampaignSpec`]). [`solve`] solves the simulations of one [`Slice`] of
//! it, one on each core. Any number of slices may share a folder; a run without slices is one slice
//! that holds all. [`merge`] writes the dataset, in the format of [`papilla_dataset`]. Every process
//! can be killed at any time and started again: a simulation is one shard, which is written
//! atomically, and then a record of it is written into `DIR/progress`. The bytes of the dataset depend
//! on the campaign alone, not on slices, threads, kills or the clock.
//!
//! [`CampaignSpec`]: papilla_fingertip::campaign::CampaignSpec
//! [`Slice`]: papilla_fingertip::campaign::Slice

mod assemble;
mod beat;
mod checkpoint;
mod error;
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
pub use error::{BoxError, CampaignError};
pub use merge::merge;
pub use report::{CampaignReport, Failure, SliceReport};
pub use run::solve;
pub use solver::{IndentationSolver, RunOptions};
pub use status::{Heard, Status, StatusReader};
