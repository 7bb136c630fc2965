//! How closely the skin is meshed under an indenter.
//!
//! Where an indenter is going to touch the smooth skin, and how it is curved there, says how
//! close nodes have to be; cells of the lattice are halved until they are
//! ([`super::leaves`]).

mod contact;
mod spacing;

pub use contact::{Coming, Contact};
pub use spacing::{Closeness, Spacing};

#[cfg(test)]
mod tests;
