//! What the fingertip's finite elements are checked by.
//!
//! [`verify`]: closed forms, benchmarks, balances. [`stability`]: hard cases, each of which
//! converges to a right answer or is refused. [`calculix`]: the same problems in another program.
//! [`convergence`]: SED at the interface on ever finer meshes.
//! [`wedge`]: the figures of Chen, Shuai & Zhu. [`effect_study`]: what each effect of a scene
//! changes and costs.
//!
//! ```
//! use papilla_validation::verify;
//!
//! let report = verify::run(true, &|case| case.name == "uniaxial", &mut |_, _| ());
//! assert!(report.passed());
//! ```

// Determinism is tested: the same bits, not nearly the same.
#![cfg_attr(test, allow(clippy::float_cmp))]

pub mod acceptance;
pub mod calculix;
pub mod convergence;
mod csv;
pub mod effect_study;
pub mod finger_maps;
pub mod part;
pub mod processor;
pub mod stability;
pub mod verify;
pub mod wedge;
