//! Client of Papilla, a service that renders what a fingertip feels.
//!
//! Pressure on the skin (Pa) in, strain energy density (SED) at the dermis-epidermis interface
//! (J/m3) out, both 224 x 224 `f32`, row-major, row 0 at the fingertip's far end.
//!
//! | | |
//! |---|---|
//! | [`Session`] | many maps over a WebSocket; the latest frame wins; reconnects by itself |
//! | [`sed`] | one map over HTTP, blocking |
//! | [`device`] | what controllers and gloves take of the answers |
//! | [`frames`] | poses of engines and robots to the finger's frame, forces back |
//! | [`Skin`] | pressure maps from values at vertices or from contact points |
//!
//! The protocol itself is the crate `papilla-proto`, whose types this one hands through.
#![cfg_attr(feature = "guide", doc = include_str!("../../../docs/reference/clients/rust.md"))]

mod address;
mod answer;
pub mod device;
mod dial;
mod error;
pub mod frames;
mod http;
mod session;
mod skin;

pub use address::{Address, ToAddress};
pub use answer::{Answer, Status};
pub use dial::dial;
pub use error::PapillaError;
pub use http::{Rendered, atlas, atlas_of, get, sed, sed_of};
pub use papilla_proto as proto;
pub use session::{Frame, NetForce, Session};
pub use skin::{Contact, Skin};
