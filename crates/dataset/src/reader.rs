//! Opening a dataset, and making sure that it is what it says.

use super::shard::{Shard, raster_npz};
use super::{
    DatasetError, FORMAT, FORMATS, IndentationEntry, Manifest, Split, Splits, dataset_sha256,
    sha256_hex,
};
use ndarray::{Ix1, Ix2};
use papilla_atlas::{Atlas, Patch};
use papilla_output::npz::NpzArrays;
use papilla_output::{OutputError, atomic};
use serde::{Deserialize, Serialize};
use std::path::{Component, Path, PathBuf};

/// What every format's manifest has.
#[derive(Deserialize)]
struct Announced {
    #[serde(default)]
    format: serde_json::Value,
}

/// A dataset on disk; shards are read when asked for.
#[derive(Debug)]
pub struct Dataset {
    folder: PathBuf,
    manifest: Manifest,
    atlas: Atlas,
}

impl Dataset {
    /// Reads manifest and atlas of the dataset in `folder`.
    ///
    /// # Errors
    /// [`DatasetError`] when a file is absent or damaged, of an unknown format,
    /// without any indentation, when hash or splits do not follow from the indentations, or the atlas
    /// is another one than the manifest's.
    pub fn open(folder: &Path) -> Result<Self, DatasetError> {
        let path = folder.join("manifest.json");
        // The format first: another one may have other fields.
        let found = atomic::read_json::<Announced>(&path)?.format.as_u64().unwrap_or(0) as u32;
        if !FORMATS.contains(&found) {
            return Err(DatasetError::Format { path, found, expected: FORMAT });
        }
        let manifest: Manifest = atomic::read_json(&path)?;
        if manifest.presses.is_empty() {
            return Err(DatasetError::Empty { path });
        }
        check_identity(&path, &manifest)?;
        let atlas = read_atlas(&folder.join("atlas.json"), &manifest)?;
        Ok(Self { folder: folder.to_path_buf(), manifest, atlas })
    }

    /// The manifest.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// The atlas.
    pub fn atlas(&self) -> &Atlas {
        &self.atlas
    }

    /// Where it lies.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The indentations of a split, by rising id.
    pub fn of_split(&self, split: Split) -> impl Iterator<Item = &IndentationEntry> {
        self.manifest.presses.iter().filter(move |press| press.split == split)
    }

    /// Where the shard of an indentation lies.
    pub fn shard_path(&self, press: &IndentationEntry) -> PathBuf {
        self.folder.join(&press.file)
    }

    /// Reads the shard of an indentation, checks its hash and that its maps are finite.
    ///
    /// # Errors
    /// [`DatasetError`] when it is absent, altered or damaged.
    pub fn shard(&self, press: &IndentationEntry) -> Result<Shard, DatasetError> {
        let path = self.shard_path(press);
        let bytes = std::fs::read(&path).map_err(OutputError::io("read", &path))?;
        expect(&path, "sha256", sha256_hex(&bytes), &press.sha256)?;
        let shard = Shard::decode(&path, &bytes, self.manifest.vertex_count)?;
        expect(&path, "number of samples", shard.len().to_string(), &press.samples.to_string())?;
        let maps = shard.pressure_pa.iter().chain(&shard.sed_dermis_j_per_m3);
        if let Some(value) = maps.chain(&shard.sed_epidermis_j_per_m3).find(|v| !v.is_finite()) {
            return Err(OutputError::malformed(&path, &format!("a map holds {value}")).into());
        }
        Ok(shard)
    }
}

/// Hash and splits follow from the indentations; shards lie inside the dataset's folder.
fn check_identity(path: &Path, manifest: &Manifest) -> Result<(), DatasetError> {
    let refused = |message: String| Err(OutputError::malformed(path, &message).into());
    let presses = &manifest.presses;
    // A manifest must not make a program read files elsewhere.
    let inside =
        |file: &str| Path::new(file).components().all(|c| matches!(c, Component::Normal(_)));
    if let Some(press) = presses.iter().find(|p| !inside(&p.file)) {
        return refused(format!("it names a file outside the dataset: {}", press.file));
    }
    if let Some(pair) = presses.windows(2).find(|pair| pair[0].id >= pair[1].id) {
        return refused(format!("indentation {} is listed after {}", pair[1].id, pair[0].id));
    }
    let of = |split| presses.iter().filter(|p| p.split == split).map(|p| p.id).collect();
    let splits = Splits { train: of(Split::Train), test: of(Split::Test) };
    expect(path, "list of splits", format!("{splits:?}"), &format!("{:?}", manifest.splits))?;
    let hash = dataset_sha256(presses.iter().map(|p| p.sha256.as_str()));
    expect(path, "dataset_sha256", hash, &manifest.dataset_sha256)
}

