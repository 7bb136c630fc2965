//! A surface, and how far a point of the finger's frame is from it.

use crate::{ScanError, Surface};
use papilla_sdf::{Mesh, MeshDistance, Placement};
use papilla_vector::dot;

/// A surface in the finger's frame.
pub struct Placed {
    corners_mm: Vec<[f64; 3]>,
    distance: MeshDistance,
    placement: Placement,
}

impl Placed {
    pub(crate) fn new(surface: &Surface, placement: Placement) -> Result<Self, ScanError> {
        let used: std::collections::BTreeSet<u32> =
            surface.triangles.iter().flatten().copied().collect();
        let corners_mm = used.iter().map(|&c| surface.vertices_mm[c as usize]).collect();
        Ok(Self { corners_mm, distance: distance_of(surface)?, placement })
    }

    /// Its corners in the finger's frame, mm.
    pub(crate) fn corners_mm(&self) -> Vec<[f64; 3]> {
        let Placement { rotation, origin_mm } = self.placement;
        let moved = |p: &[f64; 3]| std::array::from_fn(|i| dot(rotation[i], *p) + origin_mm[i]);
        self.corners_mm.iter().map(moved).collect()
    }

    /// Signed distance of a point of the finger's frame, mm.
    #[must_use]
    pub fn gap_mm(&self, p: [f64; 3]) -> f64 {
        self.placement.distance(&self.distance, p).gap_mm
    }

    /// Signed distance and its gradient.
    #[must_use]
    pub fn gap_and_normal(&self, p: [f64; 3]) -> (f64, [f64; 3]) {
        let found = self.placement.distance(&self.distance, p);
        (found.gap_mm, found.normal)
    }
}

pub(crate) fn distance_of(surface: &Surface) -> Result<MeshDistance, ScanError> {
    let mesh =
        Mesh { vertices_mm: surface.vertices_mm.clone(), triangles: surface.triangles.clone() };
    Ok(mesh.build_open()?)
}
