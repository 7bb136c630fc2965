//! Surface faces: areas and normals from nodal positions.
//!
//! In the plane a face is an edge 1 mm wide; walking along it the body is on
//! the left, which is the same as counter-clockwise from outside when its second
//! reference direction is the thickness, +z.

use crate::element::ElementKind;
use crate::element::reference::GAUSS_3;
use crate::element::shape::{hat_1d, linear_1d, quadratic_1d};
use papilla_vector::norm;

/// Kind of face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaceKind {
    /// Straight edge of a planar element.
    Line2,
    /// Quadratic edge of a planar element: ends, middle.
    Line3,
    /// Bilinear quadrilateral.
    Quad4,
    /// Serendipity quadrilateral: corners, mid-sides.
    Quad8,
    /// Biquadratic quadrilateral: corners, mid-sides, centre.
    Quad9,
    /// Linear triangle.
    Tri3,
    /// Quadratic triangle: corners, mid-sides.
    Tri6,
}

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
    /// Kind of the sides of an element.
    #[must_use]
    pub const fn of(element: ElementKind) -> Self {
        match element {
            ElementKind::Hex8 => Self::Quad4,
            ElementKind::Hex20 => Self::Quad8,
            ElementKind::Hex27 => Self::Quad9,
            ElementKind::Tet4 => Self::Tri3,
            ElementKind::Tet10 => Self::Tri6,
            ElementKind::Quad4 => Self::Line2,
            ElementKind::Quad8 | ElementKind::Quad9 => Self::Line3,
        }
    }

    /// Number of nodes.
    #[must_use]
    pub const fn nodes(self) -> usize {
        match self {
            Self::Line2 => 2,
            Self::Line3 | Self::Tri3 => 3,
            Self::Quad4 => 4,
            Self::Tri6 => 6,
            Self::Quad8 => 8,
            Self::Quad9 => 9,
        }
    }

    /// Number of corners, which come first.
    #[must_use]
    pub const fn corners(self) -> usize {
        match self {
            Self::Line2 | Self::Line3 => 2,
            Self::Tri3 | Self::Tri6 => 3,
            Self::Quad4 | Self::Quad8 | Self::Quad9 => 4,
        }
    }

    /// Whether contact at its nodes is sound: no node's share of the area is
    /// negative.
    ///
    /// Under an even pressure the corners of `Quad8` must be *pulled*, each with a
    /// twelfth of the face's force, which a node that can only be pushed never
    /// gives; made-up positive weights would trade that for forces that are wrong
    /// by the same twelfth and do not get better on finer meshes. So contact on
    /// such faces is refused; [`super::complete`] gives them the middle node with
    /// which all shares are positive.
    #[must_use]
    pub const fn carries_contact(self) -> bool {
        !matches!(self, Self::Quad8)
    }

    /// Shape functions and reference gradients at `xi`.
    pub fn shape(self, xi: [f64; 2], value: &mut [f64; 9], gradient: &mut [[f64; 2]; 9]) {
        let element = match self {
            Self::Quad4 => ElementKind::Quad4,
            Self::Quad8 => ElementKind::Quad8,
            Self::Quad9 => ElementKind::Quad9,
            Self::Line2 | Self::Line3 => return line_shape(self, xi[0], value, gradient),
            Self::Tri3 | Self::Tri6 => return triangle_shape(self, xi, value, gradient),
        };
        let mut slope = [[0.0; 3]; 9];
        element.shape([xi[0], xi[1], 0.0], value, &mut slope);
        *gradient = slope.map(|d| [d[0], d[1]]);
    }

    /// Functions of the nodes at `xi` that are linear between neighbouring ones, positive and of sum
    /// 1; on faces without nodes between corners the shape functions.
    #[must_use]
    pub fn hats(self, xi: [f64; 2]) -> [f64; 9] {
        let mut value = [0.0; 9];
        match self {
            Self::Quad9 => {
                for (v, at) in value.iter_mut().zip(ElementKind::Quad9.lattice()) {
                    *v = hat_1d(at[0], xi[0]) * hat_1d(at[1], xi[1]);
                }
            }
            Self::Line3 => {
                for (v, at) in value.iter_mut().zip([-1, 1, 0]) {
                    *v = hat_1d(at, xi[0]);
                }
            }
            _ => self.shape(xi, &mut value, &mut [[0.0; 2]; 9]),
        }
        value
    }

    /// Gauss points of contact within the face, and their weights: they see what
    /// its shape functions can follow.
    #[must_use]
    pub fn contact_points(self) -> Vec<([f64; 2], f64)> {
        const AT: f64 = 0.577_350_269_189_625_8;
        match self {
            Self::Line2 => [-AT, AT].map(|x| ([x, 0.0], 1.0)).to_vec(),
            Self::Quad4 => {
                [[-AT, -AT], [AT, -AT], [-AT, AT], [AT, AT]].map(|xi| (xi, 1.0)).to_vec()
            }
            Self::Tri3 => [[2.0, 0.5], [0.5, 2.0], [0.5, 0.5]]
                .map(|xi| (xi.map(|v| v / 3.0), 1.0 / 6.0))
                .to_vec(),
            Self::Line3 | Self::Quad8 | Self::Quad9 | Self::Tri6 => self.quadrature(),
        }
    }

    /// Gauss points and weights of the face.
    #[must_use]
    pub fn quadrature(self) -> Vec<([f64; 2], f64)> {
        match self {
            Self::Line2 | Self::Line3 => GAUSS_3.iter().map(|&(x, w)| ([x, 0.0], w)).collect(),
            Self::Quad4 | Self::Quad8 | Self::Quad9 => GAUSS_3
                .iter()
                .flat_map(|&(y, wy)| GAUSS_3.iter().map(move |&(x, wx)| ([x, y], wx * wy)))
                .collect(),
            Self::Tri3 | Self::Tri6 => TRIANGLE_6.to_vec(),
        }
    }
}

