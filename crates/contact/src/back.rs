//! The finger's back, of which a model has no skin.

use crate::clusters::Clusters;

/// The back is the mirror image of the skin that lies lower than this, mm, and whose normals have less
/// along z than this.
const BELOW_MM: f64 = -2.0;
const NORMAL_MAX: f32 = -0.7;

/// Places of the back: about as far from the middle of the finger's thickness as the pad is.
#[derive(Debug)]
pub(crate) struct Back {
    pub(crate) places_mm: Vec<[f64; 3]>,
    pub(crate) clusters: Clusters,
}

impl Back {
    /// Of a finger whose skin is this; its frame has the middle of the thickness at z = 0.
    pub(crate) fn of(positions_mm: &[[f64; 3]], normals: &[[f32; 3]]) -> Self {
        let is_pad = |(p, n): &(&[f64; 3], &[f32; 3])| p[2] < BELOW_MM && n[2] < NORMAL_MAX;
        let pad = positions_mm.iter().zip(normals).filter(is_pad);
        let places_mm: Vec<[f64; 3]> = pad.map(|([x, y, z], _)| [*x, *y, -z]).collect();
        let clusters = Clusters::new(&places_mm);
        Self { places_mm, clusters }
    }
}
