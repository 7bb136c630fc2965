//! What a campaign remembers between runs, in `DIR/progress`.

use super::CampaignError;
use papilla_atlas::Atlas;
use papilla_dataset::{Checks, FORMAT, sha256_hex, shard_file};
use papilla_fingertip::campaign::{CampaignSpec, Indentation};
use papilla_output::{OutputError, atomic};
use serde::{Deserialize, Serialize};
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

/// Program and version, as manifests name it.
pub(super) const SOFTWARE: &str = concat!("fe-datagen ", env!("CARGO_PKG_VERSION"));

/// Which campaign a folder belongs to.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Owner {
    fingerprint: String,
}

/// What became of one indentation; written after its shard.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct IndentationState {
    pub press: Indentation,
    /// Wall time, s. Not part of the dataset: it is never the same twice.
    pub seconds: f64,
    pub outcome: Outcome,
}

/// Solved, with a shard, or failed, without.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Outcome {
    Solved {
        sha256: String,
        samples: usize,
        checks: Checks,
        pressure_max_pa: f64,
        sed_max_j_per_m3: f64,
        /// Depth (null if not a number) and reason of each sample left out.
        dropped: Vec<(Option<f64>, String)>,
    },
    Failed {
        error: String,
    },
}

/// A campaign's folder, held by this process alone.
pub(super) struct Workspace {
    folder: PathBuf,
    // The lock is the file's; the system drops it with the process, even on kill -9.
    _lock: File,
}

impl Workspace {
    /// Makes or reopens the folder of a campaign and takes its lock.
    pub(super) fn open(
        folder: &Path,
        spec: &CampaignSpec,
        atlas: &Atlas,
    ) -> Result<Self, CampaignError> {
        let owner_path = folder.join("progress/campaign.json");
        if folder.join("manifest.json").exists() && !owner_path.exists() {
            let what = "a finished dataset without its progress records";
            return Err(CampaignError::Occupied { folder: folder.into(), what });
        }
        for part in ["shards", "progress"] {
            atomic::create_folder(&folder.join(part))?;
        }
        let lock_path = folder.join("progress/lock");
        let lock = File::create(&lock_path).map_err(OutputError::io("write", &lock_path))?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(CampaignError::Busy { folder: folder.into() });
            }
            Err(TryLockError::Error(e)) => {
                return Err(OutputError::io("lock", &lock_path)(e).into());
            }
        }
        let owner = Owner { fingerprint: fingerprint(spec, atlas)? };
        if !owner_path.exists() {
            atomic::write_json(&owner_path, &owner)?;
        } else if atomic::read_json::<Owner>(&owner_path)? != owner {
            let what = "another campaign, finger or version";
            return Err(CampaignError::Occupied { folder: folder.into(), what });
        }
        for part in ["", "shards", "progress"] {
            atomic::remove_partial(&folder.join(part))?;
        }
        Ok(Self { folder: folder.to_path_buf(), _lock: lock })
    }

    fn record_path(&self, id: usize) -> PathBuf {
        self.folder.join(format!("progress/press-{id:05}.json"))
    }

    /// What an earlier run left of an indentation: only what can be trusted, that is a
    /// readable record whose shard is there and has the recorded hash.
    pub(super) fn load(&self, press: &Indentation) -> Option<IndentationState> {
        let state: IndentationState = atomic::read_json(&self.record_path(press.id)).ok()?;
        if state.press != *press {
            return None;
        }
        if let Outcome::Solved { sha256, .. } = &state.outcome {
            let bytes = std::fs::read(self.folder.join(shard_file(press.id))).ok()?;
            if sha256_hex(&bytes) != *sha256 {
                return None;
            }
        }
        Some(state)
    }

    /// Stores an indentation: the shard first, then the record that vouches for it.
    pub(super) fn store(
        &self,
        state: &IndentationState,
        shard: Option<&[u8]>,
    ) -> Result<(), OutputError> {
        let path = self.folder.join(shard_file(state.press.id));
        match shard {
            Some(bytes) => atomic::write(&path, bytes)?,
            // An indentation that failed this time must not keep the shard of another time.
            None if path.exists() => {
                std::fs::remove_file(&path).map_err(OutputError::io("remove", &path))?;
            }
            None => {}
        }
        atomic::write_json(&self.record_path(state.press.id), state)
    }

    /// The output folder.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }
}

/// Names everything that shards depend on, so that two campaigns never mix.
fn fingerprint(spec: &CampaignSpec, atlas: &Atlas) -> Result<String, OutputError> {
    let mut pictures = Vec::new();
    for candidate in spec.candidates() {
        for picture in candidate.indenter.pictures() {
            let path = spec.folder.join(picture);
            let bytes = std::fs::read(&path).map_err(OutputError::io("read", &path))?;
            pictures.push(sha256_hex(&bytes));
        }
    }
    let text = serde_json::to_string(&(spec, pictures, atlas.hash(), FORMAT, SOFTWARE))
        .map_err(|e| OutputError::Encode { what: "JSON", message: e.to_string() })?;
    Ok(sha256_hex(text.as_bytes()))
}
