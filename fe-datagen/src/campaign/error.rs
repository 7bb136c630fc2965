//! What can stop a campaign.

use crate::dataset::DatasetError;
use crate::output::OutputError;
use crate::scene::SceneError;
use std::path::PathBuf;

/// Any error of a solver; its text goes into the manifest.
pub type BoxError = Box<dyn std::error::Error + Send + Sync>;

/// A campaign cannot start or go on. A press that does not converge is none of
/// these: it is recorded and the campaign continues.
#[derive(Debug, thiserror::Error)]
pub enum CampaignError {
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
    /// The folder belongs to something else.
    #[error("{folder} holds {what}: choose another --out, or remove the folder to start over")]
    Occupied {
        /// The output folder.
        folder: PathBuf,
        /// What is in it.
        what: &'static str,
    },
    /// Another process writes there now.
    #[error("another process is generating into {folder}: wait for it or choose another --out")]
    Busy {
        /// The output folder.
        folder: PathBuf,
    },
    /// No solver could be built, so no press can be solved.
    #[error("cannot set up the solver: {0}")]
    Setup(#[source] BoxError),
    /// Every press failed; there is no dataset.
    #[error("all {presses} presses failed, the first with: {first}")]
    NothingSolved {
        /// Number of presses.
        presses: usize,
        /// The first press' error.
        first: String,
    },
    /// A file cannot be written or read.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The dataset cannot be written.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
}
