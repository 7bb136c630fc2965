//! This finger's linear operator: the strain at the interface that unit pressure at each
//! vertex of the skin gives at small strain.
//!
//! To first order a finger is linear: displacement is `K^-1 f` with the tangent at rest `K`
//! and the nodal forces `f` of pressure, and strain is linear in displacement. So the SED
//! at interface vertex `v` (dermis side) is a sum of six squares of linear functions
//! of the pressures,
//!
//! `SED_v = sum_k (sum_j g[v, k, j] p_j)^2`.
//!
//! [`Operator`] holds `g`. In prose: `docs/operator.md`.

mod build;
mod error;
pub mod strain;
#[cfg(test)]
mod tests;
mod write;

pub use build::build;
pub use error::OperatorError;
pub use strain::COMPONENTS;
pub use write::{Card, write};

use crate::mesh::fingertip::{Density, Order};
use crate::press::body::{Body, PressError};
use crate::press::laws::solids;
use crate::scene::TissueTable;
use crate::scene::effects::{Law, Plan};
use serde::Serialize;

/// The linear operator of a finger.
#[derive(Clone, Debug, PartialEq)]
pub struct Operator {
    /// Hash of the atlas whose vertices these are.
    pub atlas_hash: String,
    /// sqrt(J/m3) per Pa, `[vertex of the interface][component][vertex of the skin]`.
    pub g: Vec<f32>,
    /// Area of each skin vertex, undeformed, mm2.
    pub area_mm2: Vec<f64>,
    /// How well the systems were solved.
    pub quality: Quality,
}

/// What the operator is checked by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Quality {
    /// Unknowns of the mesh.
    pub unknowns: usize,
    /// Largest `|f - K u| / |f|` of all systems.
    pub residual_relative: f64,
    /// Largest difference between the work of load i on the displacement of load j and
    /// the reverse, over the largest work: 0 by Maxwell and Betti.
    pub reciprocity_relative: f64,
}

impl Operator {
    /// Number of vertices.
    #[must_use]
    pub fn vertices(&self) -> usize {
        self.area_mm2.len()
    }

    /// SED on the dermis side, J/m3, of pressures at the skin's vertices, Pa.
    ///
    /// # Errors
    /// [`OperatorError::Pressures`] for another number of them.
    pub fn sed_j_per_m3(&self, pressure_pa: &[f64]) -> Result<Vec<f64>, OperatorError> {
        let vertices = self.vertices();
        if pressure_pa.len() != vertices {
            let found = pressure_pa.len();
            return Err(OperatorError::Pressures { found, expected: vertices });
        }
        let square = |row: &[f32]| {
            row.iter().zip(pressure_pa).map(|(g, p)| f64::from(*g) * p).sum::<f64>().powi(2)
        };
        let of_vertex = |rows: &[f32]| rows.chunks_exact(vertices).map(square).sum();
        Ok(self.g.chunks_exact(COMPONENTS * vertices).map(of_vertex).collect())
    }
}

/// The fingertip of the design at small strain: layers, rigid bone and nail.
///
/// # Errors
/// [`PressError`] if it cannot be set up.
pub fn body(density: Density, order: Order, materials: &TissueTable) -> Result<Body, PressError> {
    let plan = Plan { law: Law::Linear, ..Plan::usual() };
    Body::fingertip(&Default::default(), solids(materials, &plan)?, density, order, plan.parts)
}
