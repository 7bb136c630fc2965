//! Reference elements: nodes, quadrature, pressure basis, sides.
//!
//! Hexahedra live on `[-1, 1]^3` and number their nodes as VTK does
//! (`VTK_HEXAHEDRON`, `VTK_QUADRATIC_HEXAHEDRON`, `VTK_TRIQUADRATIC_HEXAHEDRON`),
//! quadrilaterals on `[-1, 1]^2` (`VTK_QUAD`, `VTK_QUADRATIC_QUAD`,
//! `VTK_BIQUADRATIC_QUAD`); tetrahedra live on the unit simplex.
//!
//! Quadrilaterals are plane-strain elements of 1 mm thickness in the plane
//! z = 0. Their third reference coordinate is 0 and no function depends on it.
//!
//! **Dilatation basis.** It must be poor enough for the inf-sup condition, or
//! nearly incompressible tissue locks or its pressure oscillates. The numerical
//! inf-sup value of Chapelle & Bathe (1993), a clamped unit square or cube in N^d
//! elements, decides (N doubles in the plane; 2 to 5, `Hex27` to 4, in space):
//!
//! | element, basis | inf-sup value | |
//! |---|---|---|
//! | `Quad9`, 1 xi eta | .52 .51 .48 .47 | stable |
//! | `Quad8`, 1 | .62 .57 .53 .50 | **stable: taken** |
//! | `Quad8`, 1 xi eta | .22 .16 .09 .05, two spurious modes | falls with the mesh size |
//! | `Hex27`, 1 xi eta zeta | .39 .39 .39 | stable |
//! | `Hex20`, 1 | .48 .42 .38 .33, one spurious mode | **taken**, as `Hex8`'s |
//! | `Hex20`, 1 xi eta zeta | .16 .13 .09 .06, a spurious mode for every node within | unusable |
//!
//! Without an inner node nothing balances a linear dilatation inside the
//! element. The constant costs the serendipity elements one order of convergence:
//! they are here for files and for comparisons on equal meshes; `Quad9` and `Hex27`
//! are the quadratic elements to choose.

use super::shape::{TET10_EDGES, linear_1d, quadratic_1d, serendipity, tensor, tetrahedron};
use serde::{Deserialize, Serialize};

/// Kind of solid element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ElementKind {
    /// Trilinear hexahedron, mean dilatation constant in the element (Q1/P0).
    Hex8,
    /// Serendipity hexahedron, mean dilatation constant in the element.
    Hex20,
    /// Triquadratic hexahedron, dilatation linear in the element (Q2/P-1).
    Hex27,
    /// Quadratic tetrahedron, mean dilatation constant in the element (P2/P0).
    Tet10,
    /// Linear tetrahedron. Its mean dilatation is its own, so it locks as nu
    /// nears 0.5: for meshes from files that hold nothing better.
    Tet4,
    /// Bilinear plane-strain quadrilateral, mean dilatation constant (Q1/P0).
    Quad4,
    /// Serendipity plane-strain quadrilateral, mean dilatation constant.
    Quad8,
    /// Biquadratic plane-strain quadrilateral, dilatation linear (Q2/P-1).
    Quad9,
}

/// One quadrature point of a reference element.
#[derive(Clone, Debug)]
pub struct QuadraturePoint {
    /// Reference coordinates.
    pub xi: [f64; 3],
    /// Weight; the weights sum to the reference volume (area in the plane).
    pub weight: f64,
}

/// Reference coordinates on the lattice `{-1, 0, 1}^3` in VTK order: corners,
/// middles of edges, of faces, of the body. `Hex8` takes 8, `Hex20` takes 20.
pub const HEX27_LATTICE: [[i8; 3]; 27] = [
    [-1, -1, -1],
    [1, -1, -1],
    [1, 1, -1],
    [-1, 1, -1],
    [-1, -1, 1],
    [1, -1, 1],
    [1, 1, 1],
    [-1, 1, 1],
    [0, -1, -1],
    [1, 0, -1],
    [0, 1, -1],
    [-1, 0, -1],
    [0, -1, 1],
    [1, 0, 1],
    [0, 1, 1],
    [-1, 0, 1],
    [-1, -1, 0],
    [1, -1, 0],
    [1, 1, 0],
    [-1, 1, 0],
    [-1, 0, 0],
    [1, 0, 0],
    [0, -1, 0],
    [0, 1, 0],
    [0, 0, -1],
    [0, 0, 1],
    [0, 0, 0],
];

