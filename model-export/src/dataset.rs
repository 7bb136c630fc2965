//! Reads a dataset: `manifest.json`, `atlas.json` and one `.npz` shard per indentation.
//!
//! Shards hold values at the atlas's vertices or at the nodes of cells; maps are drawn from them
//! here.

use crate::metrics::Ground;
use crate::{ExportError, read, read_text};
use ndarray::{Array1, Array2, Array3, Ix2, OwnedRepr};
use ndarray_npy::{NpzReader, ReadNpzError, ReadableElement};
use papilla_dataset::{Cells, Maps};
use papilla_proto::{
    atlas::{Atlas, Patch},
    sdf::IndenterSpec,
};
use serde::Deserialize;
use sha2::{Digest, Sha256};
use std::io::Cursor;
use std::ops::RangeInclusive;
use std::path::{Component, Path, PathBuf};

/// Version of the manifest that is read here.
const FORMATS: RangeInclusive<u32> = papilla_dataset::FORMATS;

#[derive(Debug, Deserialize)]
struct Manifest {
    format: u32,
    atlas_hash: String,
    effects: Vec<String>,
    #[serde(default)]
    campaign: Campaign,
    vertex_count: usize,
    #[serde(rename = "presses")]
    indentations: Vec<Indentation>,
    splits: Splits,
    dataset_sha256: String,
}

/// What a campaign says of its indenters.
#[derive(Debug, Default, Deserialize)]
struct Campaign {
    #[serde(default)]
    name: String,
    #[serde(default)]
    density: String,
    /// Absent: linear.
    order: Option<String>,
    indenter: Option<IndenterSpec>,
    #[serde(default)]
    indenters: Vec<NamedIndenter>,
}

#[derive(Debug, Deserialize)]
struct NamedIndenter {
    name: String,
    indenter: IndenterSpec,
}

#[derive(Debug, Deserialize)]
struct Splits {
    train: Vec<usize>,
    test: Vec<usize>,
}

/// One indentation of the manifest.
#[derive(Clone, Debug, Deserialize)]
pub struct Indentation {
    /// Number within the campaign.
    pub id: usize,
    /// Its shard, relative to the manifest.
    pub file: String,
    /// SHA-256 of the shard.
    pub sha256: String,
    /// Samples in the shard.
    pub samples: usize,
    /// Name of the indenter within the campaign.
    #[serde(default)]
    pub indenter: String,
    /// Where its axis meets the skin, mm along its own x and y.
    #[serde(default)]
    pub offset_mm: [f64; 2],
    /// Pitch of the plate, degrees.
    pub pitch_deg: f64,
    /// Roll of the plate, degrees.
    pub roll_deg: f64,
    /// Yaw of the plate, degrees.
    pub yaw_deg: f64,
}

/// The samples of one indentation.
#[derive(Clone, Debug)]
pub struct Shard {
    /// Cells whose V nodes the values belong to; `None`: they belong to the atlas' vertices.
    pub cells: Option<Cells>,
    /// Pressure on the skin, Pa; `[D, V]`.
    pub pressure_pa: Array2<f32>,
    /// SED on the dermis side of the interface, J/m3; `[D, V]`.
    pub sed_j_per_m3: Array2<f32>,
    /// Depth of each sample, mm; `[D]`.
    pub depth_mm: Array1<f32>,
    /// Where the indenter has slid to, mm along its own x and y; `[D, 2]`; none if it does not slide.
    pub slide_mm: Option<Array2<f32>>,
    /// Force on the finger, N; `[D, 3]`; none if the shard does not hold it.
    pub force_n: Option<Array2<f32>>,
    /// Traction along the skin, Pa; `[D, V, 3]`; none without friction.
    pub shear_pa: Option<Array3<f32>>,
}

impl Shard {
    /// Where the indenter has slid to in a state, mm along its own x and y.
    #[must_use]
    pub fn slide_mm(&self, state: usize) -> [f64; 2] {
        let at = |s: &Array2<f32>| [0, 1].map(|k: usize| f64::from(s[[state, k]]));
        self.slide_mm.as_ref().map_or([0.0; 2], at)
    }
}

/// A dataset whose manifest and atlas have been read and agree.
#[derive(Debug)]
pub struct Dataset {
    folder: PathBuf,
    manifest: Manifest,
    /// The atlas of all its maps.
    pub atlas: Atlas,
    /// Where errors are taken.
    pub ground: Ground,
    /// Draws pressure and SED.
    pub maps: Maps,
}

