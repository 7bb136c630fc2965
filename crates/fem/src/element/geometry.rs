//! What an element needs of its undeformed shape, computed once per mesh.

use super::reference::ElementKind;
use papilla_solid::tensor::Mat3;

/// Why an element's undeformed shape was refused.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum ShapeError {
    /// The map from the reference element folds.
    #[error(
        "element {element} is inverted or flat: det dX/dxi = {determinant:.3e} at quadrature point \
         {point}; check its node order"
    )]
    Inverted {
        /// Element index in its block.
        element: usize,
        /// Quadrature point.
        point: usize,
        /// Jacobian determinant, mm3.
        determinant: f64,
    },
    /// A node of a plane-strain element lies off the plane.
    #[error(
        "element {element} is planar but one of its nodes has z = {z_mm} mm; plane-strain meshes lie in \
         the plane z = 0"
    )]
    OffPlane {
        /// Element index in its block.
        element: usize,
        /// Offending coordinate, mm.
        z_mm: f64,
    },
}

/// Gradients and weights at the quadrature points of every element of a block.
#[derive(Clone, Debug)]
pub struct BlockGeometry {
    /// Kind of every element of the block.
    pub kind: ElementKind,
    /// Quadrature points per element.
    pub points: usize,
    /// `dN_a/dX`, `[element][point][node][3]`, 1/mm; planar elements have no
    /// third component.
    gradients: Vec<[f64; 3]>,
    /// Weight times reference volume, `[element][point]`, mm3; of planar
    /// elements area times 1 mm of thickness.
    weights: Vec<f64>,
    /// Inverse of `integral psi_m psi_n dV`, `[element][m * M + n]`, 1/mm3.
    inverse_gram: Vec<f64>,
    /// Dilatation basis at the points, `[point]`.
    pub basis: Vec<[f64; 4]>,
}

/// One element's share of a [`BlockGeometry`].
#[derive(Clone, Copy, Debug)]
pub struct ElementGeometry<'a> {
    /// `[point][node]`.
    pub gradients: &'a [[f64; 3]],
    /// `[point]`.
    pub weights: &'a [f64],
    /// `[m * M + n]`.
    pub inverse_gram: &'a [f64],
    /// `[point]`.
    pub basis: &'a [[f64; 4]],
}

impl BlockGeometry {
    /// Geometry of elements of one kind.
    ///
    /// `connectivity` holds `kind.nodes()` indices per element into `nodes`, mm.
    ///
    /// # Errors
    /// [`ShapeError`] names the first element that folds or leaves its plane.
    pub fn new(
        kind: ElementKind,
        nodes: &[[f64; 3]],
        connectivity: &[u32],
    ) -> Result<Self, ShapeError> {
        let n = kind.nodes();
        let m = kind.dilatation_functions();
        let quadrature = kind.quadrature();
        let elements = connectivity.len() / n;
        let tables = gradients_at_points(kind);
        let basis: Vec<_> = quadrature.iter().map(|q| kind.dilatation_basis(q.xi)).collect();
        let mut out = Self {
            kind,
            points: quadrature.len(),
            gradients: Vec::with_capacity(elements * quadrature.len() * n),
            weights: Vec::with_capacity(elements * quadrature.len()),
            inverse_gram: Vec::with_capacity(elements * m * m),
            basis,
        };
        for e in 0..elements {
            let conn = &connectivity[e * n..(e + 1) * n];
            let z = |&a: &u32| nodes[a as usize][2];
            if let Some(z_mm) = conn.iter().map(z).find(|z| kind.is_planar() && *z != 0.0) {
                return Err(ShapeError::OffPlane { element: e, z_mm });
            }
            let mut gram = [[0.0; 4]; 4];
            for (p, q) in quadrature.iter().enumerate() {
                let (inverse, determinant) =
                    jacobian(conn.iter().map(|&a| nodes[a as usize]), &tables[p]);
                if is_folded(determinant) {
                    return Err(ShapeError::Inverted { element: e, point: p, determinant });
                }
                let weight = q.weight * determinant;
                out.weights.push(weight);
                for d in &tables[p] {
                    out.gradients.push(std::array::from_fn(|i| {
                        d[0] * inverse[0][i] + d[1] * inverse[1][i] + d[2] * inverse[2][i]
                    }));
                }
                for r in 0..m {
                    for c in 0..m {
                        gram[r][c] += weight * out.basis[p][r] * out.basis[p][c];
                    }
                }
            }
            push_inverse(&gram, m, &mut out.inverse_gram);
        }
        Ok(out)
    }

    /// The share of element `e`.
    #[inline]
    #[must_use]
    pub fn element(&self, e: usize) -> ElementGeometry<'_> {
        let n = self.kind.nodes();
        let mm = self.kind.dilatation_functions().pow(2);
        ElementGeometry {
            gradients: &self.gradients[e * self.points * n..(e + 1) * self.points * n],
            weights: &self.weights[e * self.points..(e + 1) * self.points],
            inverse_gram: &self.inverse_gram[e * mm..(e + 1) * mm],
            basis: &self.basis,
        }
    }
}

/// Elements of a block that fold: [`BlockGeometry::new`] refuses it if there is one.
#[must_use]
pub fn folded(kind: ElementKind, nodes: &[[f64; 3]], connectivity: &[u32]) -> Vec<usize> {
    let tables = gradients_at_points(kind);
    let folds = |element: &[u32]| {
        let of = |table| jacobian(element.iter().map(|&a| nodes[a as usize]), table).1;
        tables.iter().any(|table| is_folded(of(table)))
    };
    let elements = connectivity.chunks_exact(kind.nodes()).enumerate();
    elements.filter(|(_, element)| folds(element)).map(|(e, _)| e).collect()
}

