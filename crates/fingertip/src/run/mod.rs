//! A scene solved and explained, whoever asks: the command line and Python.
//!
//! ```
//! use papilla_fem::solve::Options;
//! use papilla_fingertip::run::press;
//! use papilla_fingertip::scene::Scene;
//! use papilla_fingertip::simulation::Simulation;
//!
//! let text = r#"
//!     [geometry]
//!     kind = "block"
//!     size_mm = [6.0, 6.0]
//!     elements = [4, 4]
//!     layers = [{ tissue = "dermis", thickness_mm = 2.0, elements = 2 }]
//!     [indenter]
//!     shape = "sphere"
//!     radius_mm = 4.0
//!     [motion]
//!     depth_mm = 0.3
//! "#;
//! let setup = Simulation::new(&Scene::parse("scene.toml".as_ref(), text.into())?)?;
//! let mut solver = setup.body.solver(Options::default())?;
//! let (states, solved) = press(&setup, &mut solver, &mut |_, _, _| {});
//! solved?;
//! assert!(states.len() == 1 && states[0].pressure_mpa_max > 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod doubts;
mod explain;
mod press;
mod summary;
mod vtu;

pub use doubts::doubts;
pub use explain::{BETTER, Explanation};
pub use press::{Pressed, press};
pub use summary::Increment;
pub use vtu::{BodyFields, cells, write_vtu};
