//! What can press on a finger, and how far it is.

use crate::error::ContactError;
use papilla_sdf::{Placement, SignedDistance};
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
}

/// Largest deviation of a rotation from orthonormal columns.
const ROTATION_MISS_MAX: f64 = 1e-3;
/// Farthest place of an object, mm.
const PLACE_MAX_MM: f64 = 1e5;

impl Object {
    /// A rigid object.
    #[must_use]
    pub fn rigid(shape: Arc<dyn SignedDistance>, placement: Placement) -> Self {
        Self { shape, placement, stiffness_mpa_per_mm: f64::INFINITY }
    }
}

/// Refuses what cannot be placed.
pub(crate) fn validate(objects: &[Object]) -> Result<(), ContactError> {
    for (index, object) in objects.iter().enumerate() {
        let Placement { rotation, origin_mm } = object.placement;
        for value in origin_mm {
            if !(value.abs() <= PLACE_MAX_MM) {
                let (member, rule) = ("objects[].origin_mm", "has to be within 100 m");
                return Err(ContactError::Value { member, value, rule });
            }
        }
        let mut miss = 0.0f64;
        for i in 0..3 {
            for j in 0..3 {
                let dot: f64 = (0..3).map(|k| rotation[k][i] * rotation[k][j]).sum();
                let off = (dot - f64::from(u8::from(i == j))).abs();
                miss = if off <= miss { miss } else { off };
            }
        }
        let [a, b, c] = rotation;
        let volume = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
            + a[2] * (b[0] * c[1] - b[1] * c[0]);
        if !(miss <= ROTATION_MISS_MAX && volume > 0.0) {
            return Err(ContactError::Rotation { object: index, miss });
        }
        let value = object.stiffness_mpa_per_mm;
        if !(value > 0.0) {
            let (member, rule) = ("objects[].stiffness_mpa_per_mm", "has to be positive");
            return Err(ContactError::Value { member, value, rule });
        }
    }
    Ok(())
}

/// Objects as a finger of reference width sees them.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    pub objects: &'a [Object],
    /// Width of the finger over the reference width.
    pub length: f64,
    /// How far the objects have moved from their places, reference mm.
    pub shift_mm: [f64; 3],
}

/// The nearest object.
#[derive(Clone, Copy)]
pub(crate) struct Nearest {
    pub gap_mm: f64,
    pub normal: [f64; 3],
    pub object: usize,
}

impl View<'_> {
    /// The nearest object of a place of the reference finger, mm.
    pub(crate) fn nearest(&self, at_mm: [f64; 3]) -> Nearest {
        let p = self.seen(at_mm);
        let mut nearest = Nearest { gap_mm: f64::INFINITY, normal: [0.0, 0.0, 1.0], object: 0 };
        for (object, o) in self.objects.iter().enumerate() {
            let Placement { rotation: r, origin_mm } = &o.placement;
            let d: [f64; 3] = std::array::from_fn(|i| p[i] - origin_mm[i]);
            let local = [0, 1, 2].map(|i| r[0][i] * d[0] + r[1][i] * d[1] + r[2][i] * d[2]);
            let found = o.shape.distance(local);
            let gap_mm = found.gap_mm / self.length;
            if gap_mm < nearest.gap_mm {
                let n = found.normal;
                let size = n.iter().map(|v| v * v).sum::<f64>().sqrt();
                let turned = r.map(|row| (row[0] * n[0] + row[1] * n[1] + row[2] * n[2]) / size);
                let normal = if size > 1e-6 { turned } else { nearest.normal };
                nearest = Nearest { gap_mm, normal, object };
            }
        }
        nearest
    }

    /// A distance that is certainly free round a place, reference mm.
    pub(crate) fn clearance_mm(&self, at_mm: [f64; 3]) -> f64 {
        let p = self.seen(at_mm);
        let free = |o: &Object| o.placement.clearance_mm(o.shape.as_ref(), p);
        self.objects.iter().map(free).fold(f64::INFINITY, f64::min) / self.length
    }

    fn seen(&self, at_mm: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| self.length * (at_mm[i] - self.shift_mm[i]))
    }
}
