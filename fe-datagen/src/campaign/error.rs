//! What can stop a campaign.

use papilla_dataset::DatasetError;
use papilla_fingertip::campaign::SpecError;
use papilla_output::OutputError;
use std::path::PathBuf;

/// Any error of a solver; its text goes into the manifest.
pub type BoxError = Box<dyn std::error::Error + Send + Sync>;

/// A campaign cannot start or go on. An indentation that does not converge is none of
/// these: it is recorded and the campaign continues.
#[derive(Debug, thiserror::Error)]
pub enum CampaignError {
    /// The campaign cannot be read, or makes no sense.
    #[error(transparent)]
    Spec(#[from] SpecError),
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
    /// No solver could be built, so no indentation can be solved.
    #[error("cannot set up the solver: {0}")]
    Simulation(#[source] BoxError),
    /// Every indentation failed; there is no dataset.
    #[error("all {presses} indentations failed, the first with: {first}")]
    NothingSolved {
        /// Number of indentations.
        presses: usize,
        /// The first indentation' error.
        first: String,
    },
    /// A file cannot be written or read.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The dataset cannot be written.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
}
