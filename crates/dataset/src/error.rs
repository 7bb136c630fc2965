//! What can be wrong with a dataset.

use papilla_atlas::AtlasError;
use papilla_output::OutputError;
use std::path::PathBuf;

/// A dataset cannot be written, read or trusted.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// A file cannot be written, read or understood.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The atlas is damaged, or values do not fit it.
    #[error("{path}: {source}")]
    Atlas {
        /// The atlas file, or the file whose values do not fit.
        path: PathBuf,
        /// What the atlas says.
        source: AtlasError,
    },
    /// A manifest of a format that this version does not know.
    #[error(
        "{path} has format {found}, this program reads {expected}: use the version that wrote it"
    )]
    Format {
        /// The manifest.
        path: PathBuf,
        /// Its format number.
        found: u32,
        /// The one known here.
        expected: u32,
    },
    /// The content of a file is not what the manifest says it is.
    #[error(
        "{path}: {what} is {found}, the manifest says {expected}; the file was altered or belongs to another dataset"
    )]
    Mismatch {
        /// The file.
        path: PathBuf,
        /// The property, such as `sha256`.
        what: &'static str,
        /// As found.
        found: String,
        /// As promised.
        expected: String,
    },
    /// There is nothing in it.
    #[error("{path} lists no indentation: generate the campaign first")]
    Empty {
        /// The manifest.
        path: PathBuf,
    },
}
