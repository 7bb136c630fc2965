//! History variables of viscoelastic materials: their move over a step, and the energy of a body with
//! it.

use super::history_layout::HistoryLayout;
use super::problem::Problem;
use crate::element::HistoryVariables;
use crate::element::geometry::displacement_gradient;
use papilla_solid::tensor::Kinematics;

/// Deformation at the quadrature points of the elements that have history variables.
fn visit_points(
    problem: &Problem,
    layout: &HistoryLayout,
    u: &[[f64; 3]],
    visit: &mut dyn FnMut(usize, usize, usize, &Kinematics),
) {
    for (b, (block, geometry)) in problem.mesh.blocks.iter().zip(&problem.geometry).enumerate() {
        let n = block.kind.nodes();
        for e in (0..block.len()).filter(|&e| !layout.range(b, e).is_empty()) {
            let local: Vec<_> = block.element(e).iter().map(|&a| u[a as usize]).collect();
            for (q, gradients) in geometry.element(e).gradients.chunks_exact(n).enumerate() {
                visit(b, e, q, &Kinematics::new(displacement_gradient(&local, gradients)));
            }
        }
    }
}

/// Moves `history` over a step of `dt_s` that ended at `u`.
pub(super) fn advance(
    problem: &Problem,
    layout: &HistoryLayout,
    u: &[[f64; 3]],
    dt_s: f64,
    history: &mut [f64],
) {
    visit_points(problem, layout, u, &mut |b, e, q, k| {
        let model = &problem.materials[problem.mesh.blocks[b].region[e]];
        let (first, len) = (layout.range(b, e).start, model.history_len());
        model.advance(k, dt_s, &mut history[first + q * len..first + (q + 1) * len]);
    });
}

/// Energy of a viscoelastic body, mJ.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnergySplit {
    /// What can be got back.
    pub stored_mj: f64,
    /// What has become heat.
    pub dissipated_mj: f64,
}

/// Stored and dissipated energy at `u`, with the history that belongs to it.
pub(super) fn energies(problem: &Problem, history: &[f64], u: &[[f64; 3]]) -> EnergySplit {
    let tension_mj = problem.tension.as_ref().map_or(0.0, |t| t.energy_mj(u));
    let mut split = EnergySplit { stored_mj: tension_mj, dissipated_mj: 0.0 };
    for (b, (block, geometry)) in problem.mesh.blocks.iter().zip(&problem.geometry).enumerate() {
        let n = block.kind.nodes();
        let mut force = vec![[0.0; 3]; n];
        for e in 0..block.len() {
            let local: Vec<_> = block.element(e).iter().map(|&a| u[a as usize]).collect();
            let model = &problem.materials[block.region[e]];
            let g = geometry.element(e);
            let len = model.history_len();
            let own = problem.history_layout.as_ref().map_or(&[][..], |m| &history[m.range(b, e)]);
            let variables = HistoryVariables { history: own, dt_s: 0.0 };
            // An equilibrium has no inverted element; NaN would show one.
            let theta = model
                .evaluate(g, &local, variables, &mut force, None)
                .map_or([f64::NAN; 4], |s| s.theta_minus_1);
            for (q, gradients) in g.gradients.chunks_exact(n).enumerate() {
                let k = Kinematics::new(displacement_gradient(&local, gradients));
                let t: f64 = g.basis[q].iter().zip(theta).map(|(b, t)| b * t).sum();
                let point = &own[q * len..(q + 1) * len];
                split.stored_mj += g.weights[q] * model.stored_mpa(&k, t, point);
                split.dissipated_mj += g.weights[q] * point.last().copied().unwrap_or(0.0);
            }
        }
    }
    split
}
