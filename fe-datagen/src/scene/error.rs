//! Why a scene was refused.

use super::materials::TissueError;
use std::path::PathBuf;

/// Why a scene was refused. Nothing has been written then.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Not a scene; the text points at the line.
    #[error("{} is not a scene: {message}", path.display())]
    Parse {
        /// The file.
        path: PathBuf,
        /// Parser's message with line and column.
        message: String,
    },
    /// A value makes no sense.
    #[error("{field} = {value} {rule}")]
    Value {
        /// Field, dotted.
        field: &'static str,
        /// What was found.
        value: String,
        /// What it has to be.
        rule: &'static str,
    },
    /// Fields that contradict each other.
    #[error("{field}: {rule}")]
    Fields {
        /// Field, dotted.
        field: &'static str,
        /// What it has to be.
        rule: &'static str,
    },
    /// An effect that the scene cannot have.
    #[error("effect '{effect}' {why}")]
    Effect {
        /// The effect.
        effect: &'static str,
        /// Why not, and the cure.
        why: String,
    },
    /// A material out of range.
    #[error(transparent)]
    Material(#[from] TissueError),
    /// A section that contradicts itself.
    #[error(transparent)]
    Section(#[from] crate::geometry::section::SectionShapeError),
    /// An indenter out of range.
    #[error(transparent)]
    Indenter(#[from] crate::indenter::IndenterError),
}

/// `Ok` if a value keeps its rule.
pub(super) fn require(
    ok: bool,
    field: &'static str,
    value: &dyn std::fmt::Debug,
    rule: &'static str,
) -> Result<(), SceneError> {
    if ok { Ok(()) } else { Err(SceneError::Value { field, value: format!("{value:?}"), rule }) }
}

/// Whether a length is positive and finite.
pub(super) fn is_length(v: f64) -> bool {
    v.is_finite() && v > 0.0
}
