//! The operator on disk: `operator.npz` and `operator.json`.

use super::{COMPONENTS, Operator, OperatorError, Quality};
use crate::mesh::fingertip::{Density, Order};
use crate::output::atomic;
use crate::output::npz::NpzBuilder;
use crate::scene::TissueTable;
use serde::Serialize;
use std::path::Path;

/// `operator.json`: what `operator.npz` is the operator of.
#[derive(Clone, Debug, Serialize)]
pub struct Card {
    /// Version of this format.
    pub format: u32,
    /// Program and version.
    pub software: &'static str,
    /// Hash of the atlas whose vertices the arrays are over.
    pub atlas_hash: String,
    /// Vertices.
    pub vertices: usize,
    /// Mesh density.
    pub density: Density,
    /// Order of the elements.
    pub order: Order,
    /// Effects that are on.
    pub effects: Vec<&'static str>,
    /// Constants of the tissues.
    pub materials: TissueTable,
    /// What the arrays are.
    pub arrays: [(&'static str, &'static str); 2],
    /// Checks.
    pub quality: Quality,
    /// Wall seconds of mesh, factor and all solves.
    pub seconds: f64,
}

/// Version of the files.
const FORMAT: u32 = 1;

impl Card {
    /// The card of an operator.
    #[must_use]
    pub fn new(
        operator: &Operator,
        density: Density,
        order: Order,
        materials: &TissueTable,
        seconds: f64,
    ) -> Self {
        Self {
            format: FORMAT,
            software: concat!("fe-datagen ", env!("CARGO_PKG_VERSION")),
            atlas_hash: operator.atlas_hash.clone(),
            vertices: operator.vertices(),
            density,
            order,
            effects: vec!["layers"],
            materials: materials.clone(),
            arrays: [
                (
                    "g",
                    "f32 [V, 6, V], sqrt(J/m3) per Pa: SED of the dermis side at interface vertex v is \
                     sum_k (sum_j g[v, k, j] p_j)^2",
                ),
                ("area_mm2", "f32 [V], undeformed area of each skin vertex"),
            ],
            quality: operator.quality,
            seconds,
        }
    }
}

/// Writes `operator.npz` and then `operator.json` into `folder`, each whole or not at all:
/// where the card is, the arrays are.
///
/// # Errors
/// [`OperatorError::Output`] if the folder is not writable.
pub fn write(folder: &Path, operator: &Operator, card: &Card) -> Result<(), OperatorError> {
    atomic::create_folder(folder)?;
    let v = operator.vertices();
    let mut npz = NpzBuilder::new();
    npz.add_slice("g", &[v, COMPONENTS, v], &operator.g)?;
    let area: Vec<f32> = operator.area_mm2.iter().map(|a| *a as f32).collect();
    npz.add_slice("area_mm2", &[v], &area)?;
    npz.write(&folder.join("operator.npz"))?;
    atomic::write_json(&folder.join("operator.json"), card)?;
    Ok(())
}
