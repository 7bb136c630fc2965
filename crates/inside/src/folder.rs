//! Reading the files of a folder of models.

use std::{fs, io, path::PathBuf};

use papilla_engine::EngineError;
use papilla_proto::atlas::AtlasError;
use papilla_session_contact::AssetsError;

/// Why a folder cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// A file cannot be read.
    #[error(
        "{}: {source}; a folder of models holds index.json, atlas.json, NAME.onnx and NAME.json",
        .file.display()
    )]
    File {
        /// Which.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The index does not list the model.
    #[error("no tier '{name}'; {} lists {known}", .file.display())]
    Unknown {
        /// The index.
        file: PathBuf,
        /// The model that was asked for.
        name: String,
        /// Those that there are.
        known: String,
    },
    /// The network, its card or the index is no good.
    #[error("{}: {source}", .file.display())]
    Engine {
        /// Which.
        file: PathBuf,
        /// Why.
        source: EngineError,
    },
    /// The atlas is no good, or another one than the network's.
    #[error("{}: {source}", .file.display())]
    Atlas {
        /// The file that does not fit.
        file: PathBuf,
        /// Why.
        source: AtlasError,
    },
    /// The contact model is no good, or of another atlas.
    #[error("{}: {source}", .file.display())]
    Contact {
        /// Which.
        file: PathBuf,
        /// Why.
        source: papilla_contact::ModelError,
    },
    /// The description of the finger is no TOML.
    #[error("{}: {source}", .file.display())]
    Finger {
        /// Which.
        file: PathBuf,
        /// Why.
        source: papilla_contact::FingerFileError,
    },
    /// What the contact model's methods err cannot be read.
    #[error("{}: {source}", .file.display())]
    Errors {
        /// The file.
        file: PathBuf,
        /// Why.
        source: AssetsError,
    },
}

pub(crate) fn read(file: PathBuf) -> Result<(PathBuf, Vec<u8>), LoadError> {
    match fs::read(&file) {
        Ok(bytes) => Ok((file, bytes)),
        Err(source) => Err(LoadError::File { file, source }),
    }
}

pub(crate) fn read_text(file: PathBuf) -> Result<(PathBuf, String), LoadError> {
    match papilla_proto::json::read_text(&file) {
        Ok(text) => Ok((file, text)),
        Err(source) => Err(LoadError::File { file, source }),
    }
}
