//! What the bodies of these tests share.

use papilla_fem::biphasic::{FluidSpec, Permeability};
use papilla_fem::element::{Elastic, ElementKind, Materials};
use papilla_fem::mesh::Mesh;
use papilla_fem::mesh::lattice::lattice;
use papilla_fem::mesh::supports::hold;
use papilla_fem::solve::{Loading, Options, Problem, Solver};
use papilla_solid::{LinearElastic, moduli};

/// Young's modulus of every body, MPa.
const YOUNG_MPA: f64 = 0.7;
/// Permeability, mm4/(N s).
pub(crate) const K: f64 = 0.3;

/// A body of small strain with its drained Poisson's ratio, drained on a surface.
pub(crate) struct Body {
    pub(crate) problem: Problem,
    pub(crate) shear_mpa: f64,
    /// Aggregate modulus `K + 4/3 mu`, MPa.
    pub(crate) aggregate_mpa: f64,
}

impl Body {
    pub(crate) fn new(mesh: Mesh, nu: f64, held: &[(&str, [bool; 3])], drained: &str) -> Self {
        let [mu_mpa, bulk_mpa] = moduli(YOUNG_MPA, nu);
        let fixed = hold(&mesh, held);
        let materials = Materials::new(vec![Elastic::shared(LinearElastic { mu_mpa }, bulk_mpa)]);
        let fluid = FluidSpec {
            permeability: vec![Some(Permeability::constant(K))],
            drained: Some(drained.into()),
        };
        let problem = Problem::new(mesh, materials, fixed, None).unwrap();
        let problem = problem.with_fluid(fluid).unwrap();
        Self { problem, shear_mpa: mu_mpa, aggregate_mpa: bulk_mpa + 4.0 / 3.0 * mu_mpa }
    }

    /// Coefficient of consolidation, mm2/s.
    pub(crate) fn c(&self) -> f64 {
        K * self.aggregate_mpa
    }

    pub(crate) fn node(&self, at: [f64; 3]) -> usize {
        let near = |p: &[f64; 3]| (0..3).all(|i| (p[i] - at[i]).abs() < 1e-9);
        self.problem.mesh.nodes.iter().position(near).unwrap()
    }

    /// Forces of a uniform pressure on a surface, N a node.
    pub(crate) fn pressed(&self, surface: &str, pressure_mpa: f64) -> Vec<[f64; 3]> {
        let mesh = &self.problem.mesh;
        let mut force = vec![[0.0; 3]; mesh.nodes.len()];
        let s = &mesh.surfaces[surface];
        s.integrate(&s.kind.quadrature(), &|n| mesh.nodes[n as usize], &mut |face, value, area| {
            for (&n, v) in face.iter().zip(value) {
                for i in 0..3 {
                    force[n as usize][i] -= pressure_mpa * v * area[i];
                }
            }
        });
        force
    }
}

/// `cells` of a rectangle `size` of Quad9.
pub(crate) fn rectangle(size: [f64; 2], cells: [usize; 2]) -> Mesh {
    let axis = |i: usize| papilla_fem::mesh::block::even(size[i], 2 * cells[i]);
    lattice(ElementKind::Quad9, [axis(0), axis(1), vec![]], |p| p)
}

/// Takes every step of `times_s` and looks at the body at each.
pub(crate) fn march(
    problem: &Problem,
    loading: Loading,
    times_s: &[f64],
    mut look: impl FnMut(usize, &Solver<'_>),
) {
    let end = *times_s.last().unwrap();
    let options =
        Options { time_error: f64::INFINITY, residual_tolerance: 1e-9, ..Options::default() };
    let mut solver = Solver::new(problem, options).unwrap();
    solver.start(Loading { duration_s: end, ..loading });
    for (i, t) in times_s.iter().enumerate() {
        let report = solver.advance_to(t / end).unwrap();
        assert_eq!(report.effort.steps, 1, "one step each");
        look(i, &solver);
    }
}

/// All of a load at the first of these times, and from then on.
pub(crate) fn sudden(times_s: &[f64]) -> Vec<(f64, f64)> {
    vec![(times_s[0] / times_s.last().unwrap(), 1.0), (1.0, 1.0)]
}

/// Times through all of `stops`, so many steps to each: as the square of their number to the first,
/// even between the others.
pub(crate) fn times(stops: &[f64], steps: &[usize]) -> Vec<f64> {
    let mut out = Vec::new();
    let mut from = 0.0;
    for (&to, &steps) in stops.iter().zip(steps) {
        for i in 1..=steps {
            let part = i as f64 / steps as f64;
            let part = if from == 0.0 { part * part } else { part };
            out.push(from + part * (to - from));
        }
        from = to;
    }
    out
}

/// Place of a time among times, which has it.
pub(crate) fn place(times: &[f64], t: f64) -> usize {
    times.iter().position(|v| (v / t - 1.0).abs() < 1e-9).unwrap()
}
