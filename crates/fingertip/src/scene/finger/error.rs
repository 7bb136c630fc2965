//! Why a finger's file was refused.

use super::super::cure::{material_field, parsed};
use super::super::materials::TissueError;
use super::super::origin::{Located, Origin};
use super::fields::FIELDS;
use crate::geometry::fingertip::{FingertipShapeError, SkinOffsetError};
use std::path::PathBuf;

/// Why a finger was refused.
#[derive(Debug, thiserror::Error)]
pub enum FingerError {
    /// A file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// No folder of that name.
    #[error(
        "there is no finger '{name}': none of {} is there. `fe-datagen finger new --out {name}` makes one",
        tried.join(", ")
    )]
    Missing {
        /// As it was asked for.
        name: String,
        /// The files that would have been it.
        tried: Vec<String>,
    },
    /// Not a finger's file.
    #[error("{message}")]
    Parse {
        /// What is wrong, with the cure.
        message: String,
    },
    /// Not a finger's file, and no line of it is to blame.
    #[error("{}: {message}", path.display())]
    Incomplete {
        /// The file.
        path: PathBuf,
        /// What is wrong, with the cure.
        message: String,
    },
    /// A number that no finger has.
    #[error(
        "{field} = {value:?} is not within {range}{}",
        if *metres { ": lengths are in mm, was m meant?" } else { "" }
    )]
    Range {
        /// Dotted.
        field: String,
        /// What stands there.
        value: f64,
        /// What may, with the unit.
        range: String,
        /// A thousandth of what may stand there.
        metres: bool,
    },
    /// Dimensions that contradict each other.
    #[error("{}", renamed(&.0.to_string()))]
    Shape(FingertipShapeError),
    /// A material out of range.
    #[error("{}", .0.to_string().replacen("materials.", "tissue.", 1))]
    Tissue(TissueError),
    /// Offsets of the skin that make no sense.
    #[error("{}: {source}", path.display())]
    Offset {
        /// Their file.
        path: PathBuf,
        /// What is wrong.
        source: SkinOffsetError,
    },
    /// No file of offsets.
    #[error("{}: {message}", path.display())]
    OffsetFile {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// Any of these, at its line.
    #[error(transparent)]
    Located(Box<Located<Self>>),
}

/// A message about a scene's shape in the words of a finger's file.
fn renamed(message: &str) -> String {
    let mut text = message.replace("geometry.shape: ", "").replace("geometry.shape.", "");
    // The longest first: bone_tip_mm is no part of another name then.
    for field in FIELDS.iter().filter(|f| f.shape != f.key) {
        text = text.replace(field.shape, &field.dotted());
    }
    text
}

impl FingerError {
    /// What a parser's error says of the file at `origin`.
    pub(super) fn parse(origin: &Origin, error: &toml::de::Error) -> Self {
        match parsed(origin, error, "docs/guides/fingers.md") {
            (message, None) => Self::Incomplete { path: origin.path().into(), message },
            (message, Some(place)) => {
                Self::Located(Box::new(Located { place, error: Self::Parse { message } }))
            }
        }
    }

    /// The same at its line of the file, if it has one.
    pub(super) fn at(self, origin: &Origin) -> Self {
        let field = match &self {
            Self::Range { field, .. } => field.split('[').next().unwrap_or_default().to_owned(),
            Self::Tissue(e) => material_field(e).replacen("materials.", "tissue.", 1),
            Self::Shape(e) => {
                let name = e.field();
                let name = name.rsplit('.').next().unwrap_or_default();
                let bare = name.split('[').next().unwrap_or_default();
                FIELDS.iter().find(|f| f.shape == bare).map_or_else(String::new, |f| f.dotted())
            }
            Self::Offset { .. } | Self::OffsetFile { .. } => "shape.skin".into(),
            _ => String::new(),
        };
        match (origin.find(&field), self) {
            (Some(place), error) if !field.is_empty() => {
                Self::Located(Box::new(Located { place, error }))
            }
            (_, error @ Self::Shape(_)) => {
                Self::Incomplete { path: origin.path().into(), message: error.to_string() }
            }
            (_, error) => error,
        }
    }
}
