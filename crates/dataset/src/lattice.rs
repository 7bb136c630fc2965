//! Where an atlas lies on the lattice of [`crate::Cells`].

use papilla_atlas::Raster;

/// Where the corners of a triangle of the atlas lie on the lattice of [`Cells`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleOnLattice {
    /// Side of the half cube.
    pub side: u32,
    /// Row and column of each corner.
    pub place: [[f64; 2]; 3],
}

/// Where on the lattice the middle of each pixel of a raster lies: its side, row and column. Of 32
/// bits, as `raster.npz` holds them.
pub(super) fn places<'a>(
    raster: &'a Raster,
    lattice: &'a [TriangleOnLattice],
) -> impl Iterator<Item = (u32, [f32; 2])> + 'a {
    raster.pixels().iter().map(|pixel| {
        let TriangleOnLattice { side, place } = lattice[pixel.triangle as usize];
        let corners = place.into_iter().zip(pixel.weights);
        let sum = |k: usize| corners.clone().map(|(c, w)| c[k] * f64::from(w)).sum::<f64>();
        (side, [sum(0) as f32, sum(1) as f32])
    })
}
