//! Fields at a point of an element.

use super::{Mesh, Region};
use crate::element::geometry::{BlockGeometry, displacement_gradient, jacobian};
use crate::element::{HistoryVariables, Inverted, Materials, extrapolate};
use papilla_solid::tensor::{Kinematics, Mat3};

/// A deformed body, as far as fields at a point need it.
#[derive(Clone, Copy)]
pub struct Deformed<'a> {
    /// Undeformed mesh.
    pub mesh: &'a Mesh,
    /// Undeformed element geometry, one a block.
    pub geometry: &'a [BlockGeometry],
    /// What each region is made of.
    pub materials: &'a Materials,
    /// Displacement, mm, one a mesh node.
    pub u: &'a [[f64; 3]],
    /// History of an element's quadrature points `(block, element)`; empty for
    /// materials without memory.
    pub history: &'a dyn Fn(usize, usize) -> &'a [f64],
}

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
    pub fn region(&self, mesh: &Mesh) -> Region {
        mesh.blocks[self.block].region[self.element]
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
    /// dilatation that the element's energy holds. Evaluated from the strain (and,
    /// with memory, from what the branches hold: the energy that can be got
    /// back), not summed over increments.
    ///
    /// # Errors
    /// [`Inverted`] if the element has turned inside out.
    pub fn sed_mpa(&self, body: &Deformed<'_>) -> Result<f64, Inverted> {
        let local = self.local(body.mesh, body.u);
        let material = &body.materials[self.region(body.mesh)];
        let history = (body.history)(self.block, self.element);
        let shape = body.geometry[self.block].element(self.element);
        let mut force = vec![[0.0; 3]; local.len()];
        let memory = HistoryVariables { history, dt_s: 0.0 };
        let state = material.evaluate(shape, &local, memory, &mut force, None)?;
        let theta: f64 = self.basis.iter().zip(state.theta_minus_1).map(|(b, t)| b * t).sum();
        let k = Kinematics::new(displacement_gradient(&local, &self.gradients));
        let own = self.own_history(body, history, material.history_len());
        Ok(material.stored_mpa(&k, theta, &own))
    }

    /// History of the point from that of the element's quadrature points.
    fn own_history(&self, body: &Deformed<'_>, history: &[f64], len: usize) -> Vec<f64> {
        let mut own = vec![0.0; len];
        if len > 0 {
            let weights = extrapolate::weights(body.mesh.blocks[self.block].kind, self.xi);
            for (point, w) in history.chunks_exact(len).zip(weights) {
                for (o, h) in own.iter_mut().zip(point) {
                    *o += w * h;
                }
            }
        }
        own
    }

    fn local(&self, mesh: &Mesh, field: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let nodes = mesh.blocks[self.block].element(self.element);
        nodes.iter().map(|&n| field[n as usize]).collect()
    }
}
