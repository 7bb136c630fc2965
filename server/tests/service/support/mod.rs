//! A service with small models of its own, and clients that can misbehave.

mod binary;
pub(crate) mod contact;
pub(crate) mod flood;
mod http;
mod onnx;
pub(crate) mod raw;
mod socket;

use std::{fs, net::SocketAddr, path::Path};

use papilla_proto::{
    MAP_LEN,
    atlas::{Atlas, Patch, PatchVertices, Raster},
};
use papilla_server::{Config, Server, StartError};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use tempfile::TempDir;

#[cfg(target_os = "linux")]
pub(crate) use binary::program_by;
pub(crate) use binary::{Logged, Running, papilla, signal};
pub(crate) use http::{Answer, Request, raw_exchange};
pub(crate) use socket::{Received, Socket, frame, hello};

/// Greatest pressure the test models take, Pa.
pub(crate) const PRESSURE_MAX_PA: f32 = 10_000.0;

/// Greatest SED the cards of the test models name, J/m3.
pub(crate) const SED_MAX: f32 = 5_000.0;

/// What the test models multiply the pressure by.
pub(crate) const GAIN: f32 = 0.5;

/// A running service of two tiers: `quick` (the default; its card says it errs by 20 %) and
/// `slow` (some hundred milliseconds; 5 %).
pub(crate) struct Service {
    pub(crate) server: Server,
    pub(crate) address: SocketAddr,
    pub(crate) models: TempDir,
}

impl Service {
    /// With one inference thread, so that tests know what waits for what.
    pub(crate) async fn start() -> Self {
        Self::start_with(|_| ()).await
    }

    /// The same, with changes to the configuration.
    pub(crate) async fn start_with(change: impl FnOnce(&mut Config)) -> Self {
        Self::on(model_folder(), change).await.unwrap()
    }

    /// The same, on these models.
    pub(crate) async fn on(
        models: TempDir,
        change: impl FnOnce(&mut Config),
    ) -> Result<Self, StartError> {
        let mut config = Config {
            models: Some(models.path().to_owned()),
            threads: std::num::NonZeroUsize::new(1),
            // Two runs of each tier: enough to tell quick from slow.
            calibration_ms: 1,
            ..Config::default()
        };
        change(&mut config);
        let server = papilla_server::start(&config).await?;
        Ok(Self { address: server.address(), server, models })
    }

    pub(crate) fn get(&self, path: &str) -> Request {
        Request::new(self.address, "GET", path)
    }

    pub(crate) fn post(&self, path: &str, body: impl Into<Vec<u8>>) -> Request {
        Request::new(self.address, "POST", path).body(body)
    }

    pub(crate) async fn json(&self, path: &str) -> Value {
        let answer = self.get(path).send().await;
        assert_eq!(answer.status, 200, "{path}: {}", answer.text());
        answer.json()
    }

    pub(crate) async fn socket(&self) -> Socket {
        Socket::connect(self.address).await.unwrap()
    }

    /// The value of a metric, by its name and labels as they are printed.
    pub(crate) async fn metric(&self, line: &str) -> f64 {
        metric_at(self.address, line).await
    }
}

/// The same, of any service.
pub(crate) async fn metric_at(address: SocketAddr, line: &str) -> f64 {
    let text = Request::new(address, "GET", "/metrics").send().await.text();
    let found = text.lines().find_map(|l| l.strip_prefix(line)?.trim().parse().ok());
    found.unwrap_or_else(|| panic!("no metric {line} in\n{text}"))
}

/// A folder as the service expects it. Dropped, it is deleted.
pub(crate) fn model_folder() -> TempDir {
    model_folder_on(&atlas())
}

/// The same on another atlas.
pub(crate) fn model_folder_on(atlas: &Atlas) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "atlas.json", atlas.to_json().unwrap().as_bytes());
    add_model(folder.path(), "quick", atlas.hash(), 0, 0.2);
    add_model(folder.path(), "slow", atlas.hash(), 8, 0.05);
    let index = json!({"default": "quick", "models": ["quick", "slow"]});
    write(folder.path(), "index.json", index.to_string().as_bytes());
    let values: Vec<f32> = (0..atlas.vertex_count()).map(|i| 100.0 * i as f32).collect();
    // What the test models make of it: their golden answer.
    let sed: Vec<f32> = values.iter().map(|value| GAIN * value).collect();
    let drawn = |patch, values: &[f32]| -> Vec<f32> {
        let raster = Raster::new(atlas, patch);
        raster.pixels().iter().map(|pixel| pixel.value(values)).collect()
    };
    let state = json!({"name": "flat", "pose": {"pitch_deg": 30.0}, "depth_mm": 1.5,
        "pressure_pa": drawn(Patch::Skin, &values), "sed_j_per_m3": drawn(Patch::Interface, &sed)});
    write(folder.path(), "replay.json", json!({"presses": [state]}).to_string().as_bytes());
    folder
}

pub(crate) fn write(folder: &Path, name: &str, bytes: &[u8]) {
    fs::write(folder.join(name), bytes).unwrap();
}

/// Square patches of four triangles around a middle vertex. The skin is all of the map, the
/// interface the pixels from 20 to 200 both ways.
pub(crate) fn atlas() -> Atlas {
    atlas_of_skin(0.0, 224.0)
}

