//! Makes the atlas: flattens the two surface patches and lays them out in one image.
//!
//! [`flatten`] unwraps a triangulated disc into the plane, by angle-based flattening or
//! by a conformal map. [`build_atlas`] flattens the skin and the interface below it,
//! orients and scales both alike and returns a checked [`crate::Atlas`]
//! with a report of how much each method distorts.
//!
//! Sources: A. Sheffer, E. de Sturler, 'Parameterization of faceted surfaces for meshing
//! using angle-based flattening', Engineering with Computers 17 (2001); A. Sheffer, B.
//! Levy, M. Mogilnitsky, A. Bogomyakov, 'ABF++: fast and robust angle based flattening',
//! ACM Trans. Graph. 24 (2005); B. Levy et al., 'Least squares conformal maps', ACM Trans.
//! Graph. 21 (2002); P. Mullen et al., 'Spectral conformal parameterization', SGP 2008.

mod abf;
mod angles;
mod conformal;
mod disc;
mod distortion;
mod error;
mod layout;
mod sparse;

#[cfg(test)]
mod shapes;
#[cfg(test)]
mod tests;

use disc::Disc;
use serde::Serialize;

pub use abf::Convergence;
pub use distortion::{Distortion, Spread};
pub use error::{BuildAtlasError, FlattenError};
pub use layout::{AtlasReport, MethodReport, PatchReport, build_atlas};

/// How to flatten.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Angle-based flattening (Sheffer & de Sturler 2001, solved as in ABF++ 2005): the
    /// corner angles are the unknowns, and the sum of their squared relative changes is
    /// least among all angles that fit together in the plane.
    AngleBased,
    /// Least-squares conformal map (Levy et al. 2002) with the two boundary vertices
    /// that are farthest apart pinned.
    LeastSquaresConformal,
    /// Spectral conformal map (Mullen et al. 2008): no pins, the same conformal energy
    /// under a fixed size of the boundary.
    SpectralConformal,
}

impl Method {
    /// All methods, the one the atlas uses first.
    pub const ALL: [Self; 3] =
        [Self::AngleBased, Self::LeastSquaresConformal, Self::SpectralConformal];
}

/// A surface patch laid flat.
#[derive(Clone, Debug)]
pub struct Flattening {
    /// Place of each vertex in the plane, in the unit of the positions. Seen with the
    /// first axis to the right and the second up, triangles keep the sense in which
    /// they were wound. The whole area is that of the surface; the centroid of the
    /// boundary box and the direction are not fixed.
    pub uv: Vec<[f64; 2]>,
    /// How the corner angles converged; `None` for methods that solve one linear problem.
    pub convergence: Option<Convergence>,
    /// What the map does to angles and areas.
    pub distortion: Distortion,
}

/// Flattens a triangulated disc.
///
/// `positions` are any length unit; `triangles` are all wound in one sense.
///
/// # Errors
/// [`FlattenError`]: not a disc, not a manifold, a degenerate triangle, or no convergence.
pub fn flatten(
    positions: &[[f64; 3]],
    triangles: &[[u32; 3]],
    method: Method,
) -> Result<Flattening, FlattenError> {
    let disc = Disc::new(positions, triangles)?;
    let surface_angles = angles::corner_angles(positions, &disc.triangles)?;
    let (mut uv, convergence) = match method {
        Method::AngleBased => {
            let flat = abf::flat_angles(&disc, &surface_angles)?;
            (conformal::pinned(&disc, positions, &flat.angles)?, Some(flat.convergence))
        }
        Method::LeastSquaresConformal => {
            (conformal::pinned(&disc, positions, &surface_angles)?, None)
        }
        Method::SpectralConformal => {
            (conformal::spectral(&disc, positions, &surface_angles)?, None)
        }
    };
    distortion::keep_area(positions, &disc, &mut uv)?;
    let distortion = distortion::measure(positions, &disc, &surface_angles, &uv);
    Ok(Flattening { uv, convergence, distortion })
}
