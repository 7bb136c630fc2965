//! What it takes to evaluate a body's elements, probed on some of them.

use super::machine::fastest_s;
use crate::tissue::Tissue;
use papilla_fem::element::HistoryVariables;
use papilla_fem::mesh::Block;
use papilla_fem::solve::Problem;
use std::hint::black_box;

/// Time to evaluate every element once, s.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pass {
    /// Forces alone.
    pub forces_s: f64,
    /// Forces and tangent, added up in the system.
    pub tangent_s: f64,
}

/// Elements of a tissue that are probed.
const SAMPLE: usize = 16;
/// Runs of each element. An element takes microseconds, less than a busy machine
/// leaves a process alone, so that the fastest run is one without interruption.
const RUNS: usize = 7;

impl Pass {
    /// Evaluates some elements of each tissue in a small deformation with three
    /// different principal stretches.
    pub(super) fn probe(problem: &Problem) -> Self {
        let mut pass = Self::default();
        let mut tangent = problem.system.zeros();
        for (b, block) in problem.mesh.blocks.iter().enumerate() {
            let size = 3 * block.kind.nodes();
            let mut dense = vec![0.0; size * size];
            for tissue in Tissue::ALL {
                let of: Vec<usize> =
                    (0..block.len()).filter(|&e| block.region[e] == tissue.region()).collect();
                let sample = of.iter().copied().step_by(of.len().div_ceil(SAMPLE).max(1));
                let share = of.len() as f64 / sample.len().max(1) as f64;
                for e in sample {
                    let forces = fastest_s(RUNS, || evaluate(problem, b, block, e, None));
                    let both = fastest_s(RUNS, || {
                        dense.fill(0.0);
                        evaluate(problem, b, block, e, Some(dense.as_mut_slice()));
                        problem.system.add_element(&mut tangent, b, e, &mut dense);
                    });
                    pass.forces_s += share * forces;
                    pass.tangent_s += share * both;
                }
            }
        }
        pass
    }
}

fn evaluate(problem: &Problem, b: usize, block: &Block, e: usize, tangent: Option<&mut [f64]>) {
    let mut u = [[0.0; 3]; 27];
    let mut force = [[0.0; 3]; 27];
    let nodes = block.element(e);
    for (u, &node) in u.iter_mut().zip(nodes) {
        let x = problem.mesh.nodes[node as usize];
        *u = [1e-3 * x[0] + 2e-4 * x[1], -2e-3 * x[1], 3e-3 * x[2]];
        if block.kind.is_planar() {
            u[2] = 0.0;
        }
    }
    let solid = &problem.materials[block.region[e]];
    let history = vec![0.0; problem.geometry[b].points * solid.history_len()];
    let memory = HistoryVariables { history: &history, dt_s: 0.1 };
    let (u, force) = (&u[..nodes.len()], &mut force[..nodes.len()]);
    // The deformation is far from turning an element inside out.
    let _ = black_box(solid.evaluate(problem.geometry[b].element(e), u, memory, force, tangent));
    black_box(force);
}
