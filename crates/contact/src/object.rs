//! One object that can press on a finger.

use papilla_sdf::{Body, Placement, SignedDistance};
use std::sync::Arc;

/// A rigid or soft object in the finger's frame.
#[derive(Clone)]
pub struct Object {
    /// Its shape.
    pub shape: Arc<dyn SignedDistance>,
    /// Where it is.
    pub placement: Placement,
    /// Stiffness of its surface, MPa/mm: pressure over how far it gives way there. Infinite for
    /// a rigid one.
    pub stiffness_mpa_per_mm: f64,
    /// Coulomb's coefficient of friction; 0 of a slippery one. An object that has it keeps its
    /// place in the list from frame to frame.
    pub friction: f64,
}

impl Object {
    /// A rigid object.
    #[must_use]
    pub fn rigid(shape: Arc<dyn SignedDistance>, placement: Placement) -> Self {
        Self { shape, placement, stiffness_mpa_per_mm: f64::INFINITY, friction: 0.0 }
    }
}

impl Body for Object {
    fn shape(&self) -> &dyn SignedDistance {
        self.shape.as_ref()
    }

    fn placement(&self) -> &Placement {
        &self.placement
    }
}

/// A place in the frame of a placed object.
pub(crate) fn local(Placement { rotation: r, origin_mm }: &Placement, p: [f64; 3]) -> [f64; 3] {
    let d: [f64; 3] = std::array::from_fn(|i| p[i] - origin_mm[i]);
    [0, 1, 2].map(|i| r[0][i] * d[0] + r[1][i] * d[1] + r[2][i] * d[2])
}
