//! What an element needs of its undeformed shape, computed once per mesh.

use super::reference::ElementKind;

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
}

/// Gradients and weights at the quadrature points of every element of a block.
#[derive(Clone, Debug)]
pub struct BlockGeometry {
    /// Kind of every element of the block.
    pub kind: ElementKind,
    /// Quadrature points per element.
    pub points: usize,
    /// `dN_a/dX`, `[element][point][node][3]`, 1/mm.
    gradients: Vec<[f64; 3]>,
    /// Weight times reference volume, `[element][point]`, mm3.
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
    /// [`ShapeError::Inverted`] names the first element that folds.
    pub fn new(
        kind: ElementKind,
        nodes: &[[f64; 3]],
        connectivity: &[u32],
    ) -> Result<Self, ShapeError> {
        let n = kind.nodes();
        let m = kind.dilatation_functions();
        let quadrature = kind.quadrature();
        let elements = connectivity.len() / n;
        let mut value = vec![0.0; n];
        let mut tables = Vec::new();
        for q in &quadrature {
            let mut gradient = vec![[0.0; 3]; n];
            kind.shape(q.xi, &mut value, &mut gradient);
            tables.push(gradient);
        }
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
            let mut gram = [[0.0; 4]; 4];
            for (p, q) in quadrature.iter().enumerate() {
                let (inverse, determinant) =
                    jacobian(conn.iter().map(|&a| nodes[a as usize]), &tables[p]);
                if !(determinant > 0.0) {
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

/// Inverse and determinant of `dX/dxi`; the inverse is `[xi][X]`.
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
    let c = crate::material::kinematics::cofactor(&j);
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
