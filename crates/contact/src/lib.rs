//! From where things are to what presses on a finger: contact in real time.
//!
//! A [`ContactModel`] holds how a finger's skin moves under forces. A [`Solver`] finds the
//! pressure that keeps the skin out of [`Object`]s, frame by frame:
//! `p >= 0`, `gap >= 0`, `p gap = 0` at every vertex, on the displaced skin.
//! In prose, with what accuracy costs in time: `docs/concepts/contact.md`.

mod answer;
mod bounded;
mod clusters;
mod error;
mod file;
mod force_target;
mod gaps;
mod half_space;
mod kernels;
mod ladder;
mod model;
mod objects;
mod patch;
mod second_order;
mod solver;
mod springs;

pub use answer::{Contact, Effort, Person, Quality};
pub use error::{ContactError, ModelError};
pub use force_target::NetForce;
pub use gaps::Gaps;
pub use ladder::Method;
pub use model::{Arrays, ContactModel, Header};
pub use objects::{Object, Scene};
pub use solver::{Settings, Solver};
