//! A model and data whose every figure is known in closed form: the truth is the model's own
//! answer times 0.8.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]
#![allow(dead_code, reason = "each test program uses a part")]

use ndarray::{Array1, Array2, Array3, Axis, s};
use ndarray_npy::NpzWriter;
use papilla_dataset::testing::{entry, manifest};
use papilla_dataset::{CHECK_COLUMNS, Manifest, Shard, Split};
use papilla_engine::{Card, MAP_LEN, MAP_SIDE_PX, load};
use papilla_proto::atlas::{Atlas, PatchVertices};
use serde_json::json;
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

pub(crate) const TINY: &[u8] = include_bytes!("../../../crates/engine/tests/assets/tiny.onnx");
/// The patch: one vertex on the centre of each pixel of these rows and columns.
pub(crate) const FIRST: [usize; 2] = [80, 90];
pub(crate) const SIDE: usize = 60;
pub(crate) const FILES: [&str; 2] = ["shards/press-00000.npz", "shards/press-00001.npz"];
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
        let presses = [Split::Train, Split::Test].into_iter().zip(&shards).enumerate();
        let presses =
            presses.map(|(id, (split, bytes))| entry(id, split, DEPTHS.len(), bytes)).collect();
        let manifest = manifest(&atlas, presses, [4e4, 2500.0]);
        let onnx = replaced(&onnx, &"cd".repeat(32), &manifest.dataset_sha256);
        fs::create_dir_all(bench.path("data/shards")).unwrap();
        fs::create_dir_all(bench.path("models")).unwrap();
        fs::write(bench.path("models/tiny.onnx"), &onnx).unwrap();
        for folder in ["data", "models"] {
            let path = bench.path(folder).join("atlas.json");
            fs::write(path, atlas.to_json().unwrap()).unwrap();
        }
        for (press, bytes) in manifest.presses.iter().zip(&shards) {
            fs::write(bench.path("data").join(&press.file), bytes).unwrap();
        }
        bench.write_manifest("data", &manifest);
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
        for file in ["manifest.json", "atlas.json", FILES[0], FILES[1]] {
            fs::copy(self.path(from).join(file), self.path(to).join(file)).unwrap();
        }
    }

    /// As if this density and order had been solved and found this many times the SED.
    pub(crate) fn resolve(&self, folder: &str, [density, order]: [&str; 2], scale: f32) {
        self.rewrite(folder, DEPTHS.len(), scale);
        let mut manifest = self.manifest(folder);
        manifest.campaign = json!({"name": "final", "density": density, "order": order});
        self.write_manifest(folder, &manifest);
    }

    /// As if no press had reached its deepest state.
    pub(crate) fn drop_last_depth(&self, folder: &str) {
        self.rewrite(folder, DEPTHS.len() - 1, 1.0);
    }

    /// The first `depths` of each indentation, SED times `scale`, and the hashes that follow.
    fn rewrite(&self, folder: &str, depths: usize, scale: f32) {
        let mut old = self.manifest(folder);
        for press in &mut old.presses {
            let file = self.path(folder).join(&press.file);
            let bytes = fs::read(&file).unwrap();
            let shard = Shard::decode(&file, &bytes, SIDE * SIDE).unwrap();
            let first = s![..depths, ..];
            let sed = scale * &shard.sed_dermis_j_per_m3.slice(first);
            let bytes = archive(&shard.pressure_pa.slice(first).to_owned(), &sed);
            *press = entry(press.id, press.split, depths, &bytes);
            fs::write(file, bytes).unwrap();
        }
        let manifest = manifest(&atlas(), old.presses, [4e4, 2500.0]);
        self.write_manifest(folder, &Manifest { campaign: old.campaign, ..manifest });
    }

    fn manifest(&self, folder: &str) -> Manifest {
        serde_json::from_slice(&fs::read(self.path(folder).join("manifest.json")).unwrap()).unwrap()
    }

    fn write_manifest(&self, folder: &str, manifest: &Manifest) {
        let path = self.path(folder).join("manifest.json");
        fs::write(path, serde_json::to_string(manifest).unwrap()).unwrap();
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
    archive(&pressure, &sed)
}

/// A shard of the first depths. In full precision, which no shard of a campaign has.
fn archive(pressure_pa: &Array2<f32>, sed_j_per_m3: &Array2<f32>) -> Vec<u8> {
    let d = pressure_pa.nrows();
    let mut npz = NpzWriter::new_compressed(Cursor::new(Vec::new()));
    npz.add_array("pressure_pa", pressure_pa).unwrap();
    npz.add_array("sed_dermis_j_per_m3", sed_j_per_m3).unwrap();
    npz.add_array("sed_epidermis_j_per_m3", sed_j_per_m3).unwrap();
    npz.add_array("depth_mm", &Array1::from(DEPTHS[..d].to_vec())).unwrap();
    npz.add_array("force_n", &Array2::<f32>::zeros((d, 3))).unwrap();
    npz.add_array("checks", &Array2::<f64>::zeros((d, CHECK_COLUMNS.len()))).unwrap();
    npz.finish().unwrap().into_inner()
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
