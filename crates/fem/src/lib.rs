//! Finite-strain finite elements with frictional contact against rigid shapes.
//!
//! A body is a [`mesh`] whose elements belong to numbered regions, one [`element::ConstitutiveModel`]
//! a region, supports and a surface that may touch. [`solve::Solver`] finds its equilibria:
//! total Lagrangian, mean-dilatation elements, augmented Lagrangian contact on signed distances
//! ([`papilla_sdf`]), Newton's method with a line search, conjugate gradients preconditioned by an
//! older single-precision factor. The same input gives the same bits.
//!
//! Units: mm, N, MPa, s; energy in mJ.

// Determinism is tested: the same bits, not nearly the same.
#![cfg_attr(test, allow(clippy::float_cmp))]

pub mod contact;
pub mod element;
pub mod linear;
pub mod material;
pub mod mesh;
pub mod solve;
pub mod tensor;
