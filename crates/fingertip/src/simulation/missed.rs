//! Where an indenter goes that meets nothing, and how far one can go that does.

use super::body::Body;
use crate::indenter::IndenterError;
use papilla_fem::solve::MovingIndenter;
use papilla_sdf::{Distance, Placement, SignedDistance, TouchError, first_touch_travel};

/// Farthest that a point of a square face is from its nearest node, in sides of it: half a diagonal,
/// and a little for faces that are no squares.
const BESIDE_A_NODE: f64 = 0.75;

/// A shape that is larger all round.
struct Swollen<'a> {
    shape: &'a dyn SignedDistance,
    by_mm: f64,
}

impl SignedDistance for Swollen<'_> {
    fn distance(&self, p: [f64; 3]) -> Distance {
        let own = self.shape.distance(p);
        Distance { gap_mm: own.gap_mm - self.by_mm, ..own }
    }

    fn reach_mm(&self, direction: [f64; 3]) -> f64 {
        self.shape.reach_mm(direction) + self.by_mm
    }

    fn clearance_mm(&self, p: [f64; 3]) -> f64 {
        self.shape.clearance_mm(p) - self.by_mm
    }
}

/// Why an indenter from `start` touches none of `points`: it goes by, or between them if they are so
/// far apart, `spacing_mm`, that it is narrow.
pub(super) fn why(
    shape: &dyn SignedDistance,
    (start, normal): (&Placement, [f64; 3]),
    points: &[[f64; 3]],
    spacing_mm: Option<f64>,
    error: TouchError,
) -> IndenterError {
    let (TouchError::NeverTouches, Some(spacing_mm)) = (error, spacing_mm) else {
        return error.into();
    };
    let width_mm = shape.narrowest_mm();
    let swollen = Swollen { shape, by_mm: BESIDE_A_NODE * spacing_mm };
    match first_touch_travel(&swollen, start, normal, points) {
        Err(TouchError::NeverTouches) => error.into(),
        Ok(_) | Err(TouchError::StartsInside { .. }) => {
            IndenterError::BetweenNodes { width_mm, spacing_mm }
        }
    }
}

impl Body {
    /// Whether a coarser mesh goes to each state first.
    pub(crate) const fn has_guide(&self) -> bool {
        self.guide.is_some()
    }

    /// Depth at which an indenter that goes straight on would reach the bone of the undeformed body,
    /// mm; `None` if the bone gives way, or is not in its way.
    #[must_use]
    pub fn room_mm(&self, indenter: &MovingIndenter) -> Option<f64> {
        let mesh = &self.problem.mesh;
        let bone = mesh.node_sets.get("bone")?;
        let is_held = |n: &u32| (0..3).all(|i| self.problem.fixed[3 * *n as usize + i]);
        if !bone.iter().all(is_held) {
            return None;
        }
        let places: Vec<_> = bone.iter().map(|&n| mesh.nodes[n as usize]).collect();
        let normal = indenter.start.rotation.map(|row| row[2]);
        first_touch_travel(indenter.shape.as_ref(), &indenter.start, normal, &places).ok()
    }
}