impl Dataset {
    /// Opens the dataset in `folder`; shards are read by [`Dataset::load`].
    ///
    /// # Errors
    /// [`ExportError::Io`], [`ExportError::Dataset`], [`ExportError::Atlas`].
    pub fn open(folder: &Path) -> Result<Self, ExportError> {
        let path = folder.join("manifest.json");
        let bad = |reason: String| ExportError::Dataset { path: path.clone(), reason };
        let manifest: Manifest = serde_json::from_str(&read_text(&path)?)
            .map_err(|error| bad(format!("not a manifest: {error}")))?;
        if !FORMATS.contains(&manifest.format) {
            return Err(bad(format!(
                "format {} is not supported, this program reads {FORMATS:?}",
                manifest.format
            )));
        }
        let atlas_path = folder.join("atlas.json");
        let refused = |source| ExportError::Atlas { path: atlas_path.clone(), source };
        let atlas = Atlas::from_json(&read_text(&atlas_path)?).map_err(refused)?;
        atlas.require_hash(&manifest.atlas_hash).map_err(refused)?;
        if atlas.vertex_count() != manifest.vertex_count {
            return Err(bad(format!(
                "{} vertices, the atlas has {}",
                manifest.vertex_count,
                atlas.vertex_count()
            )));
        }
        manifest.check_identity().map_err(bad)?;
        let maps = Maps::read(folder, &atlas).map_err(|error| bad(error.to_string()))?;
        let ground = Ground::new(&atlas, maps.raster(Patch::Interface));
        Ok(Self { folder: folder.to_owned(), manifest, atlas, ground, maps })
    }

    /// The folder it is in.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// SHA-256 that names the dataset.
    #[must_use]
    pub fn sha256(&self) -> &str {
        &self.manifest.dataset_sha256
    }

    /// Name of its campaign.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.manifest.campaign.name
    }

    /// Mesh that it was solved on, such as `medium-graded`.
    #[must_use]
    pub fn mesh(&self) -> String {
        let Campaign { density, order, .. } = &self.manifest.campaign;
        format!("{density}-{}", order.as_deref().unwrap_or("linear"))
    }

    /// What pressed in an indentation; none if the manifest does not say.
    #[must_use]
    pub fn indenter(&self, indentation: &Indentation) -> Option<&IndenterSpec> {
        let Campaign { indenter, indenters, .. } = &self.manifest.campaign;
        let named = indenters.iter().find(|other| other.name == indentation.indenter);
        named.map(|named| &named.indenter).or(indenter.as_ref())
    }

    /// Effects that the solver modelled.
    #[must_use]
    pub fn effects(&self) -> &[String] {
        &self.manifest.effects
    }

    /// The indentations of a split (`train` or `test`), in the manifest's order.
    ///
    /// # Errors
    /// [`ExportError::EmptySplit`] if there are none, [`ExportError::Dataset`] for another
    /// name, or an indentation that is not in the manifest.
    pub fn indentations(&self, split: &str) -> Result<Vec<&Indentation>, ExportError> {
        let path = self.folder.join("manifest.json");
        let bad = |reason: String| ExportError::Dataset { path: path.clone(), reason };
        let ids = match split {
            "train" => &self.manifest.splits.train,
            "test" => &self.manifest.splits.test,
            _ => return Err(bad(format!("no split '{split}'; there are 'train' and 'test'"))),
        };
        let indentations = ids
            .iter()
            .map(|id| {
                let indentation =
                    self.manifest.indentations.iter().find(|indentation| indentation.id == *id);
                indentation.ok_or_else(|| bad(format!("press {id} of the split is not listed")))
            })
            .collect::<Result<Vec<_>, _>>()?;
        if indentations.iter().all(|indentation| indentation.samples == 0) {
            return Err(ExportError::EmptySplit { path, split: split.to_owned() });
        }
        Ok(indentations)
    }

    /// All indentations, of whichever split, in the manifest's order.
    #[must_use]
    pub fn every_indentation(&self) -> Vec<&Indentation> {
        self.manifest.indentations.iter().collect()
    }

    /// Path of the shard of an indentation.
    #[must_use]
    pub fn shard_path(&self, indentation: &Indentation) -> PathBuf {
        self.folder.join(&indentation.file)
    }

    /// Reads the shard of an indentation and checks its hash, shapes and values.
    ///
    /// # Errors
    /// [`ExportError::Io`], [`ExportError::Dataset`].
    pub fn load(&self, indentation: &Indentation) -> Result<Shard, ExportError> {
        let path = self.shard_path(indentation);
        let bad = |reason: String| ExportError::Dataset { path: path.clone(), reason };
        let bytes = read(&path)?;
        if sha256_hex(&bytes) != indentation.sha256 {
            return Err(bad(
                "its hash is not the manifest's: it is damaged or of another run".into()
            ));
        }
        let unreadable = |error: ReadNpzError| bad(format!("unreadable: {error}"));
        let mut npz = NpzReader::new(Cursor::new(bytes)).map_err(unreadable)?;
        let cells = match read_array::<u32, Ix2>(&mut npz, "cell_place") {
            Ok(place) => {
                let nodes = read_array(&mut npz, "cell_nodes").map_err(unreadable)?;
                let cells = Cells::from_arrays(&place, &nodes);
                Some(cells.ok_or_else(|| bad("its cells do not fit their nodes".into()))?)
            }
            Err(_) => None,
        };
        let values = cells.as_ref().map_or(self.manifest.vertex_count, Cells::node_count);
        let shard = Shard {
            cells,
            pressure_pa: read_array(&mut npz, "pressure_pa").map_err(unreadable)?,
            sed_j_per_m3: read_array(&mut npz, "sed_dermis_j_per_m3").map_err(unreadable)?,
            depth_mm: read_array(&mut npz, "depth_mm").map_err(unreadable)?,
            force_n: read_array(&mut npz, "force_n").ok(),
            shear_pa: read_array(&mut npz, "shear_pa").ok(),
            slide_mm: read_array(&mut npz, "slide_mm").ok(),
        };
        let expected = (indentation.samples, values);
        for (name, array) in
            [("pressure_pa", &shard.pressure_pa), ("sed_dermis_j_per_m3", &shard.sed_j_per_m3)]
        {
            if array.dim() != expected {
                return Err(bad(format!("{name} is {:?}, not {expected:?}", array.dim())));
            }
            if let Some(value) = array.iter().find(|value| !value.is_finite()) {
                return Err(bad(format!("{name} holds {value}")));
            }
        }
        let by_value = |shear: &Array3<f32>| shear.dim() == (expected.0, expected.1, 3);
        let by_state = |slide: &Array2<f32>| slide.dim() == (expected.0, 2);
        if let Some(slide) = shard.slide_mm.as_ref().filter(|slide| !by_state(slide)) {
            return Err(bad(format!("slide_mm is {:?}", slide.dim())));
        }
        if let Some(shear) = shard.shear_pa.as_ref().filter(|shear| !by_value(shear)) {
            return Err(bad(format!("shear_pa is {:?}", shear.dim())));
        }
        if shard.depth_mm.len() != indentation.samples {
            return Err(bad(format!("depth_mm has {} values", shard.depth_mm.len())));
        }
        Ok(shard)
    }
}

