//! Values on one triangulated surface read at points of another.

use papilla_vector::norm;

/// For each of some points the nearest point of a triangulated surface, as vertices and
/// weights: values there are interpolated linearly in the triangle.
#[derive(Clone, Debug)]
pub struct NearestPoints {
    terms: Vec<([u32; 3], [f64; 3])>,
    distance_mm_max: f64,
}

impl NearestPoints {
    /// Finds the point of the surface nearest to each of `points`, mm. There has to be a
    /// triangle.
    #[must_use]
    pub fn new(vertices: &[[f64; 3]], triangles: &[[u32; 3]], points: &[[f64; 3]]) -> Self {
        let (mut terms, mut farthest) = (Vec::with_capacity(points.len()), 0.0f64);
        for p in points {
            let mut best = (f64::INFINITY, ([0; 3], [0.0; 3]));
            for t in triangles {
                let [a, b, c] = t.map(|n| vertices[n as usize]);
                let w = nearest(a, b, c, *p);
                let at = |i: usize| w[0] * a[i] + w[1] * b[i] + w[2] * c[i];
                let distance = norm(std::array::from_fn(|i| at(i) - p[i]));
                if distance < best.0 {
                    best = (distance, (*t, w));
                }
            }
            farthest = farthest.max(best.0);
            terms.push(best.1);
        }
        Self { terms, distance_mm_max: farthest }
    }

    /// Values of the surface's vertices, read at the points.
    #[must_use]
    pub fn read(&self, values: &[f64]) -> Vec<f64> {
        let at = |(t, w): &([u32; 3], [f64; 3])| (0..3).map(|k| w[k] * values[t[k] as usize]).sum();
        self.terms.iter().map(at).collect()
    }

    /// Largest distance of a point from the surface, mm.
    #[must_use]
    pub fn distance_mm_max(&self) -> f64 {
        self.distance_mm_max
    }
}

/// Barycentric coordinates of the point of a triangle nearest to `p` (Ericson
/// 2005, sec. 5.1.5).
fn nearest(a: [f64; 3], b: [f64; 3], c: [f64; 3], p: [f64; 3]) -> [f64; 3] {
    let sub = |x: [f64; 3], y: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| x[i] - y[i]) };
    let dot = |x: [f64; 3], y: [f64; 3]| (0..3).map(|i| x[i] * y[i]).sum::<f64>();
    let (ab, ac) = (sub(b, a), sub(c, a));
    let (d1, d2) = (dot(ab, sub(p, a)), dot(ac, sub(p, a)));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let (d3, d4) = (dot(ab, sub(p, b)), dot(ac, sub(p, b)));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = d1 / (d1 - d3);
        return [1.0 - v, v, 0.0];
    }
    let (d5, d6) = (dot(ab, sub(p, c)), dot(ac, sub(p, c)));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = d2 / (d2 - d6);
        return [1.0 - w, 0.0, w];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - w, w];
    }
    let sum = va + vb + vc;
    [va / sum, vb / sum, vc / sum]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_point_of_a_triangle_is_found_in_every_region() {
        let (a, b, c) = ([0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
        let close = |p: [f64; 3], w: [f64; 3]| {
            let found = nearest(a, b, c, p);
            assert!((0..3).all(|i| (found[i] - w[i]).abs() < 1e-15), "{p:?}: {found:?}");
        };
        close([-1.0, -1.0, 5.0], [1.0, 0.0, 0.0]);
        close([4.0, -1.0, 0.0], [0.0, 1.0, 0.0]);
        close([-1.0, 5.0, 1.0], [0.0, 0.0, 1.0]);
        close([1.0, -3.0, 0.0], [0.5, 0.5, 0.0]);
        close([-2.0, 1.0, 0.0], [0.5, 0.0, 0.5]);
        close([3.0, 3.0, 1.0], [0.0, 0.5, 0.5]);
        close([0.5, 0.5, -7.0], [0.5, 0.25, 0.25]);
    }

    #[test]
    fn a_linear_field_is_read_exactly_on_the_surface() {
        let vertices = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [2.0, 2.0, 0.0]];
        let triangles = [[0, 1, 2], [1, 3, 2]];
        let points = [[0.5, 0.25, 0.1], [1.5, 1.75, 0.0], [2.0, 2.0, 0.0]];
        let found = NearestPoints::new(&vertices, &triangles, &points);
        let field = |p: &[f64; 3]| 3.0 + p[0] - 2.0 * p[1];
        let values: Vec<f64> = vertices.iter().map(field).collect();
        for (f, p) in found.read(&values).into_iter().zip(&points) {
            assert!((f - field(p)).abs() < 1e-14, "{p:?}: {f}");
        }
        assert!((found.distance_mm_max() - 0.1).abs() < 1e-15);
    }
}
