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
//!
//! ```
//! use papilla_tests::conformance::inputs::Pressure;
//!
//! // A disc of 8 kPa about row 112, column 100, as the conformance script writes it.
//! let of: Pressure = serde_json::from_str(r#"{"disc": [100.0, 112.0, 20.0, 8000.0]}"#)?;
//! let map_pa = of.draw(1.0, None);
//! assert_eq!((map_pa[112 * 224 + 100], map_pa[0]), (8000.0, 0.0));
//! # Ok::<(), serde_json::Error>(())
//! ```

pub mod conformance;
pub mod http;
pub mod load;
pub mod socket;
