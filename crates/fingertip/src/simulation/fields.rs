//! Fields of a whole body at one equilibrium, for looking at.

use super::body::Body;
use papilla_fem::element::HistoryVariables;
use papilla_fem::element::geometry::displacement_gradient;
use papilla_fem::solve::Solver;
use papilla_solid::tensor::Kinematics;

/// Pa per MPa, and J/m3 per mJ/mm3.
pub const PA_PER_MPA: f64 = 1e6;

/// Element means, in the order of the mesh's blocks.
pub struct ElementFields {
    /// SED, J/m3 of undeformed volume.
    pub sed_j_per_m3: Vec<f64>,
    /// Volume over undeformed volume.
    pub volume_ratio: Vec<f64>,
    /// [`Tissue::index`](crate::tissue::Tissue::index).
    pub layer: Vec<i32>,
}

impl ElementFields {
    /// Of the body at the solver's equilibrium.
    #[must_use]
    pub fn new(body: &Body, solver: &Solver<'_>) -> Self {
        let mut fields =
            Self { sed_j_per_m3: Vec::new(), volume_ratio: Vec::new(), layer: Vec::new() };
        let (problem, u) = (&body.problem, solver.displacement_mm());
        for (b, (block, geometry)) in problem.mesh.blocks.iter().zip(&problem.geometry).enumerate()
        {
            let n = block.kind.nodes();
            let mut force = vec![[0.0; 3]; n];
            for e in 0..block.len() {
                let local: Vec<_> = block.element(e).iter().map(|&n| u[n as usize]).collect();
                let solid = &problem.materials[block.region[e]];
                let shape = geometry.element(e);
                let history = solver.history_of(b, e);
                let memory = HistoryVariables { history, dt_s: 0.0 };
                // An equilibrium has no inverted element; NaN would show one.
                let theta = solid
                    .evaluate(shape, &local, memory, &mut force, None)
                    .map_or([f64::NAN; 4], |s| s.theta_minus_1);
                let (mut energy, mut volume, mut growth) = (0.0, 0.0, 0.0);
                let len = solid.history_len();
                for (q, gradients) in shape.gradients.chunks_exact(n).enumerate() {
                    let k = Kinematics::new(displacement_gradient(&local, gradients));
                    let t: f64 = shape.basis[q].iter().zip(theta).map(|(b, t)| b * t).sum();
                    let own = &history[q * len..(q + 1) * len];
                    let weight = shape.weights[q];
                    energy += weight * solid.stored_mpa(&k, t, own);
                    volume += weight;
                    growth += weight * t;
                }
                fields.sed_j_per_m3.push(energy / volume * PA_PER_MPA);
                fields.volume_ratio.push(1.0 + growth / volume);
                fields.layer.push(block.region[e].index() as i32);
            }
        }
        fields
    }
}
