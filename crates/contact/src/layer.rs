//! A layer of the skin, as a contact model's header names it.

use serde::{Deserialize, Serialize};

/// A layer of the skin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    /// Young's modulus, MPa.
    pub young_mpa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Thickness, mm.
    pub thickness_mm: f64,
}

impl Layer {
    /// Lame's constants, MPa.
    pub(crate) fn lame_mpa(&self) -> [f64; 2] {
        let Self { young_mpa: e, poisson: nu, .. } = *self;
        [e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu))]
    }
}
