//! A model and data whose every figure is known in closed form: the truth is the model's own
//! answer times 0.8.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]
#![allow(dead_code, reason = "each test program uses a part")]

use ndarray::{Array1, Array2, Array3, Axis, s};
use ndarray_npy::{NpzReader, NpzWriter};
use papilla_engine::{Card, MAP_LEN, MAP_SIDE_PX, load};
use papilla_proto::atlas::{Atlas, PatchVertices};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

pub(crate) const TINY: &[u8] = include_bytes!("../../../crates/engine/tests/assets/tiny.onnx");
/// The patch: one vertex on the centre of each pixel of these rows and columns.
pub(crate) const FIRST: [usize; 2] = [80, 90];
pub(crate) const SIDE: usize = 60;
pub(crate) const DEPTHS: [f32; 3] = [0.5, 1.0, 1.5];

pub(crate) struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    /// A model, a dataset of two indentations (one held out) and a recorded reference.
    pub(crate) fn new() -> Self {
        let bench = Self { folder: tempfile::tempdir().unwrap() };
        let atlas = atlas();
        let onnx = replaced(TINY, &"ab".repeat(32), atlas.hash());
        let shards = [0.9f32, 1.0].map(|force| shard(&onnx, force));
        let hashes: Vec<String> = shards.iter().map(|bytes| sha256_hex(bytes)).collect();
        let dataset = sha256_hex(hashes.concat().as_bytes());
        let onnx = replaced(&onnx, &"cd".repeat(32), &dataset);
        fs::create_dir_all(bench.path("data/shards")).unwrap();
        fs::create_dir_all(bench.path("models")).unwrap();
        fs::write(bench.path("models/tiny.onnx"), &onnx).unwrap();
        for folder in ["data", "models"] {
            let path = bench.path(folder).join("atlas.json");
            fs::write(path, atlas.to_json().unwrap()).unwrap();
        }
        for (id, bytes) in shards.iter().enumerate() {
            fs::write(bench.path("data/shards").join(format!("{id}.npz")), bytes).unwrap();
        }
        let indentations: Vec<Value> = (0..2)
            .map(|id| {
                json!({"id": id, "file": format!("shards/{id}.npz"), "sha256": hashes[id],
                    "split": if id == 0 {"train"} else {"test"}, "samples": DEPTHS.len(),
                    "pitch_deg": 10.0, "roll_deg": -5.0, "yaw_deg": 0.0, "checks": {}})
            })
            .collect();
        let manifest = json!({"format": 1, "atlas_hash": atlas.hash(), "effects": ["layers"],
            "vertex_count": SIDE * SIDE, "pressure_max_pa": 4e4, "sed_max_j_per_m3": 2500.0,
            "presses": indentations, "splits": {"train": [0], "test": [1]}, "dataset_sha256": dataset});
        fs::write(bench.path("data/manifest.json"), manifest.to_string()).unwrap();
        bench.write_reference(&onnx, 1.0);
        bench
    }

    /// What another engine would have recorded, were its answers `scale` times ours.
    pub(crate) fn write_reference(&self, onnx: &[u8], scale: f32) {
        let pressure: Vec<f32> = contact(1.0);
        let sed: Vec<f32> = infer(onnx, &pressure).iter().map(|v| scale * v).collect();
        let maps = [pressure, sed]
            .map(|m| Array3::from_shape_vec((1, MAP_SIDE_PX, MAP_SIDE_PX), m).unwrap());
        let mut npz = NpzWriter::new(Cursor::new(Vec::new()));
        npz.add_array("pressure_pa", &maps[0]).unwrap();
        npz.add_array("sed_j_per_m3", &maps[1]).unwrap();
        fs::write(self.path("reference.npz"), npz.finish().unwrap().into_inner()).unwrap();
    }

    /// Copies a dataset.
    pub(crate) fn copy(&self, from: &str, to: &str) {
        fs::create_dir_all(self.path(to).join("shards")).unwrap();
        for file in ["manifest.json", "atlas.json", "shards/0.npz", "shards/1.npz"] {
            fs::copy(self.path(from).join(file), self.path(to).join(file)).unwrap();
        }
    }

    /// As if this density and order had been solved and found this many times the SED.
    pub(crate) fn resolve(&self, folder: &str, [density, order]: [&str; 2], scale: f32) {
        self.rewrite(folder, DEPTHS.len(), scale);
        let path = self.path(folder).join("manifest.json");
        let mut manifest: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        manifest["campaign"] = json!({"name": "final", "density": density, "order": order});
        fs::write(path, manifest.to_string()).unwrap();
    }

    /// As if no press had reached its deepest state.
    pub(crate) fn drop_last_depth(&self, folder: &str) {
        self.rewrite(folder, DEPTHS.len() - 1, 1.0);
    }

    /// The first `depths` of each indentation, SED times `scale`, and the hashes that follow.
    fn rewrite(&self, folder: &str, depths: usize, scale: f32) {
        let path = self.path(folder).join("manifest.json");
        let mut manifest: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        let mut hashes = String::new();
        for id in 0..2 {
            let file = self.path(folder).join(format!("shards/{id}.npz"));
            let mut npz = NpzReader::new(Cursor::new(fs::read(&file).unwrap())).unwrap();
            let pressure: Array2<f32> = npz.by_name("pressure_pa.npy").unwrap();
            let sed: Array2<f32> = npz.by_name("sed_dermis_j_per_m3.npy").unwrap();
            let first = s![..depths, ..];
            let mut npz = NpzWriter::new_compressed(Cursor::new(Vec::new()));
            npz.add_array("pressure_pa", &pressure.slice(first)).unwrap();
            npz.add_array("sed_dermis_j_per_m3", &(scale * &sed.slice(first))).unwrap();
            npz.add_array("depth_mm", &Array1::from(DEPTHS[..depths].to_vec())).unwrap();
            let bytes = npz.finish().unwrap().into_inner();
            let hash = sha256_hex(&bytes);
            fs::write(file, bytes).unwrap();
            manifest["presses"][id]["sha256"] = json!(hash);
            manifest["presses"][id]["samples"] = json!(depths);
            hashes += &hash;
        }
        manifest["dataset_sha256"] = json!(sha256_hex(hashes.as_bytes()));
        fs::write(path, manifest.to_string()).unwrap();
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn run(&self, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_model-export"))
            .args(arguments)
            .current_dir(self.folder.path())
            .output()
            .unwrap()
    }

    /// Runs, expects success, gives stdout.
    pub(crate) fn done(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {stderr}");
        String::from_utf8(output.stdout).unwrap()
    }

    /// Runs, expects this exit status, gives stderr.
    pub(crate) fn refused(&self, status: i32, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(status), "{arguments:?}: {stderr}");
        stderr
    }
}

