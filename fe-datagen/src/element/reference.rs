//! Reference elements: nodes, shape functions, quadrature, pressure basis.
//!
//! Hexahedra live on `[-1, 1]^3` and number their nodes as VTK does
//! (`VTK_HEXAHEDRON`, `VTK_TRIQUADRATIC_HEXAHEDRON`); tetrahedra live on the
//! unit simplex.

use serde::{Deserialize, Serialize};

/// Kind of solid element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ElementKind {
    /// Trilinear hexahedron, mean dilatation constant in the element (Q1/P0).
    Hex8,
    /// Triquadratic hexahedron, dilatation linear in the element (Q2/P-1).
    Hex27,
    /// Quadratic tetrahedron, mean dilatation constant in the element (P2/P0).
    Tet10,
    /// Linear tetrahedron. Its mean dilatation is its own, so it locks as nu
    /// nears 0.5: for meshes from files that hold nothing better.
    Tet4,
}

/// One quadrature point of a reference element.
#[derive(Clone, Debug)]
pub struct QuadraturePoint {
    /// Reference coordinates.
    pub xi: [f64; 3],
    /// Weight; the weights sum to the reference volume.
    pub weight: f64,
}

/// Reference coordinates on the lattice `{-1, 0, 1}^3` in VTK order; the first
/// eight are the corners.
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

/// Edges of a tetrahedron in the order of its mid-edge nodes (VTK).
pub const TET10_EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];

impl ElementKind {
    /// Number of nodes.
    #[must_use]
    pub const fn nodes(self) -> usize {
        match self {
            Self::Hex8 => 8,
            Self::Hex27 => 27,
            Self::Tet10 => 10,
            Self::Tet4 => 4,
        }
    }

    /// Number of functions in the dilatation basis.
    #[must_use]
    pub const fn dilatation_functions(self) -> usize {
        match self {
            Self::Hex27 => 4,
            _ => 1,
        }
    }

    /// VTK cell type.
    #[must_use]
    pub const fn vtk_cell_type(self) -> u8 {
        match self {
            Self::Hex8 => 12,
            Self::Hex27 => 29,
            Self::Tet10 => 24,
            Self::Tet4 => 10,
        }
    }

    /// Reference coordinates of the node `a`.
    #[must_use]
    pub fn node_xi(self, a: usize) -> [f64; 3] {
        match self {
            Self::Hex8 | Self::Hex27 => HEX27_LATTICE[a].map(f64::from),
            Self::Tet4 | Self::Tet10 => {
                let corner = |c: usize| std::array::from_fn(|i| if c == i + 1 { 1.0 } else { 0.0 });
                if a < 4 {
                    corner(a)
                } else {
                    let [p, q] = TET10_EDGES[a - 4];
                    let (p, q): ([f64; 3], [f64; 3]) = (corner(p), corner(q));
                    std::array::from_fn(|i| 0.5 * (p[i] + q[i]))
                }
            }
        }
    }

    /// Values and reference gradients of the shape functions at `xi`, written
    /// to the first `nodes()` entries.
    pub fn shape(self, xi: [f64; 3], value: &mut [f64], gradient: &mut [[f64; 3]]) {
        match self {
            Self::Hex8 => tensor_shape(&HEX27_LATTICE[..8], xi, linear_1d, value, gradient),
            Self::Hex27 => tensor_shape(&HEX27_LATTICE, xi, quadratic_1d, value, gradient),
            Self::Tet4 | Self::Tet10 => tetrahedron_shape(self, xi, value, gradient),
        }
    }

    /// Quadrature that integrates the element's stiffness.
    #[must_use]
    pub fn quadrature(self) -> Vec<QuadraturePoint> {
        match self {
            Self::Hex8 => tensor_quadrature(&GAUSS_2),
            Self::Hex27 => tensor_quadrature(&GAUSS_3),
            Self::Tet10 => {
                // Four points, degree 2.
                let (a, b) = (0.585_410_196_624_968_5, 0.138_196_601_125_010_5);
                let points = [[b, b, b], [a, b, b], [b, a, b], [b, b, a]];
                points.map(|xi| QuadraturePoint { xi, weight: 1.0 / 24.0 }).to_vec()
            }
            Self::Tet4 => vec![QuadraturePoint { xi: [0.25; 3], weight: 1.0 / 6.0 }],
        }
    }

