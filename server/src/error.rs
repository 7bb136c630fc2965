//! Why the service does not start, or does not end in time.

use std::{io, net::SocketAddr, path::PathBuf};

use crate::config::SettingError;

/// Why the service does not start.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StartError {
    /// A setting cannot be used.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A file of the model folder is missing.
    #[error("{origin} holds no {file}; {advice}")]
    Missing {
        /// The file.
        file: String,
        /// Where it was looked for.
        origin: String,
        /// What to do about it.
        advice: &'static str,
    },
    /// A file of the model folder is damaged or at odds with another.
    #[error("{file} from {origin} is unusable: {reason}")]
    Unusable {
        /// The file.
        file: String,
        /// Where it is from.
        origin: String,
        /// What is wrong with it.
        reason: String,
    },
    /// The model folder cannot be read.
    #[error("the model folder {} cannot be read: {source}", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The default tier does not exist.
    #[error("there is no tier '{name}' to take by default; there are: {known}")]
    UnknownDefault {
        /// The name.
        name: String,
        /// The names there are.
        known: String,
    },
    /// A model does not run.
    #[error("tier {tier} does not run: {source}")]
    Engine {
        /// The tier.
        tier: String,
        /// The engine's reason.
        source: papilla_engine::EngineError,
    },
    /// A thread cannot be started.
    #[error("an inference thread cannot be started: {0}; try fewer with --threads")]
    Thread(io::Error),
    /// A thread panicked while it warmed up.
    #[error("an inference thread panicked while it warmed up; the log says more")]
    WorkerPanicked,
    /// The address cannot be bound.
    #[error("{address} cannot be bound: {source}; name another address with --bind")]
    Bind {
        /// The address.
        address: SocketAddr,
        /// The system's reason.
        source: io::Error,
    },
}

impl StartError {
    /// The exit code of the binary for this error, as `--help` lists them.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Setting(_) => 2,
            Self::Missing { .. }
            | Self::Unusable { .. }
            | Self::Folder { .. }
            | Self::UnknownDefault { .. }
            | Self::Engine { .. } => 3,
            Self::Bind { .. } => 4,
            Self::Thread(_) | Self::WorkerPanicked => 1,
        }
    }
}

/// The service did not end in time.
#[derive(Debug, thiserror::Error)]
#[error("connections were still open after {seconds} s; they were cut off")]
pub struct DrainError {
    /// The time it had, s.
    pub seconds: u64,
}
