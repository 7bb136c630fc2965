//! Questions that were asked once, each answered by the product's own crates.
//!
//! [`people`]: the finger beside people's fingers. [`wedge`]: the figures of Chen, Shuai & Zhu.
//! [`calculix`]: the same problems in another program. [`effects`]: what each effect of a scene
//! changes and costs. [`spikes`]: touch units against `TouchSim`. [`actuators`]: which drives of
//! pins give a map. [`operators`]: where the time of a network goes.
//!
//! The questions, their commands and answers: `studies/README.md`. No crate of the product depends
//! on this one, which `tests/suite/crates.py` sees to.

// Determinism is tested: the same bits, not nearly the same.
#![cfg_attr(test, allow(clippy::float_cmp))]

pub mod actuators;
pub mod calculix;
pub mod effects;
pub mod operators;
pub mod people;
pub mod spikes;
pub mod wedge;
