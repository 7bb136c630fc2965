//! This finger's influence operator: the strain at the interface that unit pressure at each
//! vertex of the skin gives at small strain.
//!
//! To first order a finger is linear: displacement is `K^-1 f` with the tangent at rest `K`
//! and the nodal forces `f` of pressure, and strain is linear in displacement. So the SED
//! at interface vertex `v` (dermis side) is a sum of six squares of linear functions
//! of the pressures,
//!
//! `SED_v = sum_k (sum_j g[v, k, j] p_j)^2`.
//!
//! That averages strain from the faces round a vertex. The record of an indentation averages SED
//! instead, which is more where strain changes from face to face, as shear does below
//! a narrow contact. [`Faces`] holds the strain of each face, of which SED is the mean
//! of sums of squares, exactly as recorded.
//!
//! In prose: `docs/reference/operator.md`.

mod build;
mod compliance;
mod error;
mod second_order;
pub mod strain;
#[cfg(test)]
mod tests;

pub use build::build;
pub use compliance::{Compliance, compliance};
pub use error::InfluenceError;
pub use second_order::{Load, SecondOrder, second_order};
pub use strain::COMPONENTS;

use crate::geometry::fingertip::FingertipShape;
use crate::mesh::fingertip::{Density, Order};
use crate::scene::TissueTable;
use crate::scene::effects::{Law, Plan};
use crate::simulation::body::{Body, SimulationError};
use crate::simulation::laws::solids;
use serde::Serialize;

/// The influence operator of a finger.
#[derive(Clone, Debug, PartialEq)]
pub struct InfluenceOperator {
    /// Hash of the atlas whose vertices these are.
    pub atlas_hash: String,
    /// sqrt(J/m3) per Pa, `[vertex of the interface][component][vertex of the skin]`.
    pub g: Vec<f32>,
    /// The same face by face, before strain is averaged to the vertices.
    pub faces: Faces,
    /// Area of each skin vertex, undeformed, mm2.
    pub area_mm2: Vec<f64>,
    /// How well the systems were solved.
    pub quality: Quality,
}

/// Strain on the F faces of the interface round its V vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct Faces {
    /// sqrt(J/m3) per Pa, `[face][component][vertex of the skin]`.
    pub g: Vec<f32>,
    /// Per vertex of the interface the faces of which its SED is the mean, with weights that
    /// sum to 1.
    pub of_vertex: Vec<Vec<(usize, f64)>>,
}

/// What the influence operator is checked by.
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

impl InfluenceOperator {
    /// Number of vertices.
    #[must_use]
    pub fn vertices(&self) -> usize {
        self.area_mm2.len()
    }

    /// SED on the dermis side, J/m3, of pressures at the skin's vertices, Pa: squares of
    /// strain averaged to the vertices.
    ///
    /// # Errors
    /// [`InfluenceError::Pressures`] for another number of them.
    pub fn sed_j_per_m3(&self, pressure_pa: &[f64]) -> Result<Vec<f64>, InfluenceError> {
        self.sums_of_squares(&self.g, pressure_pa)
    }

    /// SED on the dermis side, J/m3, as an indentation records it: means of the faces' SED.
    ///
    /// # Errors
    /// [`InfluenceError::Pressures`] for another number of pressures.
    pub fn recorded_sed_j_per_m3(&self, pressure_pa: &[f64]) -> Result<Vec<f64>, InfluenceError> {
        let of_face = self.sums_of_squares(&self.faces.g, pressure_pa)?;
        let mean = |t: &Vec<(usize, f64)>| t.iter().map(|&(f, w)| w * of_face[f]).sum();
        Ok(self.faces.of_vertex.iter().map(mean).collect())
    }

    fn sums_of_squares(&self, g: &[f32], pressure_pa: &[f64]) -> Result<Vec<f64>, InfluenceError> {
        let vertices = self.vertices();
        if pressure_pa.len() != vertices {
            let found = pressure_pa.len();
            return Err(InfluenceError::Pressures { found, expected: vertices });
        }
        let square = |row: &[f32]| {
            row.iter().zip(pressure_pa).map(|(g, p)| f64::from(*g) * p).sum::<f64>().powi(2)
        };
        let sum = |rows: &[f32]| rows.chunks_exact(vertices).map(square).sum();
        Ok(g.chunks_exact(COMPONENTS * vertices).map(sum).collect())
    }
}

/// A fingertip at small strain: layers, rigid bone and nail.
///
/// # Errors
/// [`SimulationError`] if it cannot be set up.
pub fn body(
    shape: &FingertipShape,
    density: Density,
    order: Order,
    materials: &TissueTable,
) -> Result<Body, SimulationError> {
    let plan = Plan { law: Law::Linear, ..Plan::usual() };
    Body::fingertip(shape, solids(materials, &plan)?, density, order, plan.parts, None)
}
