//! What can stop a campaign.

use papilla_dataset::DatasetError;
use papilla_fingertip::campaign::SpecError;
use papilla_fingertip::simulation::body::SimulationError;
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
    /// It has nothing to press, or to press with.
    #[error("the campaign has not got {0}")]
    Lacks(&'static str),
    /// Its finger cannot be made.
    #[error(transparent)]
    SetUp(#[from] SimulationError),
    /// The folder belongs to something else.
    #[error("{folder} holds {what}: choose another folder, or remove this one to start over")]
    Occupied {
        /// The output folder.
        folder: PathBuf,
        /// What is in it.
        what: &'static str,
    },
    /// Nothing has been solved there.
    #[error("{folder} holds no campaign that was begun")]
    NotBegun {
        /// The folder.
        folder: PathBuf,
    },
    /// Not every indentation is solved.
    #[error(
        "{missing} of {presses} indentations are not solved, the first: {first}. Run the campaign \
         on their slices, or without a slice, and merge again"
    )]
    Holes {
        /// How many are missing.
        missing: usize,
        /// Indentations of the campaign.
        presses: usize,
        /// The first few, with what is wrong with each.
        first: String,
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
