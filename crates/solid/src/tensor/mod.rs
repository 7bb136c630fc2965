//! Second- and fourth-order tensors in three dimensions: kinematics, products, principal values.

pub mod eigen;
mod kinematics;

pub use kinematics::{
    Kinematics, Mat3, Tensor4, UNIT, cofactor, cofactor_derivative, double_dot, product, trace,
};

/// Euclidean norm.
#[inline]
#[must_use]
pub fn norm(v: [f64; 3]) -> f64 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}