impl Dataset {
    /// Draws the pressure of a sample of `press` on the skin, Pa; 224 x 224.
    ///
    /// # Errors
    /// [`ExportError::Dataset`] where a pixel lies in no cell, [`ExportError::Atlas`].
    pub fn draw_pressure(
        &self,
        indentation: &Indentation,
        shard: &Shard,
        index: usize,
        map: &mut [f32],
    ) -> Result<(), ExportError> {
        self.draw(indentation, Patch::Skin, shard, &shard.pressure_pa.row(index).to_vec(), map)
    }

    /// Draws its SED on the interface, J/m3.
    ///
    /// # Errors
    /// As [`Self::draw_pressure`].
    pub fn draw_sed(
        &self,
        indentation: &Indentation,
        shard: &Shard,
        index: usize,
        map: &mut [f32],
    ) -> Result<(), ExportError> {
        self.draw(
            indentation,
            Patch::Interface,
            shard,
            &shard.sed_j_per_m3.row(index).to_vec(),
            map,
        )
    }

    pub(crate) fn draw(
        &self,
        indentation: &Indentation,
        patch: Patch,
        shard: &Shard,
        values: &[f32],
        map: &mut [f32],
    ) -> Result<(), ExportError> {
        let path = || self.shard_path(indentation);
        let reader = self.maps.reader(patch, shard.cells.as_ref());
        let reader = reader
            .map_err(|error| ExportError::Dataset { path: path(), reason: error.to_string() })?;
        reader.draw(values, map).map_err(|source| ExportError::Atlas { path: path(), source })
    }
}

type Npz = NpzReader<Cursor<Vec<u8>>>;

pub(crate) fn read_array<T: ReadableElement, D: ndarray::Dimension>(
    npz: &mut Npz,
    name: &str,
) -> Result<ndarray::ArrayBase<OwnedRepr<T>, D>, ReadNpzError> {
    // numpy stores `name` as `name.npy`, other writers as `name`.
    npz.by_name(&format!("{name}.npy")).or_else(|_| npz.by_name(name))
}

impl Manifest {
    fn check_identity(&self) -> Result<(), String> {
        for (i, indentation) in self.indentations.iter().enumerate() {
            // A manifest must not make the program read files elsewhere.
            if Path::new(&indentation.file).components().any(|c| !matches!(c, Component::Normal(_)))
            {
                return Err(format!(
                    "press {}: '{}' is no path inside the dataset",
                    indentation.id, indentation.file
                ));
            }
            if self.indentations[..i].iter().any(|other| other.id == indentation.id) {
                return Err(format!("press {} is listed twice", indentation.id));
            }
        }
        if let Some(id) = self.splits.test.iter().find(|id| self.splits.train.contains(id)) {
            return Err(format!("press {id} is in both splits: the test would not be held out"));
        }
        let mut by_id: Vec<&Indentation> = self.indentations.iter().collect();
        by_id.sort_by_key(|indentation| indentation.id);
        let hashes: String = by_id.iter().map(|indentation| indentation.sha256.as_str()).collect();
        if sha256_hex(hashes.as_bytes()) != self.dataset_sha256 {
            return Err("dataset_sha256 does not follow from the shards listed".to_owned());
        }
        Ok(())
    }
}

fn sha256_hex(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}
