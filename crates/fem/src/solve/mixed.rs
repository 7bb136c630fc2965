//! Dilatations that elements keep as unknowns of their own between Newton iterations, for a whole
//! body.
//!
//! Taken as a penalty, the bulk modulus multiplies what a Newton step misses of the volume in
//! second order: energy and residual jump, and the line search crawls. With the dilatations of
//! [`independent`](crate::element::independent) as unknowns of their own both fields go their linear way,
//! and the line search asks for the residual of both to fall, in which the second order
//! of the volume is weighed with the shear modulus. A Newton step reduces any such norm at
//! first. Equilibria are those of the condensed element, whose residual still says when
//! to stop.

use super::problem::Problem;
use crate::element::{Dilatation, ElementKind, next_dilatation};
use crate::linear::DofMap;

/// Ratio of bulk to shear modulus beyond which dilatations are unknowns of their own: nu = .495.
/// Below, the potential alone leads to the same equilibria, at .48 in as many iterations.
const STIFF_RATIO: f64 = 100.0;

/// The same for quadratic elements, whose dilatation varies within: nu = .45. Under an edge the
/// potential alone led them through indefinite tangents at .48, and took twice the time.
const STIFF_RATIO_QUADRATIC: f64 = 10.0;

/// Conjugate gradients on an old factor are given up after so many iterations: the stiff
/// directions turn with the deformation, and a factor that does not know them is soon worth less
/// than a new one.
pub(super) const OLD_FACTOR_CG_MAX: u32 = 30;

/// Least relative residual that is asked of conjugate gradients.
const LINEAR_MIN: f64 = 1e-10;

/// The dilatations that a body keeps, at rest; none unless some of it is of finite strain
/// and so nearly incompressible that it pays; none with fluid, whose pressure is an unknown too.
pub(super) fn at_rest(problem: &Problem) -> Vec<Dilatation> {
    if problem.fluid.is_some() {
        return Vec::new();
    }
    let blocks = &problem.mesh.blocks;
    let ratio =
        |kind: ElementKind| if kind.order() == 2 { STIFF_RATIO_QUADRATIC } else { STIFF_RATIO };
    let pays = blocks.iter().any(|b| {
        b.region.iter().any(|&region| {
            let model = &problem.materials[region];
            model.is_finite_strain()
                && model.bulk_modulus_mpa() > ratio(b.kind) * model.shear_modulus_mpa()
        })
    });
    if pays { vec![[0.0; 4]; blocks.iter().map(|b| b.len()).sum()] } else { Vec::new() }
}

/// What a body's independent dilatations differ by from those of the displacement.
pub(super) struct Lag {
    /// Force of the difference at every degree of freedom, N; empty if there is no independent one.
    force_n: Vec<f64>,
    /// Square of the difference's part in the norm, N2.
    gap_n2: f64,
}

impl Lag {
    pub(super) fn new(problem: &Problem, independent: &[Dilatation]) -> Self {
        let dofs = if independent.is_empty() { 0 } else { 3 * problem.mesh.nodes.len() };
        Self { force_n: vec![0.0; dofs], gap_n2: 0.0 }
    }

    /// Adds an element: `mu (t - t(u))` as a stress on an area of its size, squared.
    pub(super) fn add(
        &mut self,
        nodes: &[u32],
        lag_n: &[[f64; 3]],
        mu_mpa: f64,
        weights: &[f64],
        gap_squared_mm3: f64,
    ) {
        let size_mm = weights.iter().sum::<f64>().cbrt();
        self.gap_n2 += mu_mpa * mu_mpa * size_mm * gap_squared_mm3;
        for (&node, f) in nodes.iter().zip(lag_n) {
            for i in 0..3 {
                self.force_n[3 * node as usize + i] += f[i];
            }
        }
    }

    /// Moves what acts on nodes that hang to those that they follow.
    pub(super) fn condense(&mut self, problem: &Problem) {
        if !self.force_n.is_empty() {
            problem.mesh.condense(&mut self.force_n);
        }
    }

    /// Norm of the residual of both fields, N, from the one of the displacement.
    pub(super) fn norm_n(&self, problem: &Problem, residual_n: &[f64]) -> f64 {
        let mut square = self.gap_n2;
        let dofs = &problem.system.dofs.of_dof;
        for ((r, l), &e) in residual_n.iter().zip(&self.force_n).zip(dofs) {
            if e != DofMap::FIXED {
                square += (r + l) * (r + l);
            }
        }
        square.sqrt()
    }
}

