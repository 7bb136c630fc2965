//! What acts on a body: dead forces, pressure, prescribed displacements, a moving indenter.

use super::pressure::SurfacePressure;
use crate::contact::ContactRule;
use papilla_sdf::{Distance, Placement, SignedDistance};
use papilla_vector::norm;
use std::sync::Arc;

/// An indenter that moves along a path without turning.
#[derive(Clone)]
pub struct MovingIndenter {
    /// Its shape.
    pub shape: Arc<dyn SignedDistance>,
    /// Where it is at load fraction 0.
    pub start: Placement,
    /// Its displacement, mm, at rising load fractions; linear in between and
    /// from no displacement at fraction 0.
    pub path: Vec<(f64, [f64; 3])>,
    /// Where on the skin contact is found.
    pub contact: ContactRule,
}

impl MovingIndenter {
    /// An indenter that moves along `path`, with nodal contact.
    #[must_use]
    pub fn along(
        shape: Arc<dyn SignedDistance>,
        start: Placement,
        path: Vec<(f64, [f64; 3])>,
    ) -> Self {
        Self { shape, start, path, contact: ContactRule::Nodal }
    }

    /// One that moves straight by `travel_mm` over the whole load.
    #[must_use]
    pub fn straight(shape: Arc<dyn SignedDistance>, start: Placement, travel_mm: [f64; 3]) -> Self {
        Self::along(shape, start, vec![(1.0, travel_mm)])
    }

    /// Displacement at load fraction `t`, mm.
    #[must_use]
    pub fn offset_mm(&self, t: f64) -> [f64; 3] {
        let (mut from, mut before) = (0.0, [0.0; 3]);
        for &(to, after) in &self.path {
            if t <= to {
                let part = (t - from) / (to - from);
                return std::array::from_fn(|i| before[i] + part * (after[i] - before[i]));
            }
            (from, before) = (to, after);
        }
        before
    }

    /// Length and direction of a path that is one straight line.
    pub(super) fn straight_travel(&self) -> Option<(f64, [f64; 3])> {
        let [(_, travel)] = self.path[..] else { return None };
        let length = norm(travel);
        Some((length, travel.map(|v| v / length)))
    }

    /// Placement at load fraction `t`.
    #[must_use]
    pub fn placement(&self, t: f64) -> Placement {
        let mut p = self.start;
        let offset = self.offset_mm(t);
        for i in 0..3 {
            p.origin_mm[i] += offset[i];
        }
        p
    }

    /// Distance of `x` at load fraction `t`.
    #[must_use]
    pub fn distance(&self, t: f64, x: [f64; 3]) -> Distance {
        self.placement(t).distance(self.shape.as_ref(), x)
    }
}

/// Loads over the load fraction in `[0, 1]`.
#[derive(Clone, Default)]
pub struct Loading {
    /// Dead nodal forces at fraction 1, N; empty if there are none.
    pub dead_n: Vec<[f64; 3]>,
    /// Prescribed displacements at fraction 1: `(degree of freedom, mm)`; the
    /// other prescribed degrees of freedom stay 0.
    pub prescribed_mm: Vec<(usize, f64)>,
    /// Pressure at fraction 1, which follows the surface that it acts on.
    pub pressure: Option<Arc<SurfacePressure>>,
    /// Share of dead forces, pressure and prescribed displacements at rising load fractions, linear in between
    /// and from 0 at 0; the load fraction itself if empty.
    pub course: Vec<(f64, f64)>,
    /// Indenter.
    pub indenter: Option<MovingIndenter>,
    /// Time that the whole load takes, s. Only viscoelastic materials and fluid see it.
    pub duration_s: f64,
    /// Coulomb coefficient between skin and indenter; 0 is no friction.
    pub friction: f64,
}

impl Loading {
    /// Where on the skin contact is found.
    #[must_use]
    pub fn contact(&self) -> ContactRule {
        self.indenter.as_ref().map_or(ContactRule::Nodal, |m| m.contact)
    }

    /// Share of dead forces, pressure and prescribed displacements that acts at a load fraction.
    pub(super) fn share(&self, fraction: f64) -> f64 {
        let Some(&last) = self.course.last() else { return fraction };
        let next = self.course.partition_point(|&(at, _)| at < fraction);
        let Some(&(to, after)) = self.course.get(next) else { return last.1 };
        let (from, before) = next.checked_sub(1).map_or((0.0, 0.0), |i| self.course[i]);
        before + (fraction - from) / (to - from) * (after - before)
    }
}