/// Whether the map from the reference element folds at a point, by its determinant there; NaN does.
fn is_folded(determinant: f64) -> bool {
    !(determinant > 0.0)
}

/// Gradients of the shape functions in the reference element, `[point][node]`.
fn gradients_at_points(kind: ElementKind) -> Vec<Vec<[f64; 3]>> {
    let mut value = vec![0.0; kind.nodes()];
    let of = |xi| {
        let mut gradient = vec![[0.0; 3]; kind.nodes()];
        kind.shape(xi, &mut value, &mut gradient);
        gradient
    };
    kind.quadrature().iter().map(|q| q.xi).map(of).collect()
}

/// Inverse and determinant of `dX/dxi`; the inverse is `[xi][X]`.
///
/// Functions that do not depend on the third reference coordinate are those of a
/// planar element: that coordinate then runs through its 1 mm of thickness, and
/// the determinant is the one of the plane.
pub fn jacobian(
    nodes: impl Iterator<Item = [f64; 3]>,
    reference_gradients: &[[f64; 3]],
) -> ([[f64; 3]; 3], f64) {
    let mut j = [[0.0; 3]; 3];
    for (x, d) in nodes.zip(reference_gradients) {
        for i in 0..3 {
            for k in 0..3 {
                j[i][k] += x[i] * d[k];
            }
        }
    }
    if reference_gradients.iter().all(|d| d[2] == 0.0) {
        j[2][2] = 1.0;
    }
    let c = papilla_solid::tensor::cofactor(&j);
    let determinant = j[0][0] * c[0][0] + j[0][1] * c[0][1] + j[0][2] * c[0][2];
    (std::array::from_fn(|k| std::array::from_fn(|i| c[i][k] / determinant)), determinant)
}

/// Appends the inverse of the leading `m x m` block (symmetric positive
/// definite, m <= 4) by Gauss-Jordan elimination.
fn push_inverse(gram: &[[f64; 4]; 4], m: usize, out: &mut Vec<f64>) {
    let mut a = *gram;
    let mut inverse = [[0.0; 4]; 4];
    for (i, row) in inverse.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    for p in 0..m {
        let pivot = 1.0 / a[p][p];
        for c in 0..m {
            a[p][c] *= pivot;
            inverse[p][c] *= pivot;
        }
        for r in 0..m {
            if r != p {
                let factor = a[r][p];
                for c in 0..m {
                    a[r][c] -= factor * a[p][c];
                    inverse[r][c] -= factor * inverse[p][c];
                }
            }
        }
    }
    for row in inverse.iter().take(m) {
        out.extend_from_slice(&row[..m]);
    }
}

/// Displacement gradient at a point from nodal displacements.
#[inline(always)]
pub fn displacement_gradient(u: &[[f64; 3]], gradients: &[[f64; 3]]) -> Mat3 {
    let mut h = [[0.0; 3]; 3];
    for (v, g) in u.iter().zip(gradients) {
        for i in 0..3 {
            for j in 0..3 {
                h[i][j] += v[i] * g[j];
            }
        }
    }
    h
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sheared square with one bent side: area in closed form.
    #[test]
    fn planar_weights_are_area_and_gradients_stay_in_the_plane() {
        for kind in [ElementKind::Quad4, ElementKind::Quad8, ElementKind::Quad9] {
            let bend = if kind.order() == 2 { 0.3 } else { 0.0 };
            let nodes: Vec<[f64; 3]> = (0..kind.nodes())
                .map(|a| {
                    let [x, y, _] = kind.node_xi(a);
                    // The side y = -1 sinks by a parabola.
                    [2.0 * x + 0.5 * y, 1.5 * y - 0.5 * bend * (1.0 - x * x) * (1.0 - y), 0.0]
                })
                .collect();
            let connectivity: Vec<u32> = (0..kind.nodes() as u32).collect();
            let g = BlockGeometry::new(kind, &nodes, &connectivity).unwrap();
            let area: f64 = g.element(0).weights.iter().sum();
            // Parallelogram 4 x 3 and a parabolic segment, 2/3 of 4 x bend; the
            // serendipity functions hold x^2 y, the others hold it too.
            assert!((area - (12.0 + 2.0 / 3.0 * 4.0 * bend)).abs() < 1e-13, "{kind:?} {area}");
            assert!(g.element(0).gradients.iter().all(|d| d[2] == 0.0));
        }
    }

    #[test]
    fn folds_and_nodes_off_the_plane_are_refused() {
        let mut nodes = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let new = |nodes: &[[f64; 3]], c: &[u32]| BlockGeometry::new(ElementKind::Quad4, nodes, c);
        assert!(matches!(
            new(&nodes, &[0, 3, 2, 1]).unwrap_err(),
            ShapeError::Inverted { element: 0, point: 0, .. }
        ));
        assert_eq!(folded(ElementKind::Quad4, &nodes, &[0, 1, 2, 3, 0, 3, 2, 1]), [1]);
        nodes[2][2] = 0.1;
        assert_eq!(
            new(&nodes, &[0, 1, 2, 3]).unwrap_err(),
            ShapeError::OffPlane { element: 0, z_mm: 0.1 }
        );
    }
}