/// Dilatation of every element after the full `step` (mm, one an unknown) from `u`.
pub(super) fn next_dilatations(
    problem: &Problem,
    u: &[[f64; 3]],
    step: &[f64],
    out: &mut Vec<Dilatation>,
) {
    let of_dof = &problem.system.dofs.of_dof;
    let moved = |node: u32| -> [f64; 3] {
        std::array::from_fn(|i| match of_dof[3 * node as usize + i] {
            DofMap::FIXED => 0.0,
            e => step[e as usize],
        })
    };
    let (mut local, mut change) = ([[0.0; 3]; 27], [[0.0; 3]; 27]);
    for (block, geometry) in problem.mesh.blocks.iter().zip(&problem.geometry) {
        let n = block.kind.nodes();
        for e in 0..block.len() {
            for (a, &node) in block.element(e).iter().enumerate() {
                local[a] = u[node as usize];
                change[a] = match problem.mesh.hanging_node(node) {
                    Some(h) => h.of(moved),
                    None => moved(node),
                };
            }
            let material = &problem.materials[block.region[e]];
            let g = geometry.element(e);
            let finite = material.is_finite_strain();
            out.push(next_dilatation(g, finite, &local[..n], &change[..n]));
        }
    }
}

/// Dilatation that every element has at `u`.
pub(super) fn dilatations(problem: &Problem, u: &[[f64; 3]], out: &mut Vec<Dilatation>) {
    next_dilatations(problem, u, &vec![0.0; problem.system.dofs.count], out);
}

/// How exactly to solve the linear system where `forcing` is what the residual alone asks for:
/// most of that residual may be volume, which the step takes away to first order. What it leaves
/// has to be small against the residual of both fields, `share` of the other, but not
/// smaller than what is asked in the end, `target` of it.
pub(super) fn forcing(forcing: f64, share: f64, target: f64) -> f64 {
    (forcing * share.min(1.0)).max(0.3 * target).clamp(LINEAR_MIN, 0.3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::ElementKind;
    use crate::solve::{Loading, Options, Solver};
    use crate::testing::squeezed_block;

    fn tight() -> Options {
        Options { residual_tolerance: 1e-9, gap_tolerance_mm: 1e-7, ..Options::default() }
    }

    #[test]
    fn equilibria_are_those_of_the_condensed_element() {
        for kind in [ElementKind::Hex8, ElementKind::Quad9] {
            let (problem, loading, _) = squeezed_block(kind, 3, 0.48).unwrap();
            let mut found = Vec::new();
            for keeps in [false, true] {
                let mut solver = Solver::new(&problem, tight()).unwrap();
                solver.start(loading.clone());
                let elements: usize = problem.mesh.blocks.iter().map(|b| b.len()).sum();
                solver.state.independent.clear();
                if keeps {
                    solver.state.independent = vec![[0.0; 4]; elements];
                }
                solver.advance_to(0.4).unwrap();
                solver.advance_to(1.0).unwrap();
                if keeps {
                    // The independent one is the body's own dilatation by then.
                    let own = independent_gap(&problem, &solver);
                    assert!(own < 1e-6, "{own}");
                }
                found.push(solver.displacement_mm().to_vec());
            }
            let difference =
                |i: usize| (found[0].as_flattened()[i] - found[1].as_flattened()[i]).abs();
            let worst = (0..3 * found[0].len()).map(difference).fold(0.0, f64::max);
            assert!(worst < 1e-6, "{kind:?}: {worst} mm of 0.75");
        }
    }

    /// Largest difference between independent and own dilatations over the largest dilatation.
    fn independent_gap(problem: &Problem, solver: &Solver<'_>) -> f64 {
        let u = solver.displacement_mm();
        let mut own = Vec::new();
        dilatations(problem, u, &mut own);
        let largest = |values: &[f64]| values.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let independent = solver.state.independent.as_flattened();
        let gap: Vec<f64> =
            independent.iter().zip(own.as_flattened()).map(|(a, b)| a - b).collect();
        largest(&gap) / largest(own.as_flattened())
    }

    #[test]
    fn rubbing_bodies_end_where_the_potential_leads() {
        for friction in [0.5, 10.0] {
            let (problem, loading, up) = squeezed_block(ElementKind::Hex8, 3, 0.48).unwrap();
            let loading = Loading { friction, ..loading };
            let force = [false, true].map(|keeps| {
                let mut solver = Solver::new(&problem, Options::default()).unwrap();
                solver.start(loading.clone());
                if keeps {
                    solver.state.independent = vec![[0.0; 4]; problem.mesh.blocks[0].len()];
                }
                for step in 1..=4 {
                    solver.advance_to(0.25 * f64::from(step)).unwrap();
                }
                solver.balance().contact_force_n[up]
            });
            let difference = (force[1] - force[0]).abs() / force[0].abs();
            assert!(difference < 1e-3, "friction {friction}: {force:?}");
        }
    }

    #[test]
    fn nearly_incompressible_bodies_take_few_iterations() {
        for nu in [0.4999, 0.49999, 0.499_999] {
            let (problem, loading, _) = squeezed_block(ElementKind::Quad4, 8, nu).unwrap();
            let mut solver = Solver::new(&problem, Options::default()).unwrap();
            solver.start(loading);
            assert!(!solver.state.independent.is_empty());
            let effort = solver.advance_to(1.0).unwrap().effort;
            assert!(effort.cuts == 0 && effort.newton_iterations <= 20, "nu {nu}: {effort:?}");
        }
    }
}
