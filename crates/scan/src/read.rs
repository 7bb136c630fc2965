//! Surfaces of fingers, from files.

use super::{ScanError, Surface};
use std::path::Path;

/// Unit of lengths in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Millimetre.
    Millimetre,
    /// Centimetre.
    Centimetre,
    /// Metre.
    Metre,
    /// Inch.
    Inch,
    /// Micrometre.
    Micrometre,
}

impl Unit {
    /// All of them, the likeliest first.
    pub const ALL: [Self; 5] =
        [Self::Millimetre, Self::Metre, Self::Centimetre, Self::Inch, Self::Micrometre];

    /// As it is written.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Millimetre => "mm",
            Self::Centimetre => "cm",
            Self::Metre => "m",
            Self::Inch => "in",
            Self::Micrometre => "um",
        }
    }

    /// Its length, mm.
    #[must_use]
    pub const fn mm(self) -> f64 {
        match self {
            Self::Millimetre => 1.0,
            Self::Centimetre => 10.0,
            Self::Metre => 1e3,
            Self::Inch => 25.4,
            Self::Micrometre => 1e-3,
        }
    }

    /// The unit of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|u| u.name() == name)
    }
}

/// Size from corner to corner of what is believed a finger or a hand, mm.
const SIZE_MM: [f64; 2] = [12.0, 450.0];

/// Reads a surface; the ending of the name says which kind it is.
///
/// # Errors
/// [`ScanError::File`]; [`ScanError::Unit`] if it has a finger's size in another unit alone.
pub fn surface(path: &Path, unit: Unit) -> Result<Surface, ScanError> {
    let papilla_sdf::Mesh { vertices_mm, triangles } =
        papilla_sdf::files::surface(path, unit.mm())?;
    let surface = Surface { vertices_mm, triangles };
    believed(&surface, unit, path)?;
    Ok(surface)
}

/// Refuses a size that no finger has.
fn believed(surface: &Surface, unit: Unit, path: &Path) -> Result<(), ScanError> {
    let mm = surface.diagonal_mm();
    let is_a_size = |mm: f64| (SIZE_MM[0]..=SIZE_MM[1]).contains(&mm);
    if is_a_size(mm) {
        return Ok(());
    }
    let diagonal = mm / unit.mm();
    let meant: Vec<_> = Unit::ALL.into_iter().filter(|u| is_a_size(diagonal * u.mm())).collect();
    let Some(first) = meant.first() else {
        return Err(ScanError::Size { path: path.into(), diagonal, unit: unit.name() });
    };
    let word = |u: &Unit| match u {
        Unit::Millimetre => "millimetres",
        Unit::Centimetre => "centimetres",
        Unit::Metre => "metres",
        Unit::Inch => "inches",
        Unit::Micrometre => "micrometres",
    };
    Err(ScanError::Unit {
        path: path.into(),
        diagonal,
        unit: unit.name(),
        meant: meant.iter().map(word).collect::<Vec<_>>().join(" or "),
        first: first.name(),
    })
}