pub(crate) fn atlas() -> Atlas {
    let mut patch = PatchVertices::default();
    let mut triangles = Vec::new();
    for i in 0..SIDE * SIDE {
        let (row, column) = (i / SIDE, i % SIDE);
        let (u, v) = ((FIRST[1] + column) as f32 + 0.5, (FIRST[0] + row) as f32 + 0.5);
        patch.uv_px.push([u, v]);
        patch.positions_mm.push([0.1 * v, -0.1 * u, -6.0]);
        if row + 1 < SIDE && column + 1 < SIDE {
            let [a, b, c, d] = [i, i + SIDE, i + 1, i + SIDE + 1].map(|i| i as u32);
            triangles.extend([[a, b, c], [c, b, d]]);
        }
    }
    Atlas::new(0.1, triangles, patch.clone(), patch).unwrap()
}

/// Pixels of the patch, in the order of the vertices.
pub(crate) fn pixels() -> impl Iterator<Item = usize> {
    (0..SIDE * SIDE).map(|i| (FIRST[0] + i / SIDE) * MAP_SIDE_PX + FIRST[1] + i % SIDE)
}

/// A paraboloid on the patch, zero outside it.
pub(crate) fn contact(force: f32) -> Vec<f32> {
    let mut map = vec![0.0; MAP_LEN];
    for i in pixels() {
        let (row, column) = ((i / MAP_SIDE_PX) as f32, (i % MAP_SIDE_PX) as f32);
        let r2 = ((row - 110.0) / 28.0).powi(2) + ((column - 120.0) / 25.0).powi(2);
        map[i] = 25_000.0 * force * (1.0 - r2).max(0.0);
    }
    map
}

pub(crate) fn infer(onnx: &[u8], pressure_pa: &[f32]) -> Vec<f32> {
    let mut sed = vec![0.0; MAP_LEN];
    load(onnx, None).unwrap().session().unwrap().infer(pressure_pa, &mut sed).unwrap();
    sed
}

pub(crate) fn shard(onnx: &[u8], force: f32) -> Vec<u8> {
    let (d, v) = (DEPTHS.len(), SIDE * SIDE);
    let [mut pressure, mut sed] = [0, 1].map(|_| Array2::<f32>::zeros((d, v)));
    for (k, depth) in DEPTHS.iter().enumerate() {
        let map = contact(force * depth);
        let answer = infer(onnx, &map);
        for (vertex, pixel) in pixels().enumerate() {
            pressure[[k, vertex]] = map[pixel];
            sed[[k, vertex]] = 0.8 * answer[pixel];
        }
    }
    assert!(sed.lanes(Axis(1)).into_iter().all(|row| row.iter().any(|v| *v > 1.0)));
    let mut npz = NpzWriter::new_compressed(Cursor::new(Vec::new()));
    npz.add_array("pressure_pa", &pressure).unwrap();
    npz.add_array("sed_dermis_j_per_m3", &sed).unwrap();
    npz.add_array("depth_mm", &Array1::from(DEPTHS.to_vec())).unwrap();
    npz.finish().unwrap().into_inner()
}

pub(crate) fn sha256_hex(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The file with one text in it replaced by another of the same length.
pub(crate) fn replaced(bytes: &[u8], old: &str, new: &str) -> Vec<u8> {
    assert_eq!(old.len(), new.len());
    let at = bytes.windows(old.len()).position(|window| window == old.as_bytes()).unwrap();
    let mut bytes = bytes.to_vec();
    bytes[at..at + new.len()].copy_from_slice(new.as_bytes());
    bytes
}

pub(crate) fn read_card(path: &Path) -> Card {
    Card::from_json(&fs::read_to_string(path).unwrap()).unwrap()
}
