//! Why a scene was refused.

use super::materials::TissueError;
use super::origin::{Located, Origin, Place};
use crate::indenter::IndenterError;
use crate::materials::MaterialError;
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
    /// An effect that the scene cannot have.
    #[error("effect '{effect}': {why}")]
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
        let said = error.message();
        match origin.blamed(error.span(), said) {
            Some((field, place)) => {
                let colon = if field.is_empty() { "" } else { ": " };
                let message = format!("{field}{colon}{said}{}", cure(said));
                Self::Parse { message }.with(Some(place))
            }
            None => Self::Incomplete {
                path: origin.path().into(),
                message: format!("{said}{}", cure(said)),
            },
        }
    }

    /// The field that is to blame, dotted; of an effect its name in the list
    /// stands for its place there.
    #[must_use]
    pub fn field(&self) -> Option<String> {
        match self {
            Self::Value { field, .. } => Some(field.clone()),
            Self::Fields { field, .. } => Some((*field).into()),
            Self::Effect { effect, .. } => Some(format!("effects[{effect}]")),
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

/// What to do about a parser's message, where it does not say so itself.
pub(super) fn cure(message: &str) -> String {
    let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    if let (Some(missing), true) = (quoted.first(), message.starts_with("missing field")) {
        return format!(": add it (docs/reference/scenes.md has `{missing}` with its unit)");
    }
    if message.starts_with("unknown field") {
        let meant =
            |known: &&&str| known.strip_prefix(quoted[0]).is_some_and(|r| r.starts_with('_'));
        return quoted.iter().skip(1).find(meant).map_or_else(String::new, |meant| {
            format!("; did you mean `{meant}`? Units stand in the names of fields")
        });
    }
    if message.starts_with("invalid type: string") && message.ends_with("expected f64") {
        return ": write a bare number, its unit stands in the name of the field".into();
    }
    String::new()
}

/// The field that a material's error is about.
pub(crate) fn material_field(error: &TissueError) -> String {
    let field = match error.source {
        MaterialError::YoungsModulus(_) | MaterialError::Units { .. } => ".youngs_modulus_mpa",
        MaterialError::PoissonsRatio(_) => ".poissons_ratio",
        MaterialError::OgdenTerms { .. }
        | MaterialError::OgdenUnstable(_)
        | MaterialError::OgdenUnits(_) => ".ogden.mu_mpa",
        MaterialError::OgdenExponent(_) => ".ogden.alpha",
        MaterialError::Calibrated(..) => ".ogden.calibrated_stretch",
        MaterialError::PronyTerms { .. } | MaterialError::PronyShare(_) => ".prony.share",
        MaterialError::PronyTime(_) => ".prony.time_s",
        MaterialError::Biphasic(e) => {
            return format!("materials.{}.biphasic.{}", error.tissue, e.field());
        }
    };
    format!("materials.{}{field}", error.tissue)
}

/// The field that an indenter's error is about.
pub(crate) fn indenter_field(error: &IndenterError) -> String {
    match error {
        IndenterError::Value(e) => e.field.clone(),
        IndenterError::Picture { .. } => "indenter.file".into(),
        IndenterError::NeverTouches | IndenterError::StartsInside { .. } => {
            "motion.offset_mm".into()
        }
        IndenterError::FinerThanMesh { .. } | IndenterError::FinerThanCells { .. } => {
            "indenter".into()
        }
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
