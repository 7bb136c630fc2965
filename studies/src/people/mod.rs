//! The finite-element fingertip beside what was measured on people's fingers.
//!
//! [`measured`] holds the measurements with their sources, as data. [`study`] presses the finger
//! as people's were pressed, [`rates`] fits the rates of SA1 afferents to what a receptor feels, and
//! a [`report`] says of every figure how far the finger is from it.
//!
//! Units: mm, N, MPa, s.
//!
//! ```
//! use papilla_studies::people::rates::{Law, r_squared};
//!
//! // Rates that start at 2 and rise by 10 for each unit above it.
//! let felt = [1.0, 2.0, 3.0, 5.0];
//! let rate = [0.0, 0.0, 10.0, 30.0];
//! let law = Law::fitted(&felt, &rate).unwrap();
//! assert!((law.gain - 10.0).abs() < 1e-9 && (law.threshold - 2.0).abs() < 1e-9);
//! assert!(r_squared(&rate, &felt.map(|q| law.rate_per_s(q))) > 0.999);
//! ```

pub mod afferents;
mod contact;
mod error;
pub mod fit;
pub mod force_path;
mod gradients;
pub mod measured;
pub mod mesh_error;
mod pad;
mod press;
mod profile_turn;
pub mod rates;
pub mod receptors;
pub mod report;
mod shear;
mod solution;
pub mod study;
mod tangential;
mod tap;

pub use error::PeopleError;
