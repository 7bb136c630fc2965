//! What can go wrong when a file is written or read.

use std::path::{Path, PathBuf};

/// A file could not be written or read, or its content does not fit.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The operating system refused.
    #[error(
        "cannot {action} {path}: {source} (check that the path exists, is writable and the disk has room)"
    )]
    Io {
        /// What was tried: `read`, `write`, `create the folder`, ...
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// The system's own words.
        source: std::io::Error,
    },
    /// Arrays that belong together have different lengths.
    #[error("{what} has {found} values where {expected} are due")]
    Length {
        /// The array.
        what: String,
        /// Its length.
        found: usize,
        /// The length that fits.
        expected: usize,
    },
    /// A scale or a value cannot be drawn.
    #[error(
        "{what} is {value}, which cannot be stored in an image (it has to be finite and, for a scale, above 0)"
    )]
    NotDrawable {
        /// The quantity.
        what: String,
        /// Its value.
        value: f64,
    },
    /// A file was read, but its content is not what its name promises.
    #[error("{path} is damaged or of another format: {message}")]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// An encoder failed in memory.
    #[error("cannot encode {what}: {message}")]
    Encode {
        /// The kind of content.
        what: &'static str,
        /// The encoder's own words.
        message: String,
    },
}

impl OutputError {
    /// Wraps an I/O error with what was tried and where.
    pub fn io(action: &'static str, path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Io { action, path, source }
    }

    /// Says that the file at `path` has the wrong content.
    pub fn malformed(path: &Path, message: &dyn std::fmt::Display) -> Self {
        Self::Malformed { path: path.to_path_buf(), message: message.to_string() }
    }
}
