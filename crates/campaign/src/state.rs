//! What a campaign remembers between processes, in `DIR/progress`.
//!
//! Many processes write there at once, also on a network file system, and there are no locks. So
//! every file is either whole or absent, has the same content whichever process writes it, and
//! counts only if a record names it.

use crate::CampaignError;
use papilla_atlas::Atlas;
use papilla_dataset::{Checks, FORMAT, sha256_hex, shard_file};
use papilla_fingertip::campaign::{CampaignSpec, Indentation};
use papilla_output::{OutputError, atomic};
use serde::{Deserialize, Serialize};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Program and version, as manifests name it.
pub(crate) const SOFTWARE: &str = concat!("fe-datagen ", env!("CARGO_PKG_VERSION"));

/// Which campaign a folder belongs to.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Owner {
    fingerprint: String,
}

/// What became of one indentation; written after its shard.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct IndentationState {
    pub press: Indentation,
    /// Wall time, s. Not part of the dataset: it is never the same twice.
    pub seconds: f64,
    /// Processor time, s; absent if it went on from where another process stood.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub processor_s: Option<f64>,
    pub outcome: Outcome,
    /// Campaign that it is of; earlier versions left that to the folder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fingerprint: Option<String>,
}

/// Solved, with a shard, or failed, without.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Outcome {
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

impl IndentationState {
    /// Did it fail?
    pub(crate) fn is_failed(&self) -> bool {
        matches!(self.outcome, Outcome::Failed { .. })
    }
}

/// What a folder has of an indentation.
pub(crate) enum Found {
    /// A record, and the shard that it vouches for if there has to be one.
    Vouched(Box<IndentationState>),
    /// No record.
    Absent,
    /// Something that cannot be trusted, and why.
    Untrusted(String),
}

/// A campaign's folder.
pub(crate) struct Workspace {
    folder: PathBuf,
    fingerprint: String,
}

impl Workspace {
    /// Makes the folder of a campaign, or comes back to it.
    pub(crate) fn open(
        folder: &Path,
        spec: &CampaignSpec,
        atlas: &Atlas,
    ) -> Result<Self, CampaignError> {
        let owner_path = owner_path(folder);
        if folder.join("manifest.json").exists() && !owner_path.exists() {
            let what = "a finished dataset without its progress records";
            return Err(CampaignError::Occupied { folder: folder.into(), what });
        }
        for part in ["shards", "progress"] {
            atomic::create_folder(&folder.join(part))?;
        }
        let fingerprint = fingerprint(spec, atlas)?;
        let workspace = Self { folder: folder.to_path_buf(), fingerprint };
        if !owner_path.exists() {
            let owner = Owner { fingerprint: workspace.fingerprint.clone() };
            let text = serde_json::to_vec_pretty(&owner)
                .map_err(|e| OutputError::Encode { what: "JSON", message: e.to_string() })?;
            // Of slices of two campaigns that start at once, one finds the other's.
            atomic::write_first(&owner_path, &text)?;
        }
        workspace.require_owner()?;
        Ok(workspace)
    }

    /// The folder of a campaign that has been begun; with its atlas.
    pub(crate) fn begun(
        folder: &Path,
        spec: &CampaignSpec,
    ) -> Result<(Self, Atlas), CampaignError> {
        let path = folder.join("atlas.json");
        if !owner_path(folder).exists() || !path.exists() {
            return Err(CampaignError::NotBegun { folder: folder.into() });
        }
        let text = std::fs::read_to_string(&path).map_err(OutputError::io("read", &path))?;
        let atlas = Atlas::from_json(&text).map_err(|e| OutputError::malformed(&path, &e))?;
        let fingerprint = fingerprint(spec, &atlas)?;
        let workspace = Self { folder: folder.to_path_buf(), fingerprint };
        workspace.require_owner()?;
        Ok((workspace, atlas))
    }

    fn require_owner(&self) -> Result<(), CampaignError> {
        let owner: Owner = atomic::read_json(&owner_path(&self.folder))?;
        if owner.fingerprint == self.fingerprint {
            return Ok(());
        }
        let what = "another campaign, finger or version";
        Err(CampaignError::Occupied { folder: self.folder.clone(), what })
    }

    fn record_path(&self, id: usize) -> PathBuf {
        self.folder.join(format!("progress/press-{id:05}.json"))
    }

    fn standing_path(&self, id: usize) -> PathBuf {
        self.folder.join(format!("progress/press-{id:05}.state"))
    }

