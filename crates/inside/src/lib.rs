//! Papilla inside a program: a folder of models that is read once, and sessions that compute on the
//! thread of the caller. The native library for C and the Python package use it.
//!
//! [`Session`] takes the hello and the frames of the protocol as the service does, and writes the same
//! sections of answers, without sockets, queues and deadlines. [`Contact`] finds contact on one
//! finger, and [`Feel`] computes effects of SED that is known. Neither runs a network.
//!
//! ```
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))?;
//! use papilla_inside::{Frame, Model, Session, read_hello};
//!
//! let model = Model::load("models".as_ref(), Some("nano"), None)?.into();
//! let mut session = Session::open(&model, &read_hello(r#"{"type": "hello"}"#)?)?;
//! let mut pressure_pa = vec![0.0; 224 * 224];
//! (95..115).for_each(|row| pressure_pa[row * 224 + 105..][..25].fill(8e3));
//! session.render(0, Frame::Map(&pressure_pa), 0)?;
//! assert!(session.sed_j_per_m3().iter().any(|sed| *sed > 0.0));
//! # Ok(())
//! # }
//! ```

mod bundle;
mod contact;
mod feel;
mod folder;
mod hello;
mod model;
mod session;

pub use bundle::Bundle;
pub use contact::{Contact, Solved};
pub use feel::Feel;
pub use folder::LoadError;
pub use hello::read_hello;
pub use model::{Model, Network};
pub use papilla_proto::Problem;
pub use session::{Frame, Made, Session};
