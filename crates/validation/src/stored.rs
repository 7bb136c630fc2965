//! What a run solved, stored for the next one: a press goes on where the last run stopped.

use papilla_dataset::sha256_hex;
use papilla_output::OutputError;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Why what an earlier run stored is of no use.
#[derive(Debug, thiserror::Error)]
pub enum StoredError {
    /// It is not what was written.
    #[error("{}: {why}; delete it, and it is solved again", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        why: String,
    },
    /// It cannot be read.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// SHA-256 of what a result is solved from, as JSON: a result with another is solved again.
///
/// # Errors
/// [`StoredError::Output`] if it cannot be written as JSON.
pub fn fingerprint(of: &impl Serialize) -> Result<String, StoredError> {
    let text = serde_json::to_string(of)
        .map_err(|e| OutputError::Encode { what: "JSON", message: e.to_string() })?;
    Ok(sha256_hex(text.as_bytes()))
}

/// What is stored there, `None` where nothing is.
///
/// # Errors
/// [`StoredError::Damaged`] with the member that is wrong, [`StoredError::Output`].
pub fn read_json<T: DeserializeOwned>(path: &Path) -> Result<Option<T>, StoredError> {
    let text = match std::fs::read(path) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
        found => found.map_err(OutputError::io("read", path))?,
    };
    let reader = &mut serde_json::Deserializer::from_slice(&text);
    serde_path_to_error::deserialize(reader)
        .map(Some)
        .map_err(|e| StoredError::Damaged { path: path.into(), why: e.to_string() })
}