fn line_shape(kind: FaceKind, x: f64, value: &mut [f64; 9], gradient: &mut [[f64; 2]; 9]) {
    let one_d = if kind == FaceKind::Line2 { linear_1d } else { quadratic_1d };
    for (a, at) in [-1, 1, 0][..kind.nodes()].iter().enumerate() {
        let (v, slope) = one_d(*at, x);
        value[a] = v;
        gradient[a] = [slope, 0.0];
    }
}

fn triangle_shape(
    kind: FaceKind,
    xi: [f64; 2],
    value: &mut [f64; 9],
    gradient: &mut [[f64; 2]; 9],
) {
    let l = [1.0 - xi[0] - xi[1], xi[0], xi[1]];
    let dl = [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]];
    let quadratic = kind == FaceKind::Tri6;
    for a in 0..3 {
        let (v, s) =
            if quadratic { (l[a] * (2.0 * l[a] - 1.0), 4.0 * l[a] - 1.0) } else { (l[a], 1.0) };
        value[a] = v;
        gradient[a] = dl[a].map(|d| s * d);
    }
    if quadratic {
        for a in 0..3 {
            let b = (a + 1) % 3;
            value[3 + a] = 4.0 * l[a] * l[b];
            gradient[3 + a] = std::array::from_fn(|i| 4.0 * (dl[a][i] * l[b] + l[a] * dl[b][i]));
        }
    }
}

/// Nodes of an element's side in the order of its [`FaceKind`]: corners,
/// middles of the edges between them, middle of the face.
///
/// `side` indexes [`ElementKind::sides`].
#[must_use]
pub fn side_nodes(element: ElementKind, side: usize) -> Vec<usize> {
    let corners = element.sides()[side];
    let mut nodes = corners.to_vec();
    if element.order() == 1 {
        return nodes;
    }
    let at = |a: usize| element.node_xi(a);
    // Middles are the nodes of the element at the mean of some corners.
    let mut push = |of: &[usize]| {
        let n = of.len() as f64;
        let mean: [f64; 3] = std::array::from_fn(|i| of.iter().map(|&c| at(c)[i]).sum::<f64>() / n);
        let is_there = |&a: &usize| (0..3).all(|i| (at(a)[i] - mean[i]).abs() < 1e-9);
        nodes.extend((0..element.nodes()).find(is_there));
    };
    if corners.len() == 2 {
        push(corners);
    } else {
        for (k, &c) in corners.iter().enumerate() {
            push(&[c, corners[(k + 1) % corners.len()]]);
        }
        push(corners);
    }
    nodes
}

/// Receives face nodes, shape values and area vector (mm2) of one point.
pub type FaceVisitor<'a> = &'a mut dyn FnMut(&[u32], &[f64], [f64; 3]);

/// Faces of one kind.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Kind of every face.
    pub kind: FaceKind,
    /// `kind.nodes()` node indices per face, counter-clockwise from outside
    /// (edges: body on the left).
    pub connectivity: Vec<u32>,
}

impl Surface {
    /// Faces as node slices.
    pub fn faces(&self) -> impl Iterator<Item = &[u32]> {
        self.connectivity.chunks_exact(self.kind.nodes())
    }