fn read_atlas(path: &Path, manifest: &Manifest) -> Result<Atlas, DatasetError> {
    let text = papilla_json::read_text(path).map_err(OutputError::io("read", path))?;
    let atlas_error = |source| DatasetError::Atlas { path: path.to_path_buf(), source };
    let atlas = Atlas::from_json(&text).map_err(atlas_error)?;
    atlas.require_hash(&manifest.atlas_hash).map_err(atlas_error)?;
    let count = atlas.vertex_count().to_string();
    expect(path, "vertex count", count, &manifest.vertex_count.to_string())?;
    Ok(atlas)
}

fn expect(
    path: &Path,
    what: &'static str,
    found: String,
    expected: &str,
) -> Result<(), DatasetError> {
    if found == expected {
        return Ok(());
    }
    Err(DatasetError::Mismatch { path: path.into(), what, found, expected: expected.into() })
}

/// What [`verify`] looked at.
#[derive(Clone, Debug, Serialize)]
pub struct VerifyReport {
    /// Shards whose hash, shapes and values were checked.
    pub shards: usize,
    /// Samples in them.
    pub samples: usize,
    /// Hash of the atlas.
    pub atlas_hash: String,
    /// Hash of the whole dataset.
    pub dataset_sha256: String,
}

/// Checks every hash of the dataset in `folder`, that all values are finite and not negative, that
/// no value exceeds the manifest's maxima and that `raster.npz` belongs to the atlas.
///
/// # Errors
/// The first thing that is wrong, with the file it was found in.
pub fn verify(folder: &Path) -> Result<VerifyReport, DatasetError> {
    let dataset = Dataset::open(folder)?;
    let manifest = &dataset.manifest;
    let mut samples = 0;
    for press in &manifest.presses {
        let shard = dataset.shard(press)?;
        verify_values(&dataset.shard_path(press), manifest, &shard)?;
        samples += shard.len();
    }
    verify_raster(&folder.join("raster.npz"), &dataset.atlas)?;
    Ok(VerifyReport {
        shards: manifest.presses.len(),
        samples,
        atlas_hash: manifest.atlas_hash.clone(),
        dataset_sha256: manifest.dataset_sha256.clone(),
    })
}

fn verify_values(path: &Path, manifest: &Manifest, shard: &Shard) -> Result<(), DatasetError> {
    let fields = [
        ("pressure_pa", &shard.pressure_pa, manifest.pressure_max_pa),
        ("sed_dermis_j_per_m3", &shard.sed_dermis_j_per_m3, manifest.sed_max_j_per_m3),
        ("sed_epidermis_j_per_m3", &shard.sed_epidermis_j_per_m3, f64::MAX),
    ];
    for (name, values, max) in fields {
        let bad = values.iter().find(|v| !(**v >= 0.0 && f64::from(**v) <= max));
        if let Some(value) = bad {
            let message = format!("{name} holds {value}, outside 0 to {max}");
            return Err(OutputError::malformed(path, &message).into());
        }
    }
    let further = shard.shear_pa.iter().flatten().chain(shard.slide_mm.iter().flatten());
    let further = further.chain(shard.outside_calibration.iter().flatten());
    if let Some(value) = further.into_iter().find(|v| !v.is_finite()) {
        let message = format!("shear_pa, slide_mm or outside_calibration holds {value}");
        return Err(OutputError::malformed(path, &message).into());
    }
    Ok(())
}

fn verify_raster(path: &Path, atlas: &Atlas) -> Result<(), DatasetError> {
    let stored = std::fs::read(path).map_err(OutputError::io("read", path))?;
    let fresh = raster_npz(atlas, None)?;
    let (mut a, mut b) = (NpzArrays::new(path, &stored)?, NpzArrays::new(path, &fresh)?);
    for patch in Patch::ALL.map(Patch::name) {
        let (pixel, vertex, weight) =
            (format!("{patch}_pixel"), format!("{patch}_vertex"), format!("{patch}_weight"));
        // Arrays, not bytes: another deflate is no other raster.
        let same = a.get::<u32, Ix1>(&pixel)? == b.get::<u32, Ix1>(&pixel)?
            && a.get::<u32, Ix2>(&vertex)? == b.get::<u32, Ix2>(&vertex)?
            && a.get::<f32, Ix2>(&weight)? == b.get::<f32, Ix2>(&weight)?;
        let found = if same { "of this atlas" } else { "of another atlas" };
        expect(path, "raster", found.into(), "of this atlas")?;
    }
    Ok(())
}