/// The same in the plane: `Quad4` takes 4, `Quad8` takes 8.
pub const QUAD9_LATTICE: [[i8; 3]; 9] = [
    [-1, -1, 0],
    [1, -1, 0],
    [1, 1, 0],
    [-1, 1, 0],
    [0, -1, 0],
    [1, 0, 0],
    [0, 1, 0],
    [-1, 0, 0],
    [0, 0, 0],
];

impl ElementKind {
    /// Every kind.
    pub const ALL: [Self; 8] = [
        Self::Hex8,
        Self::Hex20,
        Self::Hex27,
        Self::Tet10,
        Self::Tet4,
        Self::Quad4,
        Self::Quad8,
        Self::Quad9,
    ];

    /// Number of nodes.
    #[must_use]
    pub const fn nodes(self) -> usize {
        match self {
            Self::Hex8 | Self::Quad8 => 8,
            Self::Hex20 => 20,
            Self::Hex27 => 27,
            Self::Tet10 => 10,
            Self::Tet4 | Self::Quad4 => 4,
            Self::Quad9 => 9,
        }
    }

    /// Whether it is a plane-strain element in the plane z = 0.
    #[must_use]
    pub const fn is_planar(self) -> bool {
        matches!(self, Self::Quad4 | Self::Quad8 | Self::Quad9)
    }

    /// Coordinates that its functions depend on: 2 or 3.
    #[must_use]
    pub const fn dimension(self) -> usize {
        if self.is_planar() { 2 } else { 3 }
    }

