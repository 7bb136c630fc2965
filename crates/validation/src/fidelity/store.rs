//! What is on disk between runs: one archive and one record an indentation and fidelity level.

use super::FidelityError;
use ndarray::Ix2;
use papilla_dataset::sha256_hex;
use papilla_fingertip::campaign::{CampaignSpec, Indentation};
use papilla_fingertip::scene::Pose;
use papilla_fingertip::simulation::record::Checks;
use papilla_output::npz::{NpzArrays, NpzBuilder};
use papilla_output::{OutputError, atomic};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Program and version.
pub(super) const SOFTWARE: &str = concat!("fe-datagen ", env!("CARGO_PKG_VERSION"));

/// One indentation solved by one fidelity level: fields of D states on the target's V vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Part {
    /// `[D][V]`.
    pub pressure_pa: Vec<f32>,
    /// `[D][V]`.
    pub sed_j_per_m3: Vec<f32>,
    /// `[D][3]`.
    pub force_n: Vec<f32>,
    pub record: Record,
}

/// What vouches for a part's archive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Record {
    pub press: Indentation,
    pub unknowns: usize,
    pub factor_entries: usize,
    /// Processor seconds of mesh and symbolic factorization.
    pub setup_seconds: f64,
    /// Largest distance of a target's vertex from the fidelity level's own surface, mm.
    pub distance_mm_max: f64,
    /// How much farther than the indentation says the indenter goes from this mesh's first touch,
    /// and is offset, to be where the target's mesh has it, mm.
    pub depth_shift_mm: f64,
    pub offset_shift_mm: [f64; 2],
    /// Processor seconds from the start of the indentation to each state.
    pub seconds: Vec<f64>,
    pub checks: Vec<Checks>,
    /// What is wrong with each state.
    pub faults: Vec<Option<String>>,
    /// Why states are missing.
    pub error: Option<String>,
    pub sha256: String,
}

impl Default for Record {
    fn default() -> Self {
        let press = Indentation {
            id: 0,
            candidate: 0,
            indenter: String::new(),
            shape: String::new(),
            pose: Pose::default(),
            offset_mm: [0.0; 2],
            depths_mm: Vec::new(),
        };
        Self {
            press,
            unknowns: 0,
            factor_entries: 0,
            setup_seconds: 0.0,
            distance_mm_max: 0.0,
            depth_shift_mm: 0.0,
            offset_shift_mm: [0.0; 2],
            seconds: Vec::new(),
            checks: Vec::new(),
            faults: Vec::new(),
            error: None,
            sha256: String::new(),
        }
    }
}

/// A folder of parts, which many processes may share: every file is whole or absent.
pub(super) struct Store {
    folder: PathBuf,
    vertices: usize,
}

/// Which measurement a folder belongs to.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Owner {
    fingerprint: String,
}

impl Store {
    /// Makes or reopens the folder `parts` in `out`.
    pub(super) fn open(
        out: &Path,
        spec: &CampaignSpec,
        atlas_hash: &str,
        vertices: usize,
    ) -> Result<Self, FidelityError> {
        let folder = out.join("parts");
        atomic::create_folder(&folder)?;
        let text = serde_json::to_string(&(spec, atlas_hash, SOFTWARE))
            .map_err(|e| OutputError::Encode { what: "JSON", message: e.to_string() })?;
        let owner = Owner { fingerprint: sha256_hex(text.as_bytes()) };
        let path = folder.join("owner.json");
        if !path.exists() {
            let text = serde_json::to_vec_pretty(&owner)
                .map_err(|e| OutputError::Encode { what: "JSON", message: e.to_string() })?;
            // Of two measurements that begin at once, one finds the other's.
            atomic::write_first(&path, &text)?;
        }
        if atomic::read_json::<Owner>(&path)? != owner {
            return Err(FidelityError::Occupied { folder: out.into() });
        }
        Ok(Self { folder, vertices })
    }

    /// Removes what killed processes left half-written, where everything is solved.
    pub(super) fn remove_partial(&self) -> Result<(), OutputError> {
        atomic::remove_partial(&self.folder)
    }

    fn path(&self, level: &str, id: usize, extension: &str) -> PathBuf {
        self.folder.join(format!("{level}-press-{id:05}.{extension}"))
    }

    /// What an earlier run left of an indentation: a readable record whose archive has the
    /// recorded hash.
    pub(super) fn load(&self, level: &str, press: &Indentation) -> Option<Part> {
        let record: Record = atomic::read_json(&self.path(level, press.id, "json")).ok()?;
        let path = self.path(level, press.id, "npz");
        let bytes = std::fs::read(&path).ok()?;
        if record.press != *press || sha256_hex(&bytes) != record.sha256 {
            return None;
        }
        let mut npz = NpzArrays::new(&path, &bytes).ok()?;
        let mut get = |name| Some(npz.get::<f32, Ix2>(name).ok()?.into_iter().collect());
        Some(Part {
            pressure_pa: get("pressure_pa")?,
            sed_j_per_m3: get("sed_dermis_j_per_m3")?,
            force_n: get("force_n")?,
            record,
        })
    }

    /// Stores a part: the archive first, then the record that vouches for it.
    pub(super) fn write(&self, level: &str, part: &Part) -> Result<(), OutputError> {
        let id = part.record.press.id;
        let states = part.record.seconds.len();
        let npz = archive(states, self.vertices, part)?;
        let bytes = npz.write(&self.path(level, id, "npz"))?;
        let record = Record { sha256: sha256_hex(&bytes), ..part.record.clone() };
        atomic::write_json(&self.path(level, id, "json"), &record)
    }
}

/// The arrays of `states` states.
pub(super) fn archive(
    states: usize,
    vertices: usize,
    part: &Part,
) -> Result<NpzBuilder, OutputError> {
    let mut npz = NpzBuilder::new();
    npz.add_slice("pressure_pa", &[states, vertices], &part.pressure_pa)?;
    npz.add_slice("sed_dermis_j_per_m3", &[states, vertices], &part.sed_j_per_m3)?;
    npz.add_slice("force_n", &[states, 3], &part.force_n)?;
    Ok(npz)
}
