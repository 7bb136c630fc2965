//! Catalogues for tests, of tiers without files.

use std::sync::{Arc, atomic::AtomicUsize};

use papilla_engine::{Backend, EngineError, Model, ModelInfo, Session, card::Learnt, ladder::Kind};
use papilla_proto::atlas::{Atlas, PatchVertices};
use serde_json::json;

use super::{Catalogue, Held, Tier};
use crate::core::latency::Latency;

/// Facts of a model called `name`.
pub(crate) fn info(name: &str) -> ModelInfo {
    ModelInfo {
        name: name.to_owned(),
        onnx_sha256: String::new(),
        bytes: 0,
        weights: 0,
        atlas_hash: String::new(),
        effects: Vec::new(),
        network: json!({}),
        pressure_max_pa: 100.0,
        sed_max_j_per_m3: 100.0,
        dataset_sha256: String::new(),
        training: json!({}),
        backend: "test".to_owned(),
    }
}

/// Answers the pressure, times a factor.
struct Times(ModelInfo, Backend, f32);

impl Model for Times {
    fn info(&self) -> &ModelInfo {
        &self.0
    }

    fn backend(&self) -> Backend {
        self.1
    }

    fn session(&self) -> Result<Box<dyn Session>, EngineError> {
        Ok(Box::new(Self(self.0.clone(), self.1, self.2)))
    }
}

impl Session for Times {
    fn infer(&mut self, pressure_pa: &[f32], sed: &mut [f32]) -> Result<(), EngineError> {
        sed.iter_mut().zip(pressure_pa).for_each(|(sed, pressure)| *sed = self.2 * pressure);
        Ok(())
    }
}

/// A model that answers the pressure, times a factor.
pub(crate) fn model(name: &str, backend: Backend, factor: f32) -> Arc<dyn Model> {
    Arc::new(Times(info(name), backend, factor))
}

/// A tier with this median error.
pub(crate) fn tier(model: Arc<dyn Model>, relative_l2_median: f64) -> Tier {
    Tier {
        name: model.info().name.clone(),
        backend_expected: model.backend(),
        held: Held::loaded(model),
        on_demand: false,
        onnx_sha256: String::new(),
        card: json!({}),
        effects: Vec::new(),
        atlas_hash: String::new(),
        finger_sha256: None,
        pressure_max_pa: 100.0,
        input_statistics_max: None,
        response_max_per_mpa: None,
        sed_max_j_per_m3: 100.0,
        kind: Kind::Network,
        relative_l2_median,
        relative_l2_median_from_poses: None,
        relative_l2_p95: 0.0,
        learnt: Learnt::Both,
        trained_on: None,
        named_only: None,
        latency: Arc::new(Latency::default()),
        sessions: Arc::new(AtomicUsize::new(0)),
        retired: false,
    }
}

/// These tiers on an atlas whose skin is all of the map.
pub(crate) fn catalogue(tiers: Vec<Tier>) -> Catalogue {
    let patch = PatchVertices {
        positions_mm: vec![[0.0; 3], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 0.0]],
        uv_px: vec![[0.0, 0.0], [0.0, 224.0], [224.0, 224.0], [224.0, 0.0]],
    };
    let atlas = Atlas::new(0.1, vec![[0, 1, 2], [0, 2, 3]], patch.clone(), patch).unwrap();
    Catalogue::bare(atlas, tiers)
}
