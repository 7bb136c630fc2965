//! A finger of one's own: `finger.toml`, and the folder that it lies in.
//!
//! The folder is the finger's *bundle*. Beside `finger.toml` it may hold `skin.json` (how far the
//! skin lies from the template's), the atlas, the contact model and networks that were made of it.

mod error;
mod fields;
mod file;

pub use error::FingerError;
pub use fields::{FIELDS, Field};
pub use file::{Source, Thickness};

use super::materials::TissueTable;
use super::origin::Origin;
use crate::geometry::fingertip::offset::COLUMNS;
use crate::geometry::fingertip::{FingertipShape, SkinOffset};
use file::FingerFile;
use papilla_dataset::sha256_hex;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Name of the file in its folder.
pub const FINGER_FILE: &str = "finger.toml";
/// Name of the file of the skin's offsets.
pub const SKIN_FILE: &str = "skin.json";

/// A finger as its file describes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Finger {
    /// Dimensions, with the skin's offset if the file names one.
    pub shape: FingertipShape,
    /// What its tissues are made of.
    pub tissue: TissueTable,
    /// Where it is from.
    pub source: Source,
}

impl Finger {
    /// The template with its usual dimensions and tissues.
    #[must_use]
    pub fn usual() -> Self {
        Self {
            shape: FingertipShape::default(),
            tissue: TissueTable::default(),
            source: Source::default(),
        }
    }

    /// Reads and checks a finger: its folder, or the file in it.
    ///
    /// # Errors
    /// [`FingerError`] names file and line, or the place of the finger.
    pub fn read(path: &Path) -> Result<Self, FingerError> {
        let path = if path.is_dir() { path.join(FINGER_FILE) } else { path.to_path_buf() };
        let text = papilla_json::read_text(&path)
            .map_err(|source| FingerError::Read { path: path.clone(), source })?;
        Self::parse(&path, text)
    }

    /// Reads and checks the text of a finger's file; `path` is where it would stand.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn parse(path: &Path, text: String) -> Result<Self, FingerError> {
        let origin = Origin::new(path, text);
        let file: FingerFile =
            toml::from_str(origin.text()).map_err(|e| FingerError::parse(&origin, &e))?;
        let offset = match &file.skin() {
            Some(name) => {
                let path = path.parent().unwrap_or(Path::new("")).join(name);
                Some(Arc::new(read_offset(&path).map_err(|e| e.at(&origin))?))
            }
            None => None,
        };
        let finger = file.into_finger(offset);
        finger.validate().map_err(|e| e.at(&origin))?;
        Ok(finger)
    }

    /// The finger that a file in `folder` calls `name`: a path from that folder or from the current
    /// one, or the name of a folder in `fingers/` there.
    ///
    /// # Errors
    /// [`FingerError::Missing`] lists where it was looked for; else as [`Self::read`].
    pub fn find(name: &Path, folder: &Path) -> Result<Self, FingerError> {
        let mut tried: Vec<PathBuf> = Vec::new();
        for base in [folder, Path::new("")] {
            tried.push(base.join(name));
            tried.push(base.join("fingers").join(name));
        }
        let file = |path: &PathBuf| {
            let is_file = path.extension().is_some_and(|e| e == "toml");
            if is_file { path.clone() } else { path.join(FINGER_FILE) }
        };
        let mut tried: Vec<PathBuf> = tried.iter().map(file).collect();
        tried.dedup();
        match tried.iter().find(|path| path.is_file()) {
            Some(path) => Self::read(path),
            None => Err(FingerError::Missing {
                name: name.display().to_string(),
                tried: tried.iter().map(|path| path.display().to_string()).collect(),
            }),
        }
    }

    /// Checks every number and that skin, layers and bone lie in their order.
    ///
    /// # Errors
    /// [`FingerError`] for the first that is wrong.
    pub fn validate(&self) -> Result<(), FingerError> {
        for field in &FIELDS {
            let [low, high] = field.range;
            let values = field.values(&self.shape);
            if let Some(k) = values.iter().position(|v| !(low <= *v && *v <= high)) {
                let value = values[k];
                let in_mm = 1e3 * value;
                let place = match field.map(&self.shape) {
                    Some(_) => format!("[{}][{}]", k / COLUMNS, k % COLUMNS),
                    None => String::new(),
                };
                return Err(FingerError::Range {
                    field: field.dotted() + &place,
                    value,
                    range: field.range_words(),
                    metres: field.unit == "mm" && low <= in_mm && in_mm <= high,
                });
            }
        }
        self.shape.validate().map_err(FingerError::Shape)?;
        self.tissue.validate().map_err(FingerError::Tissue)?;
        self.shape.validate_layers().map_err(FingerError::Shape)
    }

    /// Hash of what a mesh and its tissues depend on: comments, the source and the file's name do
    /// not change it.
    #[must_use]
    pub fn sha256(&self) -> String {
        sha256_of(&self.shape, &self.tissue)
    }

    /// The text of its file, each number with its unit, default and range.
    #[must_use]
    pub fn to_toml(&self) -> String {
        file::written(self)
    }
}

/// See [`Finger::sha256`].
pub(crate) fn sha256_of(shape: &FingertipShape, tissue: &TissueTable) -> String {
    #[derive(Serialize)]
    struct Content<'a>(&'a FingertipShape, Option<&'a SkinOffset>, &'a TissueTable);
    let content = Content(shape, shape.offset.as_deref(), tissue);
    // Tables of finite numbers are always written.
    let mut text = serde_json::to_vec(&content).unwrap_or_default();
    // Fingers without a map keep the hash that they had before there were maps.
    for (name, map) in [("epidermis", &shape.epidermis_map), ("dermis", &shape.dermis_map)] {
        if let Some(map) = map {
            text.extend(serde_json::to_vec(&(name, map.rows_mm())).unwrap_or_default());
        }
    }
    sha256_hex(&text)
}

fn read_offset(path: &Path) -> Result<SkinOffset, FingerError> {
    let failed = |message: String| FingerError::OffsetFile { path: path.into(), message };
    let text = papilla_json::read_text(path)
        .map_err(|source| FingerError::Read { path: path.into(), source })?;
    let offset: SkinOffset =
        papilla_json::read(text.as_bytes()).map_err(|e| failed(e.to_string()))?;
    offset.validate().map_err(|source| FingerError::Offset { path: path.into(), source })?;
    Ok(offset)
}

#[cfg(test)]
mod tests;
