//! End-to-end tests and the load generator of Papilla.
//!
//! | module | holds |
//! |---|---|
//! | [`http`] | a plain HTTP client |
//! | [`socket`] | a client of a session |
//! | [`load`] | what `papilla-load` does |
//! | [`conformance`] | what the clients' conformance script expects |
//!
//! The clients share no code with the server beyond the wire contract.

pub mod conformance;
mod dial;
pub mod http;
pub mod load;
pub mod socket;
