//! Why a campaign file is refused.

use crate::scene::{FingerError, SceneError};
use std::path::PathBuf;

/// A campaign that cannot be read, or makes no sense.
#[derive(Debug, thiserror::Error)]
pub enum SpecError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The campaign file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The TOML file cannot be understood.
    #[error("{path}: {message}")]
    Spec {
        /// The campaign file.
        path: PathBuf,
        /// Line and cause.
        message: String,
    },
    /// A value of the campaign makes no sense.
    #[error("campaign {campaign}: {field} {message}")]
    Value {
        /// Name of the campaign.
        campaign: String,
        /// The field.
        field: String,
        /// What is wrong and what is allowed.
        message: String,
    },
    /// The finger that the campaign names.
    #[error("campaign {campaign}: finger: {source}")]
    Finger {
        /// Name of the campaign.
        campaign: String,
        /// What is wrong with it.
        source: Box<FingerError>,
    },
    /// A value that a scene could not have either.
    #[error("campaign {campaign}, indenter '{indenter}': {source}")]
    Scene {
        /// Name of the campaign.
        campaign: String,
        /// Name of the indenter.
        indenter: String,
        /// What is wrong.
        source: Box<SceneError>,
    },
}
