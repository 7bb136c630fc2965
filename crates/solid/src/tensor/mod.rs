//! Second- and fourth-order tensors in three dimensions: kinematics, products, principal values.

pub mod eigen;
mod kinematics;

pub use kinematics::{
    Kinematics, Mat3, Tensor4, UNIT, cofactor, cofactor_derivative, double_dot, product, trace,
};
