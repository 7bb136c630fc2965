//! The fingertip as finite elements: geometry, meshes, scenes and what an indentation gives.
//!
//! A [`scene::Scene`] says in TOML what is pressed by what, how, and which effects count. The
//! [`simulation`] builds the body, drives the indenter into it and records pressure and strain
//! energy density at each stored state; [`forecast`] says what that will cost. A [`campaign`] is a
//! distribution of indentations, [`influence`] the linear map from pressure to strain.
//!
//! Units: mm, N, MPa, s.

// Determinism is tested: the same bits, not nearly the same.
#![cfg_attr(test, allow(clippy::float_cmp))]

pub mod campaign;
pub mod forecast;
pub mod geometry;
pub mod indenter;
pub mod influence;
pub mod materials;
pub mod mesh;
pub mod scene;
pub mod simulation;
pub mod tissue;
