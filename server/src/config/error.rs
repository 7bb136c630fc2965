//! Why settings cannot be used.

use std::{io, path::PathBuf};

/// A setting at odds with another, or naming a file that cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{field}: {reason}")]
pub struct SettingError {
    /// The setting, as the file writes it.
    pub field: &'static str,
    /// What is wrong, and what would do.
    pub reason: String,
}

/// Why the settings cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// The command line or the environment is wrong, or only help was asked for.
    #[error(transparent)]
    Usage(#[from] clap::Error),
    /// The file cannot be read.
    #[error("the settings file {} cannot be read: {source}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The file is not TOML.
    #[error("{} is not TOML: {source}", file.display())]
    Syntax {
        /// The file.
        file: PathBuf,
        /// What is wrong, and in which line.
        source: toml::de::Error,
    },
    /// The file has a field that is no setting.
    #[error("{}: there is no setting '{field}'; there are: {known}", file.display())]
    Unknown {
        /// The file.
        file: PathBuf,
        /// The field.
        field: String,
        /// The settings there are.
        known: String,
    },
    /// A field of the file has a value that is not allowed.
    #[error("{}: {field}: {reason}", file.display())]
    Value {
        /// The file.
        file: PathBuf,
        /// The field.
        field: String,
        /// What is wrong, and what is allowed.
        reason: String,
    },
    /// Settings that do not go together.
    #[error(transparent)]
    Setting(#[from] SettingError),
}