    /// Nodes of a chain of edges in the order in which they are walked, each edge
    /// starting where the last ended.
    #[must_use]
    pub fn walk(&self) -> Vec<u32> {
        let mut nodes = Vec::new();
        for edge in self.faces() {
            nodes.extend(edge[..1].iter().chain(edge.get(2)));
        }
        nodes.extend(self.faces().last().map(|edge| edge[1]));
        nodes
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
    /// the positions `x`; the area of an edge is its length times 1 mm.
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
                if self.kind.corners() == 2 {
                    t[1] = [0.0, 0.0, 1.0];
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
    /// entry a mesh node), on the positions `x`. Zero at the corners of `Tri6`;
    /// negative at those of `Quad8` only, see [`FaceKind::carries_contact`].
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

    /// Shares of an even load on a straight face of area 1.
    #[test]
    fn nodal_areas_are_those_of_the_textbooks() {
        let cases: [(FaceKind, &[f64]); 6] = [
            (FaceKind::Line2, &[0.5, 0.5]),
            (FaceKind::Line3, &[1.0 / 6.0, 1.0 / 6.0, 4.0 / 6.0]),
            (FaceKind::Quad4, &[0.25; 4]),
            (
                FaceKind::Quad8,
                &[
                    -1.0 / 12.0,
                    -1.0 / 12.0,
                    -1.0 / 12.0,
                    -1.0 / 12.0,
                    1.0 / 3.0,
                    1.0 / 3.0,
                    1.0 / 3.0,
                    1.0 / 3.0,
                ],
            ),
            (
                FaceKind::Quad9,
                &[
                    1.0 / 36.0,
                    1.0 / 36.0,
                    1.0 / 36.0,
                    1.0 / 36.0,
                    4.0 / 36.0,
                    4.0 / 36.0,
                    4.0 / 36.0,
                    4.0 / 36.0,
                    16.0 / 36.0,
                ],
            ),
            (FaceKind::Tri6, &[0.0, 0.0, 0.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0]),
        ];
        for (kind, expected) in cases {
            let at = |n: u32| {
                let xi = |k: ElementKind| k.node_xi(n as usize);
                match kind {
                    FaceKind::Line2 => [f64::from(n), 0.0, 0.0],
                    FaceKind::Line3 => [[0.0, 1.0, 0.5][n as usize], 0.0, 0.0],
                    // Face 0, 1, 2 of the reference tetrahedron has area 1/2.
                    FaceKind::Tri3 | FaceKind::Tri6 => {
                        xi(ElementKind::Tet10).map(|v| v * 2f64.sqrt())
                    }
                    _ => xi(ElementKind::Quad9).map(|v| 0.5 * v),
                }
            };
            // Corners and mid-edges of the tetrahedron's first face lead its list.
            let nodes: Vec<u32> = match kind {
                FaceKind::Tri6 => vec![0, 1, 2, 4, 5, 6],
                _ => (0..kind.nodes() as u32).collect(),
            };
            let s = Surface { kind, connectivity: nodes.clone() };
            let mut area = vec![0.0; 9];
            s.add_nodal_areas(&at, &mut area);
            for (&n, e) in nodes.iter().zip(expected) {
                assert!((area[n as usize] - e).abs() < 1e-12, "{kind:?} node {n}: {area:?}");
            }
            assert_eq!(kind.carries_contact(), expected.iter().all(|a| *a >= 0.0), "{kind:?}");
        }
    }

    /// Walking along an edge with the body on the left, the normal is on the right.
    #[test]
    fn edges_look_away_from_a_body_on_their_left() {
        // Half a circle of radius 1 above the x axis, one quadratic edge a quadrant.
        let at = |n: u32| {
            let a = f64::from(n) * std::f64::consts::FRAC_PI_4;
            [a.cos(), a.sin(), 0.0]
        };
        let s = Surface { kind: FaceKind::Line3, connectivity: vec![0, 2, 1, 2, 4, 3] };
        let (mut total, mut length) = ([0.0; 3], 0.0);
        s.integrate(&s.kind.quadrature(), &at, &mut |face, value, normal| {
            let x: [f64; 3] =
                std::array::from_fn(|i| face.iter().zip(value).map(|(&n, v)| v * at(n)[i]).sum());
            assert!((0..3).map(|i| x[i] * normal[i]).sum::<f64>() > 0.0);
            length += norm(normal);
            for i in 0..3 {
                total[i] += normal[i];
            }
        });
        // The chord from (1, 0) to (-1, 0), turned.
        assert!(total[0].abs() < 1e-14 && (total[1] - 2.0).abs() < 1e-14 && total[2] == 0.0);
        // A parabola through three points of a quadrant is 0.6 % shorter than its arc.
        assert!((length / std::f64::consts::PI - 1.0).abs() < 0.006, "{length}");
    }

    /// The corners of every side turn outward, and all its nodes lie on it.
    #[test]
    fn sides_of_every_kind_enclose_its_volume() {
        for kind in ElementKind::ALL {
            let at = |n: u32| kind.node_xi(n as usize);
            let (mut flux, face) = (0.0, FaceKind::of(kind));
            for side in 0..kind.sides().len() {
                let nodes: Vec<u32> =
                    side_nodes(kind, side).into_iter().map(|n| n as u32).collect();
                assert_eq!(nodes.len(), face.nodes(), "{kind:?} side {side}");
                let s = Surface { kind: face, connectivity: nodes };
                s.integrate(&face.quadrature(), &at, &mut |nodes, value, normal| {
                    for i in 0..3 {
                        let x: f64 = nodes.iter().zip(value).map(|(&n, v)| v * at(n)[i]).sum();
                        flux += x * normal[i] / kind.dimension() as f64;
                    }
                });
            }
            let volume: f64 = kind.quadrature().iter().map(|q| q.weight).sum();
            assert!((flux - volume).abs() < 1e-13, "{kind:?}: {flux} {volume}");
        }
    }
}
