//! What can go wrong when a file is written or read.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// A file could not be written or read, or its content does not fit.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The operating system refused.
    #[error("cannot {action} {path}: {source}{}", cure(source))]
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

/// What to do about the system's words.
fn cure(error: &std::io::Error) -> &'static str {
    match error.kind() {
        ErrorKind::NotFound => ": check the path",
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
            ": take a folder that you may write to, or change its rights"
        }
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => ": make room, or take another disk",
        ErrorKind::IsADirectory => ": a file is due, not a folder",
        ErrorKind::NotADirectory | ErrorKind::AlreadyExists => ": a folder is due, not a file",
        _ => "",
    }
}

/// What an error says, with its causes: each once, also where an error's own words tell of it.
#[must_use]
pub fn told(error: &(dyn std::error::Error + 'static)) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        let words = error.to_string();
        if !text.contains(&words) {
            text += &format!(": {words}");
        }
        cause = error.source();
    }
    text
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

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, thiserror::Error)]
    #[error("the campaign fails")]
    struct Outer(#[from] OutputError);

    #[test]
    fn every_cause_is_told_once() {
        let missing = std::io::Error::other("no such thing");
        let file = OutputError::io("read", Path::new("a.json"))(missing);
        let own = file.to_string();
        assert_eq!(told(&file), own);
        assert_eq!(told(&Outer::from(file)), format!("the campaign fails: {own}"));
    }
}
