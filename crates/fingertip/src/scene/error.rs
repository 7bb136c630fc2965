//! Why a scene was refused.

use super::cure::{material_field, parsed};
use super::materials::TissueError;
use super::origin::{Located, Origin, Place};
use crate::indenter::IndenterError;
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
    /// Not a scene.
    #[error("{message}")]
    Parse {
        /// What is wrong, with field and cure.
        message: String,
    },
    /// Not a scene, and no line of it is to blame.
    #[error("{}: {message}", path.display())]
    Incomplete {
        /// The file.
        path: PathBuf,
        /// What is missing, with the cure.
        message: String,
    },
    /// A value makes no sense.
    #[error("{field} = {value} {rule}")]
    Value {
        /// Field, dotted.
        field: String,
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
    /// A map of pressure that cannot be read, or cannot press.
    #[error("{field}: {message}")]
    Pressure {
        /// Field, dotted.
        field: &'static str,
        /// What is wrong, with the file.
        message: String,
    },
    /// An effect that the scene cannot have.
    #[error("effect '{effect}': {why}")]
    Effect {
        /// The effect.
        effect: &'static str,
        /// Why not, and the cure.
        why: String,
    },
    /// An effect with which the tissues were fitted, and which the scene does not name.
    #[error(
        "effects: '{effect}' is missing. The constants of the tissues were fitted with it (`needs` in \
         [materials], or in [tissue] of the finger): name it in effects, or take it out of `needs`"
    )]
    Unnamed {
        /// The effect.
        effect: String,
    },
    /// A material out of range.
    #[error(transparent)]
    Material(#[from] TissueError),
    /// A section that contradicts itself.
    #[error(transparent)]
    Section(#[from] crate::geometry::section::SectionShapeError),
    /// An indenter out of range.
    #[error(transparent)]
    Indenter(#[from] IndenterError),
    /// A fingertip whose dimensions make no sense.
    #[error(transparent)]
    Shape(#[from] crate::geometry::fingertip::FingertipShapeError),
    /// A finger's file.
    #[error(transparent)]
    Finger(#[from] super::finger::FingerError),
    /// Any of these, at its line.
    #[error(transparent)]
    Located(Box<Located<Self>>),
}

impl SceneError {
    /// What a parser's error says of the scene at `origin`.
    pub(super) fn parse(origin: &Origin, error: &toml::de::Error) -> Self {
        match parsed(origin, error, "docs/reference/scenes.md") {
            (message, None) => Self::Incomplete { path: origin.path().into(), message },
            (message, place) => Self::Parse { message }.with(place),
        }
    }

    /// The field that is to blame, dotted; of an effect its name in the list
    /// stands for its place there.
    #[must_use]
    pub fn field(&self) -> Option<String> {
        match self {
            Self::Value { field, .. } => Some(field.clone()),
            Self::Fields { field, .. } | Self::Pressure { field, .. } => Some((*field).into()),
            Self::Effect { effect, .. } => Some(format!("effects[{effect}]")),
            Self::Unnamed { .. } => Some("effects".into()),
            Self::Material(e) => Some(material_field(e)),
            Self::Indenter(e) => Some(indenter_field(e)),
            Self::Shape(e) => Some(e.field()),
            Self::Section(e) => Some(e.field()),
            // Others have a line of the finger's own file.
            Self::Finger(super::finger::FingerError::Missing { .. }) => {
                Some("geometry.finger".into())
            }
            Self::Located(e) => e.error.field(),
            _ => None,
        }
    }

    /// The same with the line of `scene` that is to blame, if there is one.
    #[must_use]
    pub fn at(self, scene: &super::Scene) -> Self {
        let place = self.field().and_then(|field| scene.place(&field));
        self.with(place)
    }

    /// The same with a place.
    pub(super) fn with(self, place: Option<Place>) -> Self {
        match (self, place) {
            (located @ Self::Located(_), _) | (located, None) => located,
            (error, Some(place)) => Self::Located(Box::new(Located { place, error })),
        }
    }
}

/// The field that an indenter's error is about.
pub(crate) fn indenter_field(error: &IndenterError) -> String {
    match error {
        IndenterError::Value(e) => e.field.clone(),
        IndenterError::Picture { .. } | IndenterError::MeshFile { .. } => "indenter.file".into(),
        IndenterError::NeverTouches | IndenterError::StartsInside { .. } => {
            "motion.offset_mm".into()
        }
        IndenterError::FinerThanMesh { .. }
        | IndenterError::FinerThanCells { .. }
        | IndenterError::BetweenNodes { .. } => "indenter".into(),
        IndenterError::BeyondBone { .. } => "motion.depth_mm".into(),
    }
}

/// `Ok` if a value keeps its rule.
pub(super) fn require(
    ok: bool,
    field: impl Into<String>,
    value: &dyn std::fmt::Debug,
    rule: &'static str,
) -> Result<(), SceneError> {
    let value = || format!("{value:?}");
    if ok { Ok(()) } else { Err(SceneError::Value { field: field.into(), value: value(), rule }) }
}

/// Whether a length is positive and finite.
pub(super) fn is_length(v: f64) -> bool {
    v.is_finite() && v > 0.0
}
