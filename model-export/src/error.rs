//! What can go wrong when a model is checked, evaluated or described.

use crate::split::SplitOrAll;
use papilla_dataset::DatasetError;
use papilla_engine::EngineError;
use papilla_output::OutputError;
use papilla_proto::atlas::{Atlas, AtlasError};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Why a model, dataset or reference is refused.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ExportError {
    /// A file cannot be read or written.
    #[error("cannot {action} {path}: {source}")]
    Io {
        /// `read` or `write`.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// The system's words.
        source: std::io::Error,
    },
    /// The model is refused, or failed.
    #[error("{path}: {source}")]
    Engine {
        /// The model or card.
        path: PathBuf,
        /// The engine's words.
        source: EngineError,
    },
    /// The atlas is refused.
    #[error("{path}: {source}")]
    Atlas {
        /// The atlas.
        path: PathBuf,
        /// What is wrong with it.
        source: AtlasError,
    },
    /// The contact model is refused.
    #[error("{path}: {source}")]
    Contact {
        /// The contact model, or what does not go with it.
        path: PathBuf,
        /// What is wrong with it.
        source: papilla_contact::ModelError,
    },
    /// The dataset cannot be read or trusted.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// A file of the dataset lacks what it is wanted for.
    #[error("{path}: {reason}")]
    DatasetFile {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// The finger cannot be read, or is not the dataset's.
    #[error("{path}: {reason}")]
    Finger {
        /// Its folder.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// Model and dataset (or two files) belong to different atlases.
    #[error(
        "{what} is of atlas {found}, the models are of atlas {expected}; they do not go together"
    )]
    AtlasMismatch {
        /// What has the other atlas.
        what: String,
        /// The model's atlas.
        expected: String,
        /// The other.
        found: String,
    },
    /// The dataset is not the one that the model was trained on.
    #[error(
        "the model was trained on dataset {trained}, this is {found}: which presses it never saw is not known, so no card can be written; leave --card away to measure it all the same"
    )]
    OtherDataset {
        /// Hash of the dataset in the model.
        trained: String,
        /// Hash of the dataset at hand.
        found: String,
    },
    /// The recorded outputs of another engine cannot be used.
    #[error("{path}: {reason}; write it with the trainer's `check --reference`")]
    Reference {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// Two engines disagree on the same model.
    #[error(
        "{backend} differs from {other} by {difference:.2e} of the maximum (allowed {tolerance:.0e}): the model must not be served by this engine"
    )]
    Disagreement {
        /// The engine measured.
        backend: String,
        /// The engine it is held against.
        other: String,
        /// Greatest difference over the greatest value, over all samples.
        difference: f64,
        /// What was allowed.
        tolerance: f64,
    },
    /// A split without samples.
    #[error("{path}: '{split}' holds no sample")]
    EmptySplit {
        /// The manifest.
        path: PathBuf,
        /// The split.
        split: SplitOrAll,
    },
    /// A truth without energy, or with what is no energy density.
    #[error("{path}: sample {sample} has no usable SED: {reason}")]
    Truth {
        /// The shard.
        path: PathBuf,
        /// Index of the sample in the shard.
        sample: usize,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// A chart cannot be drawn.
    #[error("cannot draw {what}: {reason}")]
    Chart {
        /// What was to be drawn.
        what: &'static str,
        /// The drawing library's words.
        reason: String,
    },
    /// A picture cannot be encoded.
    #[error("cannot write {path}: {source}")]
    Picture {
        /// The picture.
        path: PathBuf,
        /// The encoder's words.
        source: OutputError,
    },
}

impl ExportError {
    /// Exit status of the program for this error: 3 where a file could not be read or
    /// written, 1 where its contents were refused.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Io { .. }
            | Self::Picture { .. }
            | Self::Dataset(DatasetError::Output(OutputError::Io { .. })) => 3,
            _ => 1,
        }
    }

    pub(crate) fn engine(path: &Path) -> impl FnOnce(EngineError) -> Self {
        move |source| Self::Engine { path: path.to_owned(), source }
    }
}

/// Reads a file whole.
///
/// # Errors
/// [`ExportError::Io`] naming the file.
pub fn read(path: &Path) -> Result<Vec<u8>, ExportError> {
    std::fs::read(path).map_err(|source| ExportError::Io {
        action: "read",
        path: path.to_owned(),
        source,
    })
}

/// Reads a text file whole.
///
/// # Errors
/// [`ExportError::Io`] naming the file.
pub fn read_text(path: &Path) -> Result<String, ExportError> {
    papilla_proto::json::read_text(path).map_err(|source| ExportError::Io {
        action: "read",
        path: path.to_owned(),
        source,
    })
}

/// Reads an atlas.
///
/// # Errors
/// [`ExportError::Io`], [`ExportError::Atlas`] naming the file.
pub fn read_atlas(path: &Path) -> Result<Atlas, ExportError> {
    let refused = |source| ExportError::Atlas { path: path.to_owned(), source };
    Atlas::from_json(&read_text(path)?).map_err(refused)
}

/// Writes a file so that it is whole or absent; its folder is made if it is not there.
///
/// # Errors
/// [`ExportError::Io`] naming the file.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), ExportError> {
    let failed = |source| ExportError::Io { action: "write", path: path.to_owned(), source };
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(failed)?;
    }
    let mut draft = path.as_os_str().to_owned();
    draft.push(".part");
    std::fs::write(&draft, bytes).map_err(failed)?;
    std::fs::rename(&draft, path).map_err(failed)
}