    /// The record of an indentation; its shard is not looked at.
    pub(crate) fn record(&self, press: &Indentation) -> Found {
        let path = self.record_path(press.id);
        let state: IndentationState = match atomic::read_json(&path) {
            Ok(state) => state,
            Err(OutputError::Io { source, .. }) if source.kind() == ErrorKind::NotFound => {
                return Found::Absent;
            }
            Err(error) => return Found::Untrusted(error.to_string()),
        };
        let other = state.fingerprint.as_ref().is_some_and(|f| *f != self.fingerprint);
        if other || state.press != *press {
            return Found::Untrusted(format!("{} is of another campaign", path.display()));
        }
        Found::Vouched(Box::new(state))
    }

    /// What there is of an indentation: to be trusted is a readable record whose shard is there
    /// and has the recorded hash.
    pub(crate) fn load(&self, press: &Indentation) -> Found {
        let state = match self.record(press) {
            Found::Vouched(state) => state,
            other => return other,
        };
        if let Outcome::Solved { sha256, .. } = &state.outcome {
            let path = self.folder.join(shard_file(press.id));
            match std::fs::read(&path) {
                Ok(bytes) if sha256_hex(&bytes) == *sha256 => {}
                Ok(_) => {
                    let why = format!("{} is not what its record vouches for", path.display());
                    return Found::Untrusted(why);
                }
                Err(error) => {
                    let error = OutputError::io("read", &path)(error);
                    return Found::Untrusted(error.to_string());
                }
            }
        }
        Found::Vouched(state)
    }

    /// Stores an indentation: the shard first, then the record that vouches for it; and forgets
    /// where it stood.
    pub(crate) fn store(
        &self,
        state: &mut IndentationState,
        shard: Option<&[u8]>,
    ) -> Result<(), CampaignError> {
        // A node that was away may find that the folder has been given to another campaign.
        self.require_owner()?;
        state.fingerprint = Some(self.fingerprint.clone());
        let path = self.folder.join(shard_file(state.press.id));
        match shard {
            Some(bytes) => atomic::write(&path, bytes)?,
            // An indentation that failed this time must not keep the shard of another time.
            None => remove(&path)?,
        }
        atomic::write_json(&self.record_path(state.press.id), state)?;
        Ok(remove(&self.standing_path(state.press.id))?)
    }

    /// Stores where an indentation stands.
    pub(crate) fn store_standing(&self, id: usize, bytes: &[u8]) -> Result<(), OutputError> {
        let mut whole = self.seal(id, bytes).into_bytes();
        whole.extend_from_slice(bytes);
        atomic::write(&self.standing_path(id), &whole)
    }

    /// Where an indentation stands, if that is of this campaign and whole.
    pub(crate) fn standing(&self, id: usize) -> Option<Vec<u8>> {
        let path = self.standing_path(id);
        let whole = std::fs::read(&path).ok()?;
        let (seal, bytes) = whole.split_at_checked(SEAL_LEN)?;
        if seal != self.seal(id, bytes).as_bytes() {
            let path = path.display();
            tracing::warn!(%path, "a stored state is damaged or of another campaign: not used");
            return None;
        }
        Some(bytes.to_vec())
    }

    /// What vouches for a stored state: a hash of campaign, number and bytes.
    fn seal(&self, id: usize, bytes: &[u8]) -> String {
        sha256_hex(format!("{} {id} {}", self.fingerprint, sha256_hex(bytes)).as_bytes())
    }

    /// Removes what killed processes left half-written. Only where everything is vouched for: what
    /// another process is writing is then there already.
    pub(crate) fn remove_partial(&self) -> Result<(), OutputError> {
        ["", "shards", "progress"]
            .into_iter()
            .try_for_each(|part| atomic::remove_partial(&self.folder.join(part)))
    }

    /// The output folder.
    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }
}

/// Characters of a seal.
const SEAL_LEN: usize = 64;

fn owner_path(folder: &Path) -> PathBuf {
    folder.join("progress/campaign.json")
}

fn remove(path: &Path) -> Result<(), OutputError> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => {
            Err(OutputError::io("remove", path)(error))
        }
        _ => Ok(()),
    }
}

/// Names everything that shards depend on, so that two campaigns never mix.
fn fingerprint(spec: &CampaignSpec, atlas: &Atlas) -> Result<String, OutputError> {
    let mut files = Vec::new();
    for candidate in spec.candidates() {
        for file in candidate.indenter.files() {
            let path = spec.folder.join(file);
            let bytes = std::fs::read(&path).map_err(OutputError::io("read", &path))?;
            files.push(sha256_hex(&bytes));
        }
    }
    // A shard does not depend on how many follow, nor on which of them are held out: a campaign can
    // be gone on with after more presses were asked for.
    let each =
        CampaignSpec { presses: 0, test_fraction: Some(0.0), test_one_in: None, ..spec.clone() };
    let text = serde_json::to_string(&(each, files, atlas.hash(), FORMAT, SOFTWARE))
        .map_err(|e| OutputError::Encode { what: "JSON", message: e.to_string() })?;
    Ok(sha256_hex(text.as_bytes()))
}
