//! What keeps a study from being made.

use crate::stored::StoredError;
use papilla_fingertip::indenter::IndenterError;
use papilla_fingertip::simulation::body::SimulationError;
use papilla_output::OutputError;

/// Why a convergence study stopped.
#[derive(Debug, thiserror::Error)]
pub enum ConvergenceError {
    /// A case cannot be set up.
    #[error("case {case}: {source}")]
    Case {
        /// Its name.
        case: &'static str,
        /// Why.
        source: Box<SimulationError>,
    },
    /// An indenter cannot be built.
    #[error("case {case}: {source}")]
    Indenter {
        /// The case's name.
        case: &'static str,
        /// Why.
        source: IndenterError,
    },
    /// An indenter's description cannot be read, or it passes the finger.
    #[error("case {case}: {why}")]
    Description {
        /// The case's name.
        case: &'static str,
        /// Why.
        why: String,
    },
    /// What an earlier run stored is of no use.
    #[error(transparent)]
    Stored(#[from] StoredError),
    /// A file cannot be read or written.
    #[error(transparent)]
    Output(#[from] OutputError),
}
