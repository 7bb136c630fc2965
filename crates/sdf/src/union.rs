//! Several parts as one indenter.

use super::{Distance, Placed, SignedDistance};

/// The union of parts: its gap is that of the nearest one.
///
/// At a seam, where two parts are as near, the gap is continuous and its gradient jumps to
/// the other part's. On the surface that is a concave corner, which skin rarely fills: a
/// node there is pushed by one part, or by the other after it has slid across; Newton's
/// line search accepts the kink because the contact potential is continuous. In the air
/// it is of no matter.
pub struct AnyOf {
    /// The parts.
    pub parts: Vec<Placed>,
}

/// The distance that is less; the first one where they tie.
pub(super) fn nearer(a: Distance, b: Distance) -> Distance {
    if b.gap_mm < a.gap_mm { b } else { a }
}

impl SignedDistance for AnyOf {
    /// Infinitely far from nothing.
    fn distance(&self, p: [f64; 3]) -> Distance {
        let nothing =
            Distance { gap_mm: f64::INFINITY, normal: [0.0, 0.0, 1.0], hessian: [[0.0; 3]; 3] };
        self.parts.iter().map(|part| part.distance(p)).fold(nothing, nearer)
    }

    fn reach_mm(&self, direction: [f64; 3]) -> f64 {
        self.parts.iter().map(|part| part.reach_mm(direction)).fold(f64::NEG_INFINITY, f64::max)
    }

    fn clearance_mm(&self, p: [f64; 3]) -> f64 {
        self.parts.iter().map(|part| part.clearance_mm(p)).fold(f64::INFINITY, f64::min)
    }

    fn narrowest_mm(&self) -> f64 {
        self.parts.iter().map(Placed::narrowest_mm).fold(f64::INFINITY, f64::min)
    }
}