    /// Nodes on the lattice `{-1, 0, 1}^3`; none for tetrahedra.
    #[must_use]
    pub fn lattice(self) -> &'static [[i8; 3]] {
        match self {
            Self::Hex8 | Self::Hex20 | Self::Hex27 => &HEX27_LATTICE[..self.nodes()],
            Self::Quad4 | Self::Quad8 | Self::Quad9 => &QUAD9_LATTICE[..self.nodes()],
            Self::Tet4 | Self::Tet10 => &[],
        }
    }

    /// Node intervals along an edge: 2 for quadratic elements.
    #[must_use]
    pub const fn order(self) -> usize {
        match self {
            Self::Hex8 | Self::Tet4 | Self::Quad4 => 1,
            Self::Hex20 | Self::Hex27 | Self::Tet10 | Self::Quad8 | Self::Quad9 => 2,
        }
    }

    /// Number of functions in the dilatation basis.
    #[must_use]
    pub const fn dilatation_functions(self) -> usize {
        match self {
            Self::Hex27 => 4,
            Self::Quad9 => 3,
            _ => 1,
        }
    }

    /// VTK cell type.
    #[must_use]
    pub const fn vtk_cell_type(self) -> u8 {
        match self {
            Self::Hex8 => 12,
            Self::Hex20 => 25,
            Self::Hex27 => 29,
            Self::Tet10 => 24,
            Self::Tet4 => 10,
            Self::Quad4 => 9,
            Self::Quad8 => 23,
            Self::Quad9 => 28,
        }
    }

    /// Corner nodes of each side: faces counter-clockwise seen from outside, in
    /// the order of the face nodes of `Hex27`; edges of a planar element with
    /// the body on the left, in the order of the mid-edge nodes.
    #[must_use]
    pub const fn sides(self) -> &'static [&'static [usize]] {
        match self {
            Self::Hex8 | Self::Hex20 | Self::Hex27 => &[
                &[0, 4, 7, 3],
                &[1, 2, 6, 5],
                &[0, 1, 5, 4],
                &[3, 7, 6, 2],
                &[0, 3, 2, 1],
                &[4, 5, 6, 7],
            ],
            Self::Tet4 | Self::Tet10 => &[&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[0, 3, 2]],
            Self::Quad4 | Self::Quad8 | Self::Quad9 => &[&[0, 1], &[1, 2], &[2, 3], &[3, 0]],
        }
    }

    /// Reference coordinates of the node `a`.
    #[must_use]
    pub fn node_xi(self, a: usize) -> [f64; 3] {
        if let Some(at) = self.lattice().get(a) {
            return at.map(f64::from);
        }
        let corner = |c: usize| std::array::from_fn(|i| if c == i + 1 { 1.0 } else { 0.0 });
        if a < 4 {
            corner(a)
        } else {
            let [p, q] = TET10_EDGES[a - 4];
            let (p, q): ([f64; 3], [f64; 3]) = (corner(p), corner(q));
            std::array::from_fn(|i| 0.5 * (p[i] + q[i]))
        }
    }

    /// Reference coordinates of the middle of a side, by its place in
    /// [`Self::sides`].
    #[must_use]
    pub fn side_centre(self, side: usize) -> [f64; 3] {
        let corners = self.sides()[side];
        let sum = |i: usize| corners.iter().map(|&c| self.node_xi(c)[i]).sum::<f64>();
        std::array::from_fn(|i| sum(i) / corners.len() as f64)
    }

    /// Values and reference gradients of the shape functions at `xi`, written
    /// to the first `nodes()` entries. Planar elements: third component 0.
    pub fn shape(self, xi: [f64; 3], value: &mut [f64], gradient: &mut [[f64; 3]]) {
        let d = self.dimension();
        match self {
            Self::Hex8 | Self::Quad4 => tensor(self.lattice(), d, xi, linear_1d, value, gradient),
            Self::Hex27 | Self::Quad9 => {
                tensor(self.lattice(), d, xi, quadratic_1d, value, gradient);
            }
            Self::Hex20 | Self::Quad8 => serendipity(self.lattice(), d, xi, value, gradient),
            Self::Tet4 => tetrahedron(false, xi, value, gradient),
            Self::Tet10 => tetrahedron(true, xi, value, gradient),
        }
    }

    /// Quadrature that integrates the element's stiffness.
    #[must_use]
    pub fn quadrature(self) -> Vec<QuadraturePoint> {
        match self {
            Self::Hex8 | Self::Quad4 => tensor_quadrature(&GAUSS_2, self.dimension()),
            Self::Hex20 | Self::Hex27 | Self::Quad8 | Self::Quad9 => {
                tensor_quadrature(&GAUSS_3, self.dimension())
            }
            Self::Tet10 => {
                // Four points, degree 2.
                let (a, b) = (0.585_410_196_624_968_5, 0.138_196_601_125_010_5);
                let points = [[b, b, b], [a, b, b], [b, a, b], [b, b, a]];
                points.map(|xi| QuadraturePoint { xi, weight: 1.0 / 24.0 }).to_vec()
            }
            Self::Tet4 => vec![QuadraturePoint { xi: [0.25; 3], weight: 1.0 / 6.0 }],
        }
    }

    /// Dilatation basis at `xi`: `1`; `1, xi, eta`; or `1, xi, eta, zeta`.
    #[must_use]
    pub fn dilatation_basis(self, xi: [f64; 3]) -> [f64; 4] {
        let linear = [1.0, xi[0], xi[1], xi[2]];
        let functions = self.dilatation_functions();
        std::array::from_fn(|m| if m < functions { linear[m] } else { 0.0 })
    }
}

/// Gauss points and weights on `[-1, 1]`.
type Rule<'a> = &'a [(f64, f64)];
/// Points and weights on [-1, 1], exact to degree 3.
pub const GAUSS_2: [(f64, f64); 2] =
    [(-0.577_350_269_189_625_8, 1.0), (0.577_350_269_189_625_8, 1.0)];
/// Three points of Gauss and their weights on [-1, 1].
pub const GAUSS_3: [(f64, f64); 3] =
    [(-0.774_596_669_241_483_4, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)];

