//! Fields at a point of an element.

use super::{Mesh, Tissue};
use crate::element::Inverted;
use crate::element::geometry::{BlockGeometry, ElementGeometry, jacobian};
use crate::element::kernel::displacement_gradient;
use crate::material::{Kinematics, Mat3, Material};

/// A point of an undeformed element, with what fields there need.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Mesh block.
    pub block: usize,
    /// Element of the block.
    pub element: usize,
    /// Reference coordinates.
    pub xi: [f64; 3],
    /// Shape functions, one a node.
    pub values: Vec<f64>,
    /// `dN/dX`, one a node, 1/mm.
    pub gradients: Vec<[f64; 3]>,
    /// Dilatation basis.
    pub basis: [f64; 4],
}

impl Sample {
    /// The point `xi` of an element.
    #[must_use]
    pub fn new(mesh: &Mesh, block: usize, element: usize, xi: [f64; 3]) -> Self {
        let b = &mesh.blocks[block];
        let n = b.kind.nodes();
        let (mut values, mut reference) = (vec![0.0; n], vec![[0.0; 3]; n]);
        b.kind.shape(xi, &mut values, &mut reference);
        let conn = b.element(element);
        let (inverse, _) = jacobian(conn.iter().map(|&a| mesh.nodes[a as usize]), &reference);
        let gradients = reference
            .iter()
            .map(|d| std::array::from_fn(|i| (0..3).map(|k| d[k] * inverse[k][i]).sum()))
            .collect();
        Self { block, element, xi, values, gradients, basis: b.kind.dilatation_basis(xi) }
    }

    /// What the element is made of.
    #[must_use]
    pub fn tissue(&self, mesh: &Mesh) -> Tissue {
        mesh.blocks[self.block].tissue[self.element]
    }

    /// A nodal vector field (one entry a mesh node) at the point.
    #[must_use]
    pub fn interpolate(&self, mesh: &Mesh, field: &[[f64; 3]]) -> [f64; 3] {
        let local = self.local(mesh, field);
        std::array::from_fn(|i| self.values.iter().zip(&local).map(|(v, l)| v * l[i]).sum())
    }

    /// Displacement gradient of the displacement `u` (mm, one a mesh node).
    #[must_use]
    pub fn displacement_gradient(&self, mesh: &Mesh, u: &[[f64; 3]]) -> Mat3 {
        displacement_gradient(&self.local(mesh, u), &self.gradients)
    }

    /// Strain energy density, MPa (= mJ/mm3) of undeformed volume, with the
    /// dilatation that the element's energy holds. Evaluated from the strain, not
    /// summed over increments.
    ///
    /// # Errors
    /// [`Inverted`] if the element has turned inside out.
    pub fn sed_mpa(
        &self,
        mesh: &Mesh,
        geometry: &[BlockGeometry],
        materials: &[Material],
        u: &[[f64; 3]],
    ) -> Result<f64, Inverted> {
        let local = self.local(mesh, u);
        let theta = dilatation(geometry[self.block].element(self.element), &local)?;
        let theta_minus_1: f64 = self.basis.iter().zip(theta).map(|(b, t)| b * t).sum();
        let k = Kinematics::new(displacement_gradient(&local, &self.gradients));
        Ok(materials[self.tissue(mesh).index()].energy(&k, theta_minus_1))
    }

    fn local(&self, mesh: &Mesh, field: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let nodes = mesh.blocks[self.block].element(self.element);
        nodes.iter().map(|&n| field[n as usize]).collect()
    }
}

/// Coefficients of `theta - 1` in the dilatation basis: the projection of
/// `J - 1`, `M^-1 integral psi (J - 1) dV`.
fn dilatation(geometry: ElementGeometry<'_>, u: &[[f64; 3]]) -> Result<[f64; 4], Inverted> {
    let m = geometry.inverse_gram.len().isqrt();
    let mut b = [0.0; 4];
    let points = geometry.gradients.chunks_exact(u.len()).zip(geometry.weights);
    for (point, ((gradients, weight), basis)) in points.zip(geometry.basis).enumerate() {
        let k = Kinematics::new(displacement_gradient(u, gradients));
        if !(k.j() > 0.0) {
            return Err(Inverted { point, j: k.j() });
        }
        for r in 0..m {
            b[r] += weight * basis[r] * k.j_minus_1;
        }
    }
    let inverse = geometry.inverse_gram;
    Ok(std::array::from_fn(|r| {
        if r < m { (0..m).map(|c| inverse[r * m + c] * b[c]).sum() } else { 0.0 }
    }))
}
