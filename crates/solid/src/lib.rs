//! Laws of soft solids: energy, stress and tangent as formulas on the type.
//!
//! A law sees the displacement gradient `H` at a point ([`tensor::Kinematics`]), never a node.
//! Energies are per unit undeformed volume, in MPa = mJ/mm3. Every law is an
//! isochoric part, a function of `F / J^(1/3)`, plus the volumetric part
//! `K/2 (J - 1)^2`, which the mean-dilatation element integrates itself.
//! One file a law.

#[cfg(test)]
mod derivatives;
mod linear;
mod neo_hookean;
mod ogden;
pub mod prony;
pub mod tensor;

pub use linear::LinearElastic;
pub use neo_hookean::NeoHookean;
pub use ogden::{Ogden, OgdenTerm};
pub use prony::{Prony, PronyTerm, Relaxing};

use crate::tensor::{Kinematics, Mat3, Tensor4};

/// Shear modulus `E / 2(1 + nu)` and bulk modulus `E / 3(1 - 2 nu)` of Young's modulus `E` and
/// Poisson's ratio `nu`, in the unit of `E`.
#[must_use]
pub fn moduli(e: f64, nu: f64) -> [f64; 2] {
    [e / (2.0 * (1.0 + nu)), e / (3.0 * (1.0 - 2.0 * nu))]
}

/// The isochoric part of a law.
pub trait Isochoric: Copy + Send + Sync + 'static {
    /// Whether the law is of finite strain. One of small strain sees the
    /// symmetric part of `H` only, its volume change is `tr H`, and it has no
    /// geometric stiffness.
    const FINITE: bool;
    /// Energy density, MPa.
    fn energy(&self, k: &Kinematics) -> f64;
    /// First Piola-Kirchhoff stress `dU/dF`, MPa.
    fn first_piola(&self, k: &Kinematics) -> Mat3;
    /// Both, for a law that computes them from the same.
    fn energy_and_first_piola(&self, k: &Kinematics) -> (f64, Mat3) {
        (self.energy(k), self.first_piola(k))
    }
    /// Tangent `d2U/dF2`, MPa, with major symmetry.
    fn tangent(&self, k: &Kinematics) -> Tensor4;
    /// Shear modulus at rest, MPa.
    fn shear_modulus_mpa(&self) -> f64;
    /// Whether the point has left the stretches that the law was fitted to.
    fn outside_calibration(&self, _k: &Kinematics) -> bool {
        false
    }
}
