//! Campaigns: many indentations of one finger, solved in parallel into a dataset.
//!
//! A campaign is a TOML file ([`CampaignSpec`]). [`solve`] solves the indentations of one [`Slice`] of
//! it, one per core; any number of slices may share a folder, and a serial run is the slice of all.
//! [`merge`] writes the dataset that [`papilla_dataset`] describes. All can be killed at any instant and started again: every indentation is one shard,
//! written atomically, with a record in `DIR/progress` written after it. The dataset's
//! bytes depend on the campaign alone, not on slices, threads, kills or the clock.
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
