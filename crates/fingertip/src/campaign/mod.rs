//! Campaigns as files: a distribution of indentations of one finger.
//!
//! A campaign is a TOML file ([`CampaignSpec`]): ranges of pose, offset and depth for some
//! indenters. [`indentations`] draws its indentations, the same ones for the same seed.

mod error;
mod sampling;
mod slice;
mod spec;
pub mod testing;
#[cfg(test)]
mod tests;

pub use error::SpecError;
pub use sampling::{HeldOut, Indentation, held_out, indentations, indentations_in};
pub use slice::{Slice, SliceError};
pub use spec::{CampaignSpec, Candidate, DepthRange, PoseRanges, SlideRange};
