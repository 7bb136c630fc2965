//! What a stored state says beyond pressure and SED, where a scene gives rise to it.

use super::body::Body;
use crate::element::kernel::displacement_gradient;
use crate::material::Kinematics;
use crate::solve::Solver;

impl Body {
    /// True (Cauchy) shear traction of the indenter on the skin at `nodes`, MPa per
    /// deformed area; empty without friction.
    pub(super) fn shear_mpa(&self, solver: &Solver<'_>, nodes: &[u32]) -> Vec<[f64; 3]> {
        let nominal = solver.shear_traction_mpa();
        let (Some(contact), false) = (&self.problem.contact, nominal.is_empty()) else {
            return Vec::new();
        };
        let x = solver.deformed();
        let mut deformed = vec![0.0; x.len()];
        let surface = &self.problem.mesh.surfaces[&self.contact];
        surface.add_nodal_areas(&|n| x[n as usize], &mut deformed);
        let mut shear = vec![[0.0; 3]; x.len()];
        for ((&n, &area), t) in contact.nodes.iter().zip(&contact.area_mm2).zip(nominal) {
            shear[n as usize] = t.map(|v| v * area / deformed[n as usize]);
        }
        nodes.iter().map(|&n| shear[n as usize]).collect()
    }

    /// Share of the undeformed volume that has left the stretches to which its law was
    /// fitted; 0 for laws that hold anywhere.
    pub(super) fn outside_calibration(&self, solver: &Solver<'_>) -> f64 {
        let (problem, u) = (&self.problem, solver.displacement_mm());
        let (mut outside, mut all) = (0.0, 0.0);
        for (block, geometry) in problem.mesh.blocks.iter().zip(&problem.geometry) {
            let n = block.kind.nodes();
            for e in 0..block.len() {
                let solid = &problem.materials[block.tissue[e].index()];
                let local: Vec<_> = block.element(e).iter().map(|&a| u[a as usize]).collect();
                let shape = geometry.element(e);
                for (gradients, weight) in shape.gradients.chunks_exact(n).zip(shape.weights) {
                    let k = Kinematics::new(displacement_gradient(&local, gradients));
                    all += weight;
                    if solid.outside_calibration(&k) {
                        outside += weight;
                    }
                }
            }
        }
        outside / all
    }
}