/// Products of a rule along two or three axes; the third coordinate is 0 in the plane.
fn tensor_quadrature(rule: Rule<'_>, dimension: usize) -> Vec<QuadraturePoint> {
    let through: Rule<'_> = if dimension == 3 { rule } else { &[(0.0, 1.0)] };
    let mut points = Vec::with_capacity(rule.len().pow(2) * through.len());
    for &(z, wz) in through {
        for &(y, wy) in rule {
            for &(x, wx) in rule {
                points.push(QuadraturePoint { xi: [x, y, z], weight: wx * wy * wz });
            }
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shape_functions_interpolate_and_sum_to_one() {
        for kind in ElementKind::ALL {
            let n = kind.nodes();
            let (mut v, mut g) = (vec![0.0; n], vec![[0.0; 3]; n]);
            for b in 0..n {
                kind.shape(kind.node_xi(b), &mut v, &mut g);
                for a in 0..n {
                    let expected = if a == b { 1.0 } else { 0.0 };
                    assert!((v[a] - expected).abs() < 1e-14, "{kind:?} N{a} at node {b}");
                }
            }
            for q in kind.quadrature() {
                kind.shape(q.xi, &mut v, &mut g);
                assert!((v.iter().sum::<f64>() - 1.0).abs() < 1e-14);
                for i in 0..3 {
                    assert!(g.iter().map(|d| d[i]).sum::<f64>().abs() < 1e-13, "{kind:?}");
                }
            }
        }
    }

    #[test]
    fn gradients_are_derivatives_of_the_values() {
        let h = 1e-6;
        for kind in ElementKind::ALL {
            let n = kind.nodes();
            let (mut v, mut g) = (vec![0.0; n], vec![[0.0; 3]; n]);
            let (mut plus, mut minus, mut unused) = (v.clone(), v.clone(), g.clone());
            let xi = [0.13, 0.21, 0.32];
            kind.shape(xi, &mut v, &mut g);
            for i in 0..3 {
                let at =
                    |s: f64| std::array::from_fn(|k| if k == i { xi[k] + s * h } else { xi[k] });
                kind.shape(at(1.0), &mut plus, &mut unused);
                kind.shape(at(-1.0), &mut minus, &mut unused);
                for a in 0..n {
                    let d = (plus[a] - minus[a]) / (2.0 * h);
                    assert!((d - g[a][i]).abs() < 1e-9, "{kind:?} dN{a}/dxi{i}");
                }
            }
        }
    }

    /// Each kind reproduces the polynomials that it should.
    #[test]
    fn quadratic_kinds_reproduce_quadratics() {
        for kind in ElementKind::ALL {
            let n = kind.nodes();
            let (mut v, mut g) = (vec![0.0; n], vec![[0.0; 3]; n]);
            let xi = [0.13, 0.21, if kind.is_planar() { 0.0 } else { 0.32 }];
            kind.shape(xi, &mut v, &mut g);
            let field = |x: [f64; 3]| {
                let linear = 0.3 + x[0] - 2.0 * x[1] + 0.5 * x[2];
                if kind.order() == 1 {
                    linear
                } else {
                    linear + x[0] * x[0] - x[1] * x[1] + 2.0 * x[2] * x[2] + x[0] * x[1]
                        - x[1] * x[2]
                }
            };
            let found: f64 = (0..n).map(|a| v[a] * field(kind.node_xi(a))).sum();
            assert!((found - field(xi)).abs() < 1e-14, "{kind:?}");
        }
    }

    #[test]
    fn weights_sum_to_the_reference_volume() {
        for kind in ElementKind::ALL {
            let volume: f64 = kind.quadrature().iter().map(|q| q.weight).sum();
            let expected = match kind {
                ElementKind::Tet4 | ElementKind::Tet10 => 1.0 / 6.0,
                _ if kind.is_planar() => 4.0,
                _ => 8.0,
            };
            assert!((volume - expected).abs() < 1e-14, "{kind:?}");
        }
    }

    /// The node in the middle of two corners comes where sides and VTK say.
    #[test]
    fn mid_edge_nodes_of_planar_kinds_follow_their_sides() {
        for (s, side) in ElementKind::Quad8.sides().iter().enumerate() {
            let [a, b] = [side[0], side[1]].map(|c| ElementKind::Quad8.node_xi(c));
            let middle = ElementKind::Quad8.node_xi(4 + s);
            assert!((0..3).all(|i| (2.0 * middle[i] - a[i] - b[i]).abs() < 1e-15), "side {s}");
        }
    }
}
