//! From a scanned surface to a finger that can be meshed.
//!
//! [`read::surface`] reads the file, [`clean::clean`] makes one closed skin of it and says what it
//! did, [`fit::fit`] fits the fingertip's template and the skin's offset from it. What no finger
//! can be made of is an error that names the place.

mod bone;
pub mod clean;
mod error;
pub mod fit;
mod least_squares;
mod nail;
pub mod picture;
pub mod placed;
pub mod read;
pub mod skin;

pub use error::ScanError;
pub use read::Unit;

/// Triangles and their corners.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    /// Corners, mm.
    pub vertices_mm: Vec<[f64; 3]>,
    /// Three indices of corners each.
    pub triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// Least and largest coordinates, mm.
    #[must_use]
    pub fn bounds_mm(&self) -> [[f64; 3]; 2] {
        let fold = |pick: fn(f64, f64) -> f64, from: f64| {
            std::array::from_fn(|i| self.vertices_mm.iter().map(|p| p[i]).fold(from, pick))
        };
        [fold(f64::min, f64::INFINITY), fold(f64::max, f64::NEG_INFINITY)]
    }

    /// Length of the diagonal of the box round it, mm.
    #[must_use]
    pub fn diagonal_mm(&self) -> f64 {
        let [low, high] = self.bounds_mm();
        (0..3).map(|i| (high[i] - low[i]).powi(2)).sum::<f64>().sqrt()
    }
}
