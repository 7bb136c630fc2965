//! What earlier frames have found of pixels at rest, so that most need not be asked again.
//!
//! A distance changes no faster than a place. A pixel that was `g` away before a thing has moved by at most
//! `t` is between `g - t` and `g + t` away: that tells whether the thing is near, unless `g` is.

use crate::object::Object;
use crate::objects::{Things, View};
use papilla_sdf::{Placement, SignedDistance};
use papilla_vector::norm;
use std::sync::Weak;

/// Way of a thing from which on all is asked anew: sums stay exact to a ten-thousandth of a pixel.
const WAY_MAX_MM: f64 = 16.0;
/// Rounding, mm.
const EXACT_MM: f32 = 1e-5;
/// Cost of a shape, in a sphere's, up to which all pixels may count as asked.
const COST_MAX: u64 = 4;
/// Before which no pixel was asked.
const NEVER: f32 = f32::NEG_INFINITY;

/// Distances of pixels at rest from the only thing of a scene.
#[derive(Debug)]
pub(super) struct Known {
    /// Ball round all pixels at rest, reference mm.
    centre_mm: [f64; 3],
    radius_mm: f64,
    thing: Option<Thing>,
    /// Most that any pixel's place has moved since the thing was new, as the thing sees it, reference mm.
    way_mm: f64,
    /// By pixel: distance, and `way_mm` then.
    gap_mm: Vec<f32>,
    asked_mm: Vec<f32>,
}

/// A shape, which this does not keep alive, and where it was.
struct Thing {
    shape: Weak<dyn SignedDistance>,
    rotation: [[f64; 3]; 3],
    origin_mm: [f64; 3],
}

impl std::fmt::Debug for Thing {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Thing").field("origin_mm", &self.origin_mm).finish_non_exhaustive()
    }
}

impl Known {
    /// Nothing yet, of pixels at these places.
    pub(super) fn new(rest_mm: &[[f32; 3]]) -> Self {
        let bound = |i: usize, pick: fn(f32, f32) -> f32, from: f32| {
            f64::from(rest_mm.iter().map(|at| at[i]).fold(from, pick))
        };
        let low: [f64; 3] = std::array::from_fn(|i| bound(i, f32::min, f32::INFINITY));
        let high: [f64; 3] = std::array::from_fn(|i| bound(i, f32::max, f32::NEG_INFINITY));
        Self {
            centre_mm: std::array::from_fn(|i| 0.5 * (low[i] + high[i])),
            radius_mm: 0.5 * norm(std::array::from_fn(|i| high[i] - low[i])),
            thing: None,
            way_mm: 0.0,
            gap_mm: vec![0.0; rest_mm.len()],
            asked_mm: vec![NEVER; rest_mm.len()],
        }
    }

    /// Takes note of how far the only thing of a view has moved, and whether it did: of other views, and
    /// of a shape that costs much, nothing is known.
    pub(super) fn follow(&mut self, view: View<'_>) -> bool {
        let Things::Objects([Object { shape, placement, .. }]) = view.things else {
            self.forget();
            return false;
        };
        if !view.held.is_empty() || view.cost > COST_MAX {
            self.forget();
            return false;
        }
        let Placement { rotation, origin_mm } = *placement;
        // A place of the reference finger stands still where the thing moves against the shift.
        let origin_mm = std::array::from_fn(|i| origin_mm[i] / view.length + view.shift_mm[i]);
        let from = self.thing.take().filter(|t| std::ptr::addr_eq(t.shape.as_ptr(), &**shape));
        let turned = |from: &Thing| {
            let turns = from.rotation.as_flattened().iter().zip(rotation.as_flattened());
            turns.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
        };
        let way_mm = from.as_ref().map_or(f64::INFINITY, |from| {
            let away = std::array::from_fn(|i| self.centre_mm[i] - origin_mm[i]);
            let by = std::array::from_fn(|i| origin_mm[i] - from.origin_mm[i]);
            turned(from) * (norm(away) + self.radius_mm) + norm(by)
        });
        self.way_mm += way_mm;
        if !(self.way_mm < WAY_MAX_MM) {
            self.forget();
        }
        let shape = from.map_or_else(|| std::sync::Arc::downgrade(shape), |from| from.shape);
        self.thing = Some(Thing { shape, rotation, origin_mm });
        true
    }

    fn forget(&mut self) {
        if self.way_mm > 0.0 || self.thing.is_some() {
            self.asked_mm.fill(NEVER);
        }
        (self.way_mm, self.thing) = (0.0, None);
    }

    /// Whether a pixel is nearer than `reach_mm`, if that is known.
    #[inline]
    pub(super) fn is_nearer(&self, entry: usize, reach_mm: f32) -> Option<bool> {
        let may_differ = self.way_mm as f32 - self.asked_mm[entry] + EXACT_MM;
        let gap = self.gap_mm[entry];
        ((gap - reach_mm).abs() > may_differ).then_some(gap < reach_mm)
    }

    /// Takes note of a pixel's distance.
    #[inline]
    pub(super) fn note(&mut self, entry: usize, gap_mm: f64) {
        (self.gap_mm[entry], self.asked_mm[entry]) = (gap_mm as f32, self.way_mm as f32);
    }
}
