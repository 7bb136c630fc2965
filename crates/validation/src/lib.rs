//! What the fingertip's finite elements are checked by.
//!
//! [`verify`]: closed forms, benchmarks, balances. [`stability`]: hard cases, each of which
//! converges to a right answer or is refused. [`convergence`]: SED at the interface on ever finer
//! meshes.
//!
//! ```
//! use papilla_validation::verify;
//!
//! let report = verify::run(true, &|case| case.name == "uniaxial", &mut |_, _| ());
//! assert!(report.passed());
//! ```

// Determinism is tested: the same bits, not nearly the same.
#![cfg_attr(test, allow(clippy::float_cmp))]

pub mod convergence;
mod csv;
pub mod stability;
pub mod stored;
pub mod verify;
