//! Campaigns: many indentations of one finger, solved in parallel into a dataset.
//!
//! A campaign is a TOML file ([`CampaignSpec`]). [`run`] solves its indentations,
//! one per core, and writes the dataset that [`papilla_dataset`] describes. It can be
//! killed at any instant and started again: every indentation is one shard, written
//! atomically, with a record in `DIR/progress` written after it. The dataset's
//! bytes depend on the campaign alone, not on threads, kills or the clock.

mod assemble;
mod error;
mod report;
mod run;
mod state;
#[cfg(test)]
mod tests;

pub use error::{BoxError, CampaignError};
pub use report::CampaignReport;
pub use run::{IndentationSolver, RunOptions, run};
