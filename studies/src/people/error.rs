//! What keeps the comparison from being made.

use papilla_fingertip::indenter::IndenterError;
use papilla_fingertip::simulation::body::SimulationError;
use papilla_output::OutputError;
use papilla_validation::stored::StoredError;
use std::path::PathBuf;

/// Why a comparison stopped.
#[derive(Debug, thiserror::Error)]
pub enum PeopleError {
    /// The measurements cannot be read.
    #[error("{}: {why}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        why: String,
    },
    /// A row of a person's own record makes no sense.
    #[error("{}:{line}: {why}", path.display())]
    Record {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
        /// Why, and what to do.
        why: String,
    },
    /// A measurement makes no sense.
    #[error("{field} {rule}; found {found}")]
    Field {
        /// Where it stands in the file, dotted.
        field: String,
        /// What it has to be.
        rule: &'static str,
        /// What it is.
        found: String,
    },
    /// An indenter goes as deep as it may and has not met its force.
    #[error(
        "{press}: the force ends at {reached_n:.3} N, {depth_mm:.2} mm deep{}, short of {wanted_n} N. \
         Take a smaller force or a larger indenter",
        why.as_deref().map(|w| format!(" ({w})")).unwrap_or_default()
    )]
    Force {
        /// The press.
        press: String,
        /// Force asked for, N.
        wanted_n: f64,
        /// Largest force met, N.
        reached_n: f64,
        /// Depth there, mm.
        depth_mm: f64,
        /// Why it went no deeper, if not for its limit.
        why: Option<String>,
    },
    /// A press cannot be set up or solved.
    #[error("{press}: {source}")]
    Press {
        /// The press.
        press: String,
        /// Why.
        source: Box<SimulationError>,
    },
    /// An indenter cannot be built.
    #[error("{press}: {source}")]
    Indenter {
        /// The press.
        press: String,
        /// Why.
        source: IndenterError,
    },
    /// A receptor lies outside of the finger's mesh.
    #[error("{press}: {why}")]
    Receptor {
        /// The press.
        press: String,
        /// Which, and where.
        why: String,
    },
    /// What an earlier run stored is of no use.
    #[error(transparent)]
    Stored(#[from] StoredError),
    /// A file cannot be read or written.
    #[error(transparent)]
    Output(#[from] OutputError),
}
