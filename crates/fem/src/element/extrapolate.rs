//! From quadrature points to any point of an element.

use super::reference::ElementKind;

/// Weights of the values at the quadrature points that give the value at `xi`:
/// the polynomial through the points (tensor-product for quadrilaterals and
/// hexahedra, linear for `Tet10`, constant for `Tet4`).
#[must_use]
pub fn weights(kind: ElementKind, xi: [f64; 3]) -> Vec<f64> {
    let points = kind.quadrature();
    match kind {
        ElementKind::Tet4 => vec![1.0],
        ElementKind::Tet10 => {
            // Point c has barycentric coordinate a at vertex c and b elsewhere.
            let b = points[0].xi[0];
            let a = 1.0 - 3.0 * b;
            let corner = [1.0 - xi[0] - xi[1] - xi[2], xi[0], xi[1], xi[2]];
            corner.iter().map(|l| (l - b) / (a - b)).collect()
        }
        _ => {
            let axes: [Vec<f64>; 3] = std::array::from_fn(|i| {
                let mut of: Vec<f64> = points.iter().map(|p| p.xi[i]).collect();
                of.sort_unstable_by(f64::total_cmp);
                of.dedup_by(|a, b| a.to_bits() == b.to_bits());
                of
            });
            let lagrange = |axis: usize, at: f64| -> f64 {
                let others = axes[axis].iter().filter(|o| o.to_bits() != at.to_bits());
                others.map(|o| (xi[axis] - o) / (at - o)).product()
            };
            points.iter().map(|p| (0..3).map(|i| lagrange(i, p.xi[i])).product()).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_fields_come_out_exact_and_points_keep_their_value() {
        for kind in ElementKind::ALL.into_iter().filter(|k| *k != ElementKind::Tet4) {
            let points = kind.quadrature();
            let field = |x: [f64; 3]| 1.0 + 2.0 * x[0] - 0.5 * x[1] + 3.0 * x[2];
            let xi = if kind.is_planar() { [0.3, 0.2, 0.0] } else { [0.3, 0.2, 0.1] };
            let found: f64 =
                weights(kind, xi).iter().zip(&points).map(|(w, p)| w * field(p.xi)).sum();
            assert!((found - field(xi)).abs() < 1e-13, "{kind:?} {found}");
            for (q, p) in points.iter().enumerate() {
                for (r, w) in weights(kind, p.xi).iter().enumerate() {
                    let expected = if q == r { 1.0 } else { 0.0 };
                    assert!((w - expected).abs() < 1e-13, "{kind:?}");
                }
            }
        }
    }
}
