//! Surfaces of known fingers become these fingers; surfaces of which none can be made are refused
//! with the place.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

mod files;
mod fitted;
mod refused;
mod surfaces;
