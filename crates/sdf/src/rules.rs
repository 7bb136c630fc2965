//! Checks the dimensions of indenters, and names the field of one that makes no shape.

use std::fmt::Debug;
use std::path::PathBuf;

/// Largest dimension of an indenter, mm.
pub(super) const LENGTH_MAX_MM: f64 = 1000.0;

/// A dimension that makes no sense.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{field} = {value} {rule}")]
pub struct BadValue {
    /// Field, dotted.
    pub field: String,
    /// What was found.
    pub value: String,
    /// What it has to be.
    pub rule: &'static str,
}

/// Why a description is not a shape.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// A dimension makes no sense.
    #[error(transparent)]
    Value(#[from] BadValue),
    /// A picture cannot be taken as a height map.
    #[error("{} cannot be a height map: {message}", path.display())]
    Picture {
        /// The picture.
        path: PathBuf,
        /// Why, and the cure.
        message: String,
    },
    /// A file cannot be taken as a mesh.
    #[error("{} is no mesh to press with: {message}", path.display())]
    MeshFile {
        /// The file.
        path: PathBuf,
        /// Why, and the cure.
        message: String,
    },
}

impl BadValue {
    /// The same inside a table.
    pub(super) fn under(mut self, table: &str) -> Self {
        self.field = format!("{table}.{}", self.field);
        self
    }
}

/// `Ok` if the rule holds.
pub(super) fn require(
    ok: bool,
    field: &str,
    value: &dyn Debug,
    rule: &'static str,
) -> Result<(), BadValue> {
    if ok {
        Ok(())
    } else {
        Err(BadValue { field: field.into(), value: format!("{value:?}"), rule })
    }
}

/// A length has to be positive and not absurd.
pub(super) fn length(field: &str, value_mm: f64) -> Result<(), BadValue> {
    let ok = value_mm > 0.0 && value_mm <= LENGTH_MAX_MM;
    require(ok, field, &value_mm, "has to be positive and at most 1000 mm")
}

/// Lengths, each positive and not absurd.
pub(super) fn lengths(field: &str, values_mm: &[f64]) -> Result<(), BadValue> {
    let ok = values_mm.iter().all(|&v| v > 0.0 && v <= LENGTH_MAX_MM);
    require(ok, field, &values_mm, "has to be positive and at most 1000 mm")
}

/// Most parts of a union.
const PARTS_MAX: usize = 64;

/// A union of so many parts.
pub(super) fn parts(count: usize) -> Result<(), BadValue> {
    require((1..=PARTS_MAX).contains(&count), "parts", &count, "has to list 1 to 64 parts")
}

/// Where a part of a union lies, mm, and its pitch, roll and yaw, degrees.
pub(super) fn placed(at_mm: [f64; 3], turns_deg: [f64; 3]) -> Result<(), BadValue> {
    let near = at_mm.iter().all(|v| v.abs() <= LENGTH_MAX_MM);
    require(near, "at_mm", &at_mm, "has to be within 1000 mm")?;
    for (field, turn) in ["pitch_deg", "roll_deg", "yaw_deg"].into_iter().zip(turns_deg) {
        require(turn.abs() <= 180.0, field, &turn, "has to be within -180 to 180")?;
    }
    Ok(())
}

/// A radius that rounds edges has to be positive, or the normal would jump
/// there, and leave the faces between them.
pub(super) fn rounding(
    field: &str,
    radius_mm: f64,
    most_mm: f64,
    rule: &'static str,
) -> Result<(), BadValue> {
    require(radius_mm > 0.0 && radius_mm <= most_mm, field, &radius_mm, rule)
}
