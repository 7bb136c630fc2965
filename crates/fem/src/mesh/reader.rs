//! Nodal values of a surface read anywhere on it, with the shape functions of its faces.

use super::{Mesh, Surface};
use papilla_vector::{dot, norm};

/// For each of some points the face of a surface that is nearest, and the shape functions there.
#[derive(Clone, Debug)]
pub struct SurfaceReader {
    /// Nodes and shape functions of each point; the same number for all.
    nodes: Vec<u32>,
    values: Vec<f64>,
    per_point: usize,
    distance_mm: Vec<f64>,
}

/// Iterations of the projection onto a face.
const ITERATIONS_MAX: usize = 20;

impl SurfaceReader {
    /// Finds the points (mm) on a surface of the undeformed mesh.
    #[must_use]
    pub fn new(mesh: &Mesh, surface: &Surface, points: &[[f64; 3]]) -> Self {
        Self::with(mesh, surface, points, |xi| {
            let mut value = [0.0; 9];
            surface.kind.shape(xi, &mut value, &mut [[0.0; 2]; 9]);
            value
        })
    }

    /// The same for fields that are linear between neighbouring nodes, as pressure is.
    #[must_use]
    pub fn linear(mesh: &Mesh, surface: &Surface, points: &[[f64; 3]]) -> Self {
        Self::with(mesh, surface, points, |xi| surface.kind.hats(xi))
    }

    fn with(
        mesh: &Mesh,
        surface: &Surface,
        points: &[[f64; 3]],
        functions: impl Fn([f64; 2]) -> [f64; 9],
    ) -> Self {
        let n = surface.kind.nodes();
        let at = |node: u32| mesh.nodes[node as usize];
        let balls: Vec<([f64; 3], f64)> = surface.faces().map(|f| ball(f, &at)).collect();
        let mut out = Self {
            nodes: Vec::with_capacity(n * points.len()),
            values: Vec::with_capacity(n * points.len()),
            per_point: n,
            distance_mm: Vec::with_capacity(points.len()),
        };
        let faces: Vec<&[u32]> = surface.faces().collect();
        for p in points {
            let away = |f: usize| norm(std::array::from_fn(|i| balls[f].0[i] - p[i]));
            let mut order: Vec<(f64, usize)> =
                (0..faces.len()).map(|f| ((away(f) - balls[f].1).max(0.0), f)).collect();
            order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let mut best = (f64::INFINITY, 0, [0.0; 2]);
            for (least, f) in order {
                if least >= best.0 {
                    break;
                }
                let (distance, xi) = project(surface, faces[f], &at, *p);
                if distance < best.0 {
                    best = (distance, f, xi);
                }
            }
            out.nodes.extend(faces[best.1]);
            out.values.extend(&functions(best.2)[..n]);
            out.distance_mm.push(best.0);
        }
        out
    }

    /// Distance of each point from the surface, mm.
    #[must_use]
    pub fn distance_mm(&self) -> &[f64] {
        &self.distance_mm
    }

    /// What a nodal field has at each point.
    #[must_use]
    pub fn read(&self, field: impl Fn(u32) -> f64) -> Vec<f64> {
        let points = self.nodes.chunks_exact(self.per_point);
        points
            .zip(self.values.chunks_exact(self.per_point))
            .map(|(nodes, values)| nodes.iter().zip(values).map(|(&n, v)| v * field(n)).sum())
            .collect()
    }
}

/// A ball around a face's nodes, somewhat larger: quadratic faces bulge.
fn ball(face: &[u32], at: &dyn Fn(u32) -> [f64; 3]) -> ([f64; 3], f64) {
    let count = face.len() as f64;
    let centre: [f64; 3] =
        std::array::from_fn(|i| face.iter().map(|&n| at(n)[i]).sum::<f64>() / count);
    let radius = face
        .iter()
        .map(|&n| norm(std::array::from_fn(|i| at(n)[i] - centre[i])))
        .fold(0.0, f64::max);
    (centre, 1.25 * radius)
}

/// Distance of `p` from a face, and the reference coordinates of the nearest place found (Gauss-Newton,
/// within the face).
fn project(
    surface: &Surface,
    face: &[u32],
    at: &dyn Fn(u32) -> [f64; 3],
    p: [f64; 3],
) -> (f64, [f64; 2]) {
    let (mut value, mut gradient) = ([0.0; 9], [[0.0; 2]; 9]);
    let mut xi = [0.0; 2];
    let mut distance = f64::INFINITY;
    for _ in 0..ITERATIONS_MAX {
        surface.kind.shape(xi, &mut value, &mut gradient);
        let sum = |w: &dyn Fn(usize) -> f64, i: usize| -> f64 {
            face.iter().enumerate().map(|(a, &n)| w(a) * at(n)[i]).sum()
        };
        let miss: [f64; 3] = std::array::from_fn(|i| p[i] - sum(&|a| value[a], i));
        let t: [[f64; 3]; 2] = [0, 1].map(|k| std::array::from_fn(|i| sum(&|a| gradient[a][k], i)));
        distance = norm(miss);
        let (aa, ab, bb) = (dot(t[0], t[0]), dot(t[0], t[1]), dot(t[1], t[1]));
        let (ar, br) = (dot(t[0], miss), dot(t[1], miss));
        let determinant = aa * bb - ab * ab;
        if !(determinant > 0.0) {
            break;
        }
        let step = [(ar * bb - br * ab) / determinant, (br * aa - ar * ab) / determinant];
        let next: [f64; 2] = std::array::from_fn(|k| (xi[k] + step[k]).clamp(-1.0, 1.0));
        let moved = (next[0] - xi[0]).abs().max((next[1] - xi[1]).abs());
        xi = next;
        if moved < 1e-12 {
            break;
        }
    }
    (distance, xi)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::ElementKind;
    use crate::mesh::block::even;
    use crate::mesh::lattice::lattice;

    /// A quadratic field on curved faces is read to rounding where the faces are flat, and to
    /// the third order where they bend.
    #[test]
    fn fields_are_read_with_the_order_of_the_faces() {
        for (kind, order) in [(ElementKind::Hex8, 1.8), (ElementKind::Hex27, 2.7)] {
            let error = |cells: usize| {
                let axis = || even(1.0, kind.order() * cells);
                let mesh = lattice(kind, [axis(), axis(), even(1.0, kind.order())], |[x, y, z]| {
                    [x + 0.1 * (2.0 * y).sin(), y, z + 0.2 * x * y]
                });
                let field = |p: [f64; 3]| (2.0 * p[0]).sin() * (1.5 * p[1]).cos();
                let points: Vec<[f64; 3]> = (0..40)
                    .map(|k| {
                        let (x, y) = (0.1 + 0.019 * f64::from(k), 0.9 - 0.017 * f64::from(k));
                        [x + 0.1 * (2.0 * y).sin(), y, 0.2 * x * y]
                    })
                    .collect();
                let reader = SurfaceReader::new(&mesh, &mesh.surfaces["z_min"], &points);
                let found = reader.read(|n| field(mesh.nodes[n as usize]));
                let worst = |a: f64, b: f64| a.max(b);
                assert!(reader.distance_mm().iter().copied().fold(0.0, worst) < 0.02);
                points.iter().zip(found).map(|(p, f)| (field(*p) - f).abs()).fold(0.0, worst)
            };
            let (coarse, fine) = (error(4), error(8));
            assert!((coarse / fine).log2() > order, "{kind:?}: {coarse} {fine}");
        }
    }
}
