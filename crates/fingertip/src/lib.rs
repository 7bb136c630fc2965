//! The fingertip as finite elements: geometry, meshes, scenes and what an indentation gives.
//!
//! A [`scene::Scene`] says in TOML what is pressed by what, how, and which effects count. The
//! [`simulation`] builds the body, drives the indenter into it and records pressure and strain
//! energy density at each stored state; [`forecast`] says what that will cost. A [`campaign`] is a
//! distribution of indentations, [`influence`] the linear map from pressure to strain.
//!
//! Units: mm, N, MPa, s.
//!
//! What an indentation will cost, before anything is solved:
//!
//! ```
//! use papilla_fingertip::{forecast::Forecast, scene::Scene, simulation::Simulation};
//!
//! let text = r#"
//!     [geometry]
//!     kind = "fingertip"
//!     density = "coarse"
//!     order = "linear"
//!     [indenter]
//!     shape = "sphere"
//!     radius_mm = 5.0
//!     [motion]
//!     depth_mm = 1.0
//!     increments = 4
//! "#;
//! let scene = Scene::parse("scene.toml".as_ref(), text.into())?;
//! let forecast = Forecast::new(&scene, &Simulation::new(&scene)?);
//! println!("{} MB, {:.0} s", forecast.memory_bytes >> 20, forecast.seconds.total);
//! assert!(forecast.factor_entries > 0 && forecast.seconds.total > 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

// Determinism is tested: the same bits, not nearly the same.
#![cfg_attr(test, allow(clippy::float_cmp))]

pub mod campaign;
pub mod forecast;
pub mod geometry;
pub mod indenter;
pub mod influence;
pub mod materials;
pub mod mesh;
pub mod run;
pub mod scene;
pub mod simulation;
pub mod tissue;
