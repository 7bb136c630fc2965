//! The point of a triangle that is nearest to another one.

use papilla_vector::{dot, minus};

/// What of a triangle is nearest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Feature {
    Face,
    /// From this corner to the next one.
    Edge(u8),
    Corner(u8),
}

impl Feature {
    /// Place of its normal among those of a face.
    pub(super) fn index(self) -> usize {
        match self {
            Self::Face => 0,
            Self::Edge(k) => 1 + usize::from(k),
            Self::Corner(k) => 4 + usize::from(k),
        }
    }

    /// The corners of an edge.
    pub(super) fn edge(self) -> Option<[usize; 2]> {
        let Self::Edge(k) = self else { return None };
        let k = usize::from(k);
        Some([k, (k + 1) % 3])
    }
}

/// The point nearest to `p` and what it belongs to (Ericson, *Real-Time Collision Detection*,
/// 2005, section 5.1.5).
pub(super) fn closest(p: [f64; 3], &[a, b, c]: &[[f64; 3]; 3]) -> ([f64; 3], Feature) {
    let (ab, ac, ap) = (minus(b, a), minus(c, a), minus(p, a));
    let (d1, d2) = (dot(ab, ap), dot(ac, ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (a, Feature::Corner(0));
    }
    let bp = minus(p, b);
    let (d3, d4) = (dot(ab, bp), dot(ac, bp));
    if d3 >= 0.0 && d4 <= d3 {
        return (b, Feature::Corner(1));
    }
    let vc = d1 * d4 - d3 * d2;
    let along = |from: [f64; 3], way: [f64; 3], part: f64| -> [f64; 3] {
        std::array::from_fn(|i| from[i] + part * way[i])
    };
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (along(a, ab, d1 / (d1 - d3)), Feature::Edge(0));
    }
    let cp = minus(p, c);
    let (d5, d6) = (dot(ab, cp), dot(ac, cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (c, Feature::Corner(2));
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (along(a, ac, d2 / (d2 - d6)), Feature::Edge(2));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let part = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return (along(b, minus(c, b), part), Feature::Edge(1));
    }
    let total = va + vb + vc;
    (along(along(a, ab, vb / total), ac, vc / total), Feature::Face)
}
