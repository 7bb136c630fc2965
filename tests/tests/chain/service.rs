//! A running service, and the library's own answer beside it.

use std::{fs, path::Path, sync::Arc};

use papilla_engine::{
    Card, Model,
    card::{Index, Latency, Metrics, Similarity, Spread},
};
use papilla_proto::{
    MAP_LEN,
    atlas::{Atlas, Patch, Raster},
};
use papilla_server::{Config, Server};
use papilla_tests::http::{Request, Response};
use serde_json::json;
use tempfile::TempDir;

use crate::shipped::{folder, text};

/// Samples of indentations: vertex values of pressure and FE truth.
pub(crate) struct Sample {
    pub(crate) pressure_pa: Vec<f32>,
    pub(crate) sed_j_per_m3: Vec<f32>,
    pub(crate) depth_mm: f32,
}

/// A service and what its answers are held against.
pub(crate) struct Service {
    _server: Server,
    /// Host and port.
    pub(crate) address: String,
    pub(crate) atlas: Atlas,
    pub(crate) skin: Raster,
    pub(crate) interface: Raster,
    /// The models as the library loads them, the default first.
    pub(crate) models: Vec<Arc<dyn Model>>,
    pub(crate) cards: Vec<Card>,
}

impl Service {
    /// The service as it ships: on the models in its binary.
    pub(crate) async fn shipped() -> Self {
        Self::start(&quickly(), &folder("models")).await
    }

    /// A service on the models in `models`.
    pub(crate) async fn on(models: &Path) -> Self {
        Self::start(&Config { models: Some(models.to_owned()), ..quickly() }, models).await
    }

    async fn start(config: &Config, models: &Path) -> Self {
        let index = Index::from_json(&text(&models.join("index.json"))).unwrap();
        let atlas = Atlas::from_json(&text(&models.join("atlas.json"))).unwrap();
        let (mut names, default) = (index.models, index.default);
        names.sort_by_key(|name| *name != default);
        let card = |name: &String| Card::from_json(&text(&models.join(format!("{name}.json"))));
        let cards: Vec<Card> = names.iter().map(|name| card(name).unwrap()).collect();
        let load = |card: &Card| {
            let onnx = fs::read(models.join(format!("{}.onnx", card.name))).unwrap();
            papilla_engine::load(&onnx, Some(card)).unwrap()
        };
        let library = cards.iter().map(load).collect();
        let server = papilla_server::start(config).await.unwrap();
        let mut served = server.tiers().to_vec();
        served.sort_by_key(|name| *name != default);
        assert_eq!((server.default_tier(), served), (default.as_str(), names));
        let [skin, interface] = Patch::ALL.map(|patch| Raster::new(&atlas, patch));
        let address = server.address().to_string();
        Self { _server: server, address, atlas, skin, interface, models: library, cards }
    }

    pub(crate) async fn send(&self, request: Request) -> Response {
        request.send(&self.address).await.unwrap()
    }

    /// The pressure map of a sample, Pa.
    pub(crate) fn pressure_map(&self, sample: &Sample) -> Vec<f32> {
        drawn(&self.skin, &sample.pressure_pa)
    }
}

/// The defaults, with a calibration of two runs a tier.
fn quickly() -> Config {
    Config { calibration_ms: 1, ..Config::default() }
}

fn drawn(raster: &Raster, vertex_values: &[f32]) -> Vec<f32> {
    let mut map = vec![0.0; MAP_LEN];
    raster.rasterise(vertex_values, &mut map).unwrap();
    map
}

/// The library's own answer.
pub(crate) fn infer(model: &dyn Model, pressure_pa: &[f32]) -> Vec<f32> {
    let mut sed_j_per_m3 = vec![0.0; MAP_LEN];
    model.session().unwrap().infer(pressure_pa, &mut sed_j_per_m3).unwrap();
    sed_j_per_m3
}

/// A model folder with the engine's small test network, made to belong to `atlas`; its only
/// indentation is `sample`.
pub(crate) fn tiny_models(atlas: &Atlas, sample: &Sample) -> TempDir {
    let tiny = fs::read(folder("crates/engine/tests/assets").join("tiny.onnx")).unwrap();
    // Same length, so that no length in the file changes.
    let onnx = replaced(&tiny, "ab".repeat(32).as_bytes(), atlas.hash().as_bytes());
    model_folder(atlas, sample, &onnx)
}

pub(crate) fn model_folder(atlas: &Atlas, sample: &Sample, onnx: &[u8]) -> TempDir {
    let models = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| fs::write(models.path().join(name), bytes).unwrap();
    write("atlas.json", atlas.to_json().unwrap().as_bytes());
    write("index.json", br#"{"default": "tiny", "models": ["tiny"]}"#);
    write("tiny.onnx", onnx);
    write("tiny.json", card_of(onnx).to_json().unwrap().as_bytes());
    let at_pixels = |patch, values: &[f32]| -> Vec<f32> {
        Raster::new(atlas, patch).pixels().iter().map(|pixel| pixel.value(values)).collect()
    };
    let state = json!({"name": "coarse", "depth_mm": sample.depth_mm,
        "pressure_pa": at_pixels(Patch::Skin, &sample.pressure_pa),
        "sed_j_per_m3": at_pixels(Patch::Interface, &sample.sed_j_per_m3)});
    write("replay.json", json!({"presses": [state]}).to_string().as_bytes());
    models
}

/// Every occurrence of `from` replaced by the equally long `to`; there is one at least.
pub(crate) fn replaced(bytes: &[u8], from: &[u8], to: &[u8]) -> Vec<u8> {
    assert_eq!(from.len(), to.len());
    let mut bytes = bytes.to_vec();
    let places: Vec<usize> =
        (0..=bytes.len() - from.len()).filter(|&i| bytes[i..].starts_with(from)).collect();
    assert!(!places.is_empty(), "the test network has changed: {from:02x?} is not in it");
    for place in places {
        bytes[place..place + to.len()].copy_from_slice(to);
    }
    bytes
}

/// A card for a network that nobody measured: it owns up to the worst.
fn card_of(onnx: &[u8]) -> Card {
    let model = papilla_engine::load(onnx, None).unwrap();
    let info = model.info();
    let worst = Spread { median: 1.0, p95: 1.0 };
    let metrics = Metrics {
        dataset_sha256: None,
        split: "none".to_owned(),
        samples: 0,
        relative_l2: worst,
        far_field_relative_l2: None,
        peak_error: worst,
        peak_distance_mm: None,
        nail_base_error: None,
        total_energy_error: worst,
        ssim: Similarity { median: 0.0, p5: 0.0 },
    };
    let latency_ms = Latency { backend: info.backend.clone(), threads: 1, p50: 1.0, p99: 1.0 };
    Card::of(info, metrics, latency_ms)
}
