//! Surface faces: areas and normals from nodal positions.

use crate::element::reference::{GAUSS_3, linear_1d, quadratic_1d};

/// Kind of face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaceKind {
    /// Bilinear quadrilateral.
    Quad4,
    /// Biquadratic quadrilateral: corners, mid-sides, centre.
    Quad9,
    /// Linear triangle.
    Tri3,
    /// Quadratic triangle: corners, mid-sides.
    Tri6,
}

const QUAD_LATTICE: [[i8; 2]; 9] =
    [[-1, -1], [1, -1], [1, 1], [-1, 1], [0, -1], [1, 0], [0, 1], [-1, 0], [0, 0]];

/// Degree-4 rule with six points on the unit triangle.
const TRIANGLE_6: [([f64; 2], f64); 6] = [
    ([0.445_948_490_915_965, 0.445_948_490_915_965], 0.111_690_794_839_005_5),
    ([0.108_103_018_168_070, 0.445_948_490_915_965], 0.111_690_794_839_005_5),
    ([0.445_948_490_915_965, 0.108_103_018_168_070], 0.111_690_794_839_005_5),
    ([0.091_576_213_509_771, 0.091_576_213_509_771], 0.054_975_871_827_661),
    ([0.816_847_572_980_459, 0.091_576_213_509_771], 0.054_975_871_827_661),
    ([0.091_576_213_509_771, 0.816_847_572_980_459], 0.054_975_871_827_661),
];

impl FaceKind {
    /// Number of nodes.
    #[must_use]
    pub const fn nodes(self) -> usize {
        match self {
            Self::Quad4 => 4,
            Self::Quad9 => 9,
            Self::Tri3 => 3,
            Self::Tri6 => 6,
        }
    }

    /// Shape functions and reference gradients at `xi`.
    pub fn shape(self, xi: [f64; 2], value: &mut [f64; 9], gradient: &mut [[f64; 2]; 9]) {
        match self {
            Self::Quad4 | Self::Quad9 => {
                let one_d = if self == Self::Quad4 { linear_1d } else { quadratic_1d };
                for (a, at) in QUAD_LATTICE[..self.nodes()].iter().enumerate() {
                    let (x, dx) = one_d(at[0], xi[0]);
                    let (y, dy) = one_d(at[1], xi[1]);
                    value[a] = x * y;
                    gradient[a] = [dx * y, x * dy];
                }
            }
            Self::Tri3 | Self::Tri6 => {
                let l = [1.0 - xi[0] - xi[1], xi[0], xi[1]];
                let dl = [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]];
                let quadratic = self == Self::Tri6;
                for a in 0..3 {
                    let (v, s) = if quadratic {
                        (l[a] * (2.0 * l[a] - 1.0), 4.0 * l[a] - 1.0)
                    } else {
                        (l[a], 1.0)
                    };
                    value[a] = v;
                    gradient[a] = dl[a].map(|d| s * d);
                }
                if quadratic {
                    for a in 0..3 {
                        let b = (a + 1) % 3;
                        value[3 + a] = 4.0 * l[a] * l[b];
                        gradient[3 + a] =
                            std::array::from_fn(|i| 4.0 * (dl[a][i] * l[b] + l[a] * dl[b][i]));
                    }
                }
            }
        }
    }

    /// Gauss points and weights of the face.
    #[must_use]
    pub fn quadrature(self) -> Vec<([f64; 2], f64)> {
        match self {
            Self::Quad4 | Self::Quad9 => GAUSS_3
                .iter()
                .flat_map(|&(y, wy)| GAUSS_3.iter().map(move |&(x, wx)| ([x, y], wx * wy)))
                .collect(),
            Self::Tri3 | Self::Tri6 => TRIANGLE_6.to_vec(),
        }
    }
}

/// Receives face nodes, shape values and area vector (mm2) of one point.
pub type FaceVisitor<'a> = &'a mut dyn FnMut(&[u32], &[f64], [f64; 3]);

/// Faces of one kind.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Kind of every face.
    pub kind: FaceKind,
    /// `kind.nodes()` node indices per face, counter-clockwise from outside.
    pub connectivity: Vec<u32>,
}

impl Surface {
    /// Faces as node slices.
    pub fn faces(&self) -> impl Iterator<Item = &[u32]> {
        self.connectivity.chunks_exact(self.kind.nodes())
    }

    /// Nodes of the surface, sorted and unique.
    #[must_use]
    pub fn nodes(&self) -> Vec<u32> {
        let mut nodes = self.connectivity.clone();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Calls `visit(face nodes, shape values, area vector)` at every point of
    /// a rule. The area vector is the outward normal times the area, mm2, on
    /// the positions `x`.
    pub fn integrate(
        &self,
        rule: &[([f64; 2], f64)],
        x: &dyn Fn(u32) -> [f64; 3],
        visit: FaceVisitor<'_>,
    ) {
        let n = self.kind.nodes();
        let (mut value, mut gradient) = ([0.0; 9], [[0.0; 2]; 9]);
        for face in self.faces() {
            for &(xi, weight) in rule {
                self.kind.shape(xi, &mut value, &mut gradient);
                let mut t = [[0.0; 3]; 2];
                for (a, &node) in face.iter().enumerate() {
                    let p = x(node);
                    for i in 0..3 {
                        t[0][i] += gradient[a][0] * p[i];
                        t[1][i] += gradient[a][1] * p[i];
                    }
                }
                let normal: [f64; 3] = std::array::from_fn(|i| {
                    let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                    weight * (t[0][j] * t[1][k] - t[0][k] * t[1][j])
                });
                visit(face, &value[..n], normal);
            }
        }
    }

    /// Nodal share of the area, `integral N_a dA` (mm2), added to `area` (one
    /// entry a mesh node), on the positions `x`. Not negative for any face here;
    /// zero at the corners of `Tri6`.
    pub fn add_nodal_areas(&self, x: &dyn Fn(u32) -> [f64; 3], area: &mut [f64]) {
        let rule = self.kind.quadrature();
        self.integrate(&rule, x, &mut |face, value, normal| {
            let a = norm(normal);
            for (&node, &v) in face.iter().zip(value) {
                area[node as usize] += v * a;
            }
        });
    }
}

/// Euclidean norm.
#[must_use]
pub fn norm(v: [f64; 3]) -> f64 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodal_areas_of_a_unit_square_sum_to_one() {
        let corner = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let s = Surface { kind: FaceKind::Quad4, connectivity: vec![0, 1, 2, 3] };
        let mut area = vec![0.0; 4];
        s.add_nodal_areas(&|n| corner[n as usize], &mut area);
        assert!((area.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        let mut normal = [0.0; 3];
        s.integrate(&s.kind.quadrature(), &|n| corner[n as usize], &mut |_, _, n| {
            for i in 0..3 {
                normal[i] += n[i];
            }
        });
        assert!((normal[2] - 1.0).abs() < 1e-14, "counter-clockwise faces point outward");
    }
}
