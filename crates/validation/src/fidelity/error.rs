//! What can stop a measurement of fidelity levels.

use papilla_atlas::flatten::BuildAtlasError;
use papilla_fingertip::campaign::SpecError;
use papilla_fingertip::indenter::IndenterError;
use papilla_fingertip::simulation::body::SimulationError;
use papilla_output::OutputError;
use std::path::PathBuf;

/// The fidelity levels cannot be measured. An indentation that finds no equilibrium is none of
/// these: it is reported among those left out.
#[derive(Debug, thiserror::Error)]
pub enum FidelityError {
    /// The campaign makes no sense.
    #[error(transparent)]
    Campaign(#[from] SpecError),
    /// A fidelity level's finger cannot be set up.
    #[error("{level}: {source}")]
    FidelityLevel {
        /// Name of the fidelity level.
        level: String,
        /// Why.
        source: Box<SimulationError>,
    },
    /// The atlas cannot be flattened.
    #[error(transparent)]
    Atlas(#[from] BuildAtlasError),
    /// A fidelity level's body is not a fingertip.
    #[error("the body of {level} has no atlas patch")]
    NoPatch {
        /// Name of the fidelity level.
        level: String,
    },
    /// An indenter cannot be built.
    #[error(transparent)]
    Indenter(#[from] IndenterError),
    /// Not enough indentations are held out.
    #[error(
        "campaign {campaign} holds out {found} indentations, {wanted} are asked for: ask for fewer, or \
         raise its test_fraction"
    )]
    TooFew {
        /// Name of the campaign.
        campaign: String,
        /// Held out.
        found: usize,
        /// Asked for.
        wanted: usize,
    },
    /// The folder belongs to another measurement.
    #[error(
        "{folder} holds fidelity levels of another campaign, finger or version: choose another --out, or \
         remove the folder to start over"
    )]
    Occupied {
        /// The folder.
        folder: PathBuf,
    },
    /// No state was solved by every fidelity level.
    #[error("no state was solved at every fidelity level; the first left out: {first}")]
    NothingSolved {
        /// The first.
        first: String,
    },
    /// A file cannot be written or read.
    #[error(transparent)]
    Output(#[from] OutputError),
}
