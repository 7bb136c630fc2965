//! Campaigns as files: a distribution of indentations of one finger.
//!
//! A campaign is a TOML file ([`CampaignSpec`]): ranges of pose, offset and depth for some
//! indenters. [`presses`] draws its indentations, the same ones for the same seed.

mod error;
mod sampling;
mod spec;
#[cfg(test)]
mod tests;

pub use error::SpecError;
pub use sampling::{HeldOut, Press, held_out, presses};
pub use spec::{CampaignSpec, Candidate, DepthRange, PoseRanges};
