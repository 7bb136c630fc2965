//! Computes maps, whatever transport brings the frames.
//!
//! `scheduler` takes jobs to the inference threads; sessions take turns. `desk` checks hellos on
//! threads of its own. `catalogue` holds the tiers, the atlas and the replay of one finger, and
//! `fingers` the fingers that clients can name. `reload` loads and replaces them while the service
//! runs. `buffers` are used again from frame to frame. `latency` and `metrics` keep the times.

pub(crate) mod buffers;
pub(crate) mod cache;
pub(crate) mod catalogue;
pub(crate) mod desk;
pub(crate) mod digest;
pub(crate) mod fingers;
pub(crate) mod latency;
pub(crate) mod reload;
pub(crate) mod scheduler;
