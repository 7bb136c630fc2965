//! What keeps a study from being made.

use papilla_fingertip::indenter::IndenterError;
use papilla_fingertip::simulation::body::SimulationError;
use papilla_output::OutputError;
use std::path::PathBuf;

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
    /// A file of an earlier run cannot be read.
    #[error("{}: {why}; delete it, and it is solved again", path.display())]
    Part {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        why: String,
    },
    /// A file cannot be read or written.
    #[error(transparent)]
    Output(#[from] OutputError),
}
