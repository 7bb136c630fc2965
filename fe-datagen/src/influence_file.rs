//! Writes the influence operator: `operator.npz` and `operator.json`.

use papilla_fingertip::influence::{COMPONENTS, InfluenceOperator, Quality};
use papilla_fingertip::mesh::fingertip::{Density, Order};
use papilla_fingertip::scene::TissueTable;
use papilla_output::npz::NpzBuilder;
use papilla_output::{OutputError, atomic};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// `operator.json`: what `operator.npz` is the influence operator of.
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
    pub arrays: BTreeMap<&'static str, &'static str>,
    /// Checks.
    pub quality: Quality,
    /// Processor seconds of mesh, factor and all solves.
    pub seconds: f64,
}

/// Version of the files.
const FORMAT: u32 = 1;

/// What the arrays are.
const ARRAYS: [(&str, &str); 5] = [
    (
        "g",
        "f32 [V, 6, V], sqrt(J/m3) per Pa: SED of the dermis side at interface vertex v is \
         sum_k (sum_j g[v, k, j] p_j)^2",
    ),
    ("area_mm2", "f32 [V], undeformed area of each skin vertex"),
    (
        "face_g",
        "f32 [F, 6, V], sqrt(J/m3) per Pa: SED of face f is sum_k (sum_j face_g[f, k, j] p_j)^2",
    ),
    (
        "vertex_face",
        "i32 [V, M]: SED as an indentation records it is sum_m vertex_weight[v, m] SED[vertex_face[v, m]]",
    ),
    ("vertex_weight", "f32 [V, M], summing to 1; 0 where a vertex has fewer than M faces"),
];

impl Card {
    /// The card of an influence operator.
    #[must_use]
    pub fn new(
        operator: &InfluenceOperator,
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
            arrays: ARRAYS.into(),
            quality: operator.quality,
            seconds,
        }
    }
}

/// Writes `operator.npz` and then `operator.json` into `folder`, each whole or not at all:
/// where the card is, the arrays are.
///
/// # Errors
/// [`OutputError`] if the folder is not writable.
pub fn write(folder: &Path, operator: &InfluenceOperator, card: &Card) -> Result<(), OutputError> {
    atomic::create_folder(folder)?;
    let v = operator.vertices();
    let mut npz = NpzBuilder::new();
    npz.add_slice("g", &[v, COMPONENTS, v], &operator.g)?;
    let area: Vec<f32> = operator.area_mm2.iter().map(|a| *a as f32).collect();
    npz.add_slice("area_mm2", &[v], &area)?;
    let rows = &operator.faces.of_vertex;
    let most = rows.iter().map(Vec::len).max().unwrap_or(0);
    let padded = |m: usize, row: &Vec<(usize, f64)>| row.get(m).copied().unwrap_or((0, 0.0));
    let terms: Vec<(usize, f64)> =
        rows.iter().flat_map(|row| (0..most).map(move |m| padded(m, row))).collect();
    let faces: Vec<i32> = terms.iter().map(|t| t.0 as i32).collect();
    let weights: Vec<f32> = terms.iter().map(|t| t.1 as f32).collect();
    let count = operator.faces.g.len() / (COMPONENTS * v);
    npz.add_slice("face_g", &[count, COMPONENTS, v], &operator.faces.g)?;
    npz.add_slice("vertex_face", &[v, most], &faces)?;
    npz.add_slice("vertex_weight", &[v, most], &weights)?;
    npz.write(&folder.join("operator.npz"))?;
    atomic::write_json(&folder.join("operator.json"), card)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use papilla_fingertip::geometry::fingertip::FingertipShape;
    use papilla_fingertip::influence::{body, build};
    use papilla_output::npz::NpzArrays;

    #[test]
    fn files_hold_what_the_contract_says() {
        let body = body(
            &FingertipShape::default(),
            Density::Coarse,
            Order::Linear,
            &TissueTable::default(),
        )
        .unwrap();
        let operator = &build(&body, &mut |_| ()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let materials = TissueTable::default();
        let card = Card::new(operator, Density::Coarse, Order::Linear, &materials, 1.5);
        write(folder.path(), operator, &card).unwrap();
        let path = folder.path().join("operator.npz");
        let bytes = std::fs::read(&path).unwrap();
        let mut npz = NpzArrays::new(&path, &bytes).unwrap();
        let v = operator.vertices();
        let g = npz.get::<f32, ndarray::Ix3>("g").unwrap();
        assert_eq!(g.dim(), (v, COMPONENTS, v));
        assert_eq!(g[[3, 2, 5]].to_bits(), operator.g[(3 * COMPONENTS + 2) * v + 5].to_bits());
        assert_eq!(npz.get::<f32, ndarray::Ix1>("area_mm2").unwrap().len(), v);
        let faces = npz.get::<f32, ndarray::Ix3>("face_g").unwrap().dim().0;
        let weights = npz.get::<f32, ndarray::Ix2>("vertex_weight").unwrap();
        assert!(weights.rows().into_iter().all(|row| (row.sum() - 1.0).abs() < 1e-6));
        let vertex_face = npz.get::<i32, ndarray::Ix2>("vertex_face").unwrap();
        assert!(vertex_face.iter().all(|f| (*f as usize) < faces));
        let text = std::fs::read_to_string(folder.path().join("operator.json")).unwrap();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(json["atlas_hash"], operator.atlas_hash.as_str());
        assert_eq!(json["effects"], serde_json::json!(["layers"]));
        assert_eq!(json["density"], "coarse");
        assert!(json["materials"]["dermis"]["youngs_modulus_mpa"].is_number());
    }
}
