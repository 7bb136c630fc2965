//! End-to-end tests and the load generator of Papilla.
//!
//! | module | holds |
//! |---|---|
//! | [`http`] | a plain HTTP client |
//! | [`socket`] | a client of a session |
//! | [`load`] | what `papilla-load` does |
//!
//! The clients share no code with the server beyond the wire contract.

mod dial;
pub mod http;
pub mod load;
pub mod socket;
