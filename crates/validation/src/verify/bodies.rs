//! Meshes, materials, loads and fields that the cases share.

use super::CaseError;
use papilla_fem::element::geometry::displacement_gradient;
use papilla_fem::element::{ConstitutiveModel, Elastic, ElementKind, HistoryVariables, Inverted};
use papilla_fem::mesh::Mesh;
use papilla_fem::mesh::lattice::{graded, lattice, part};
use papilla_fem::mesh::supports::{hold, merge};
use papilla_fem::solve::evaluate::{Evaluation, Trial, evaluate_body};
use papilla_fem::solve::{Loading, Materials, Options, Problem, Solver, StepError, StepReport};
use papilla_fingertip::materials::{ElasticConstants, MaterialError};
use papilla_fingertip::tissue::Tissue;
use papilla_solid::NeoHookean;
use papilla_solid::tensor::{Kinematics, Mat3};
use std::sync::Arc;

/// The same constitutive model for every tissue.
pub(crate) fn everywhere(solid: Arc<dyn ConstitutiveModel>) -> Materials {
    Materials::new(vec![solid; Tissue::ALL.len()]).with_stiff(&Tissue::STIFF)
}

/// The same material for every tissue.
pub(crate) fn uniform(e_mpa: f64, nu: f64) -> Result<Materials, MaterialError> {
    let constants = ElasticConstants { youngs_modulus_mpa: e_mpa, poissons_ratio: nu };
    let [mu_mpa, bulk_mpa] = constants.moduli_mpa()?;
    let solid = Elastic::shared(NeoHookean { mu_mpa }, bulk_mpa);
    Ok(everywhere(solid))
}

/// Options that drive the residual to rounding.
pub(crate) fn tight() -> Options {
    Options { residual_tolerance: 1e-12, ..Options::default() }
}

/// A repeatable number in `[-1, 1]` (splitmix64).
pub(crate) fn noise(seed: u64) -> f64 {
    let mut z = seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (z >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// A quarter of a half-space `z <= 0`, symmetric about `x = 0` and `y = 0`,
/// refined at the origin, far sides `end` away, the bottom held.
pub(crate) fn quarter_space(
    kind: ElementKind,
    h: f64,
    fine: f64,
    end: f64,
    deep: f64,
) -> (Mesh, Vec<bool>) {
    let side = graded(h, fine, 1.5, end);
    let depth = graded(h, deep, 1.5, end);
    let down = depth.iter().rev().map(|z| -z).collect();
    let mut mesh = lattice(kind, [side.clone(), side, down], |p| p);
    // Only where contact or load can be: far faces would distort mean areas.
    let limit = 1.001 * fine;
    let touch = part(&mesh.surfaces["z_max"], |n| {
        let p = mesh.nodes[n as usize];
        p[0] <= limit && p[1] <= limit
    });
    mesh.surfaces.insert("touch".into(), touch);
    let fixed = hold(&mesh, &[("x_min", [true, false, false]), ("y_min", [false, true, false])]);
    let fixed = merge(fixed, &hold(&mesh, &[("z_min", [true; 3])]));
    (mesh, fixed)
}

/// Solves `loading` in `steps` equal steps and hands over the solver.
pub(crate) fn solve<'a>(
    problem: &'a Problem,
    loading: Loading,
    options: Options,
    steps: u32,
) -> Result<(Solver<'a>, StepReport), CaseError> {
    let mut solver = Solver::new(problem, options)?;
    solver.start(loading);
    let mut report = StepReport::default();
    for s in 1..=steps {
        report = solver.advance_to(f64::from(s) / f64::from(steps))?;
    }
    Ok((solver, report))
}

/// Internal forces, N, one a degree of freedom.
pub fn internal_force(problem: &Problem, u: &[[f64; 3]]) -> Result<Vec<f64>, StepError> {
    let trial = Trial {
        u,
        independent: &[],
        multipliers_mpa: &[],
        penalty: 1.0,
        load_fraction: 0.0,
        variables: HistoryVariables::default(),
        friction: None,
        fluid: None,
    };
    let mut out = Evaluation::default();
    evaluate_body(problem, &Loading::default(), &trial, None, &mut out)?;
    Ok(out.residual_n)
}

/// Deformation and stress at one quadrature point.
pub(crate) struct Point {
    /// First Piola-Kirchhoff stress, MPa.
    pub stress: Mat3,
}

/// Visits every quadrature point of the body.
pub(crate) fn points(
    problem: &Problem,
    u: &[[f64; 3]],
    visit: &mut dyn FnMut(Point),
) -> Result<(), Inverted> {
    for (block, geometry) in problem.mesh.blocks.iter().zip(&problem.geometry) {
        let n = block.kind.nodes();
        let mut force = vec![[0.0; 3]; n];
        for e in 0..block.len() {
            let g = geometry.element(e);
            let material = &problem.materials[block.region[e]];
            let local: Vec<_> = block.element(e).iter().map(|&a| u[a as usize]).collect();
            let state =
                material.evaluate(g, &local, HistoryVariables::default(), &mut force, None)?;
            for (gradients, basis) in g.gradients.chunks_exact(n).zip(g.basis) {
                let theta: f64 = basis.iter().zip(state.theta_minus_1).map(|(b, t)| b * t).sum();
                let k = Kinematics::new(displacement_gradient(&local, gradients));
                visit(Point {
                    stress: material.first_piola_mpa(&k, theta, HistoryVariables::default()),
                });
            }
        }
    }
    Ok(())
}

/// Largest entry by magnitude.
pub(crate) fn largest<'a>(values: impl IntoIterator<Item = &'a f64>) -> f64 {
    values.into_iter().fold(0.0, |m, v| if v.is_nan() { f64::NAN } else { m.max(v.abs()) })
}