    /// Dilatation basis at `xi`: `1`, or `1, xi, eta, zeta`.
    #[must_use]
    pub fn dilatation_basis(self, xi: [f64; 3]) -> [f64; 4] {
        match self {
            Self::Hex27 => [1.0, xi[0], xi[1], xi[2]],
            _ => [1.0, 0.0, 0.0, 0.0],
        }
    }
}

/// Gauss points and weights on `[-1, 1]`.
type Rule<'a> = &'a [(f64, f64)];
pub(crate) const GAUSS_2: [(f64, f64); 2] =
    [(-0.577_350_269_189_625_8, 1.0), (0.577_350_269_189_625_8, 1.0)];
pub(crate) const GAUSS_3: [(f64, f64); 3] =
    [(-0.774_596_669_241_483_4, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)];

fn tensor_quadrature(rule: Rule<'_>) -> Vec<QuadraturePoint> {
    let mut points = Vec::with_capacity(rule.len().pow(3));
    for &(z, wz) in rule {
        for &(y, wy) in rule {
            for &(x, wx) in rule {
                points.push(QuadraturePoint { xi: [x, y, z], weight: wx * wy * wz });
            }
        }
    }
    points
}

/// Linear function of the node at `at` (-1 or 1) and its slope.
pub(crate) fn linear_1d(at: i8, x: f64) -> (f64, f64) {
    let s = f64::from(at);
    (0.5 * (1.0 + s * x), 0.5 * s)
}

/// Quadratic Lagrange function of the node at `at` (-1, 0 or 1) and its slope.
pub(crate) fn quadratic_1d(at: i8, x: f64) -> (f64, f64) {
    match at {
        0 => (1.0 - x * x, -2.0 * x),
        s => {
            let s = f64::from(s);
            (0.5 * x * (x + s), x + 0.5 * s)
        }
    }
}

fn tensor_shape(
    lattice: &[[i8; 3]],
    xi: [f64; 3],
    one_d: fn(i8, f64) -> (f64, f64),
    value: &mut [f64],
    gradient: &mut [[f64; 3]],
) {
    for (a, at) in lattice.iter().enumerate() {
        let (x, dx) = one_d(at[0], xi[0]);
        let (y, dy) = one_d(at[1], xi[1]);
        let (z, dz) = one_d(at[2], xi[2]);
        value[a] = x * y * z;
        gradient[a] = [dx * y * z, x * dy * z, x * y * dz];
    }
}

fn tetrahedron_shape(
    kind: ElementKind,
    xi: [f64; 3],
    value: &mut [f64],
    gradient: &mut [[f64; 3]],
) {
    let l = [1.0 - xi[0] - xi[1] - xi[2], xi[0], xi[1], xi[2]];
    let dl = [[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    if kind == ElementKind::Tet4 {
        value[..4].copy_from_slice(&l);
        gradient[..4].copy_from_slice(&dl);
        return;
    }
    for a in 0..4 {
        value[a] = l[a] * (2.0 * l[a] - 1.0);
        gradient[a] = dl[a].map(|d| (4.0 * l[a] - 1.0) * d);
    }
    for (e, [p, q]) in TET10_EDGES.into_iter().enumerate() {
        value[4 + e] = 4.0 * l[p] * l[q];
        gradient[4 + e] = std::array::from_fn(|i| 4.0 * (dl[p][i] * l[q] + l[p] * dl[q][i]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KINDS: [ElementKind; 4] =
        [ElementKind::Hex8, ElementKind::Hex27, ElementKind::Tet10, ElementKind::Tet4];

    #[test]
    fn shape_functions_interpolate_and_sum_to_one() {
        for kind in KINDS {
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
    fn weights_sum_to_the_reference_volume() {
        for kind in KINDS {
            let volume: f64 = kind.quadrature().iter().map(|q| q.weight).sum();
            let expected =
                if kind.nodes() % 2 == 0 && kind != ElementKind::Hex8 { 1.0 / 6.0 } else { 8.0 };
            assert!((volume - expected).abs() < 1e-14, "{kind:?}");
        }
    }
}