/// The same with a skin from pixel `from` to `to` both ways.
pub(crate) fn atlas_of_skin(from: f32, to: f32) -> Atlas {
    let patch = |z: f32, from: f32, to: f32| {
        let uv_px = vec![[from, from], [to, from], [to, to], [from, to], [110.5, 110.5]];
        let place = |&[u, v]: &[f32; 2]| [0.1 * v, -0.1 * u, z];
        PatchVertices { positions_mm: uv_px.iter().map(place).collect(), uv_px }
    };
    let triangles = vec![[0, 4, 1], [1, 4, 2], [2, 4, 3], [3, 4, 0]];
    Atlas::new(0.1, triangles, patch(-1.0, from, to), patch(-0.5, 20.0, 200.0)).unwrap()
}

/// Writes a model and its card.
pub(crate) fn add_model(folder: &Path, name: &str, atlas_hash: &str, work: usize, error: f64) {
    add_model_of_gain(folder, name, atlas_hash, work, error, GAIN);
}

/// The same, with another factor than [`GAIN`].
pub(crate) fn add_model_of_gain(
    folder: &Path,
    name: &str,
    atlas_hash: &str,
    work: usize,
    error: f64,
    gain: f32,
) {
    let onnx = onnx::model(gain, work, &metadata(name, atlas_hash, work));
    add_file(folder, name, atlas_hash, work, error, &onnx);
}

/// A model that belongs to its card, and that the engine's backend panics over when it reads it.
pub(crate) fn add_model_to_panic_over(folder: &Path, name: &str, atlas_hash: &str) {
    let onnx = onnx::of_one_stride(&metadata(name, atlas_hash, 0));
    add_file(folder, name, atlas_hash, 0, 0.2, &onnx);
}

/// What a model file says of itself.
fn metadata(name: &str, atlas_hash: &str, work: usize) -> [(&'static str, String); 9] {
    let network = json!({"kind": "test", "base": work}).to_string();
    [
        ("papilla.format", "1".to_owned()),
        ("papilla.name", name.to_owned()),
        ("papilla.atlas_hash", atlas_hash.to_owned()),
        ("papilla.effects", json!(["finite_strain", "layers"]).to_string()),
        ("papilla.network", network),
        ("papilla.pressure_max_pa", PRESSURE_MAX_PA.to_string()),
        ("papilla.sed_max_j_per_m3", SED_MAX.to_string()),
        ("papilla.dataset_sha256", "0".repeat(64)),
        ("papilla.training", json!({"seed": 0}).to_string()),
    ]
}

/// Writes the file of a model, and a card that fits.
fn add_file(folder: &Path, name: &str, atlas_hash: &str, work: usize, error: f64, onnx: &[u8]) {
    let spread = |median: f64| json!({"median": median, "p95": 2.0 * median});
    let card = json!({
        "format": 1, "name": name, "onnx_sha256": hex(&Sha256::digest(onnx)), "bytes": onnx.len(),
        "atlas_hash": atlas_hash, "effects": ["finite_strain", "layers"],
        "network": {"kind": "test", "base": work},
        "pressure_range_pa": [0.0, PRESSURE_MAX_PA],
        "pattern_max": {"roughness": 0.4, "load_mpa_px": 1e4}, "sed_max_j_per_m3": SED_MAX,
        "dataset_sha256": "0".repeat(64), "training": {"seed": 0},
        "metrics": {"split": "test", "samples": 1, "relative_l2": spread(error),
            "far_field_relative_l2": spread(error), "peak_error": spread(error),
            "total_energy_error": spread(error), "ssim": {"median": 0.9, "p5": 0.8}},
        "latency_ms": {"backend": "tract", "threads": 1, "p50": 1.0, "p99": 2.0},
        "onnxruntime_difference_max": null
    });
    write(folder, &format!("{name}.onnx"), onnx);
    write(folder, &format!("{name}.json"), card.to_string().as_bytes());
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// A map that differs in every sample, Pa.
pub(crate) fn ramp() -> Vec<f32> {
    (0..MAP_LEN).map(|i| PRESSURE_MAX_PA * i as f32 / (MAP_LEN - 1) as f32).collect()
}

pub(crate) fn bytes_of(map: &[f32]) -> Vec<u8> {
    map.iter().flat_map(|v| v.to_le_bytes()).collect()
}

pub(crate) fn floats_of(bytes: &[u8]) -> Vec<f32> {
    let (chunks, rest) = bytes.as_chunks::<4>();
    assert!(rest.is_empty());
    chunks.iter().map(|chunk| f32::from_le_bytes(*chunk)).collect()
}

/// Asserts that `sed` is what the test models make of `pressure`, within `error` of each sample.
pub(crate) fn assert_rendered(pressure: &[f32], sed: &[f32], error: impl Fn(f32) -> f32) {
    assert_eq!(sed.len(), pressure.len());
    for (i, (p, e)) in pressure.iter().zip(sed).enumerate() {
        let due = GAIN * p;
        assert!((due - e).abs() <= error(due), "sample {i}: {due} became {e}");
    }
}
