//! Snap-through of a shallow arch.

use super::lab::{solve, tight};
use super::{Line, Suite};
use crate::verify::bodies::{internal_force, uniform};
use crate::verify::{CaseError, Check};
use papilla_fem::element::ElementKind;
use papilla_fem::mesh::block::even;
use papilla_fem::mesh::lattice::lattice;
use papilla_fem::mesh::supports::hold;
use papilla_fem::solve::{Loading, Problem, SolveError, Solver, StepReport};

/// Half span, rise and thickness, mm.
const HALF_MM: f64 = 10.0;
const RISE_MM: f64 = 1.0;
const THICK_MM: f64 = 0.3;
/// How far the crown is led down, mm.
const END_MM: f64 = 2.6;

/// Half of an arch in plane strain, clamped at one end, on its symmetry axis at the other,
/// and the degree of freedom of the crown's top; `led` if its path is prescribed.
fn arch(led: bool) -> Result<(Problem, usize), CaseError> {
    let axes = [even(1.0, 40), even(1.0, 4), vec![0.0]];
    let mesh = lattice(ElementKind::Quad9, axes, |[s, t, _]| {
        // Flat at both ends: a clamped arch.
        let rise = RISE_MM * 0.5 * (1.0 - (std::f64::consts::PI * s).cos());
        [HALF_MM * s, rise + THICK_MM * (t - 0.5), 0.0]
    });
    let mut fixed = hold(&mesh, &[("x_min", [true, true, false]), ("x_max", [true, false, false])]);
    let top = mesh.node_sets["x_max"].iter().copied();
    let height = |n: &u32| mesh.nodes[*n as usize][1];
    let crown = top.max_by(|a, b| height(a).total_cmp(&height(b))).ok_or("no crown")?;
    let dof = 3 * crown as usize + 1;
    fixed[dof] |= led;
    Ok((Problem::new(mesh, uniform(1.0, 0.45)?, fixed, None)?, dof))
}

/// Force that holds the crown down by `depth_mm`, N per mm.
fn reaction(problem: &Problem, solver: &Solver<'_>, dof: usize) -> Result<f64, CaseError> {
    Ok(-internal_force(problem, solver.displacement_mm())?[dof])
}

/// The controlled path: depths and forces.
fn path() -> Result<(Vec<(f64, f64)>, StepReport), CaseError> {
    const STEPS: u32 = 52;
    let (problem, dof) = arch(true)?;
    let mut solver = Solver::new(&problem, tight())?;
    solver.start(Loading { prescribed_mm: vec![(dof, -END_MM)], ..Loading::default() });
    let mut points = Vec::new();
    let mut last = StepReport::default();
    for s in 1..=STEPS {
        let part = f64::from(s) / f64::from(STEPS);
        last = solver.advance_to(part)?;
        points.push((part * END_MM, reaction(&problem, &solver, dof)?));
    }
    Ok((points, last))
}

/// The arch under a dead force in a single increment.
fn loaded(force_n: f64) -> Result<Result<(f64, StepReport), SolveError>, CaseError> {
    let (problem, dof) = arch(false)?;
    let mut dead_n = vec![[0.0; 3]; problem.mesh.nodes.len()];
    dead_n[dof / 3][1] = -force_n;
    let found = solve(&problem, Loading { dead_n, ..Loading::default() }, tight(), 1);
    Ok(found.map(|(solver, report)| (-solver.displacement_mm()[dof / 3][1], report)))
}

/// Force of the controlled path at `depth_mm`, found from rest in ten increments.
fn controlled_n(depth_mm: f64) -> Result<f64, CaseError> {
    let (problem, dof) = arch(true)?;
    let loading = Loading { prescribed_mm: vec![(dof, -depth_mm)], ..Loading::default() };
    let (solver, _) = solve(&problem, loading, tight(), 10)?;
    reaction(&problem, &solver, dof)
}

pub(super) fn run(_: &Suite) -> Result<Vec<Line>, CaseError> {
    let (points, report) = path()?;
    let peak = points.windows(2).position(|w| w[1].1 < w[0].1).ok_or("the arch does not snap")?;
    let (limit_mm, limit_n) = points[peak];
    let valley = points[peak..].iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
    let end = points.last().map_or(0.0, |p| p.1);
    let snaps = vec![
        Check::within("valley / limit load", valley / limit_n, [-5.0, 0.9], "it snaps"),
        Check::within(
            "load at the end / limit load",
            end / limit_n,
            [1.0, 1e3],
            "it stiffens again",
        ),
        Check::within(
            "depth at the limit / rise",
            limit_mm / RISE_MM,
            [0.2, 1.0],
            "a shallow arch",
        ),
    ];
    let mut lines = vec![Line::converged("crown led down", (&report).into(), snaps)];
    for part in [0.5, 0.9] {
        let (depth, report) = loaded(part * limit_n)??;
        let checks = vec![
            Check::within(
                "depth / that at the limit",
                depth / limit_mm,
                [0.0, 1.0],
                "the near branch",
            ),
            Check::relative(
                "controlled force there",
                controlled_n(depth)?,
                part * limit_n,
                1e-5,
                "the load",
            ),
        ];
        lines.push(Line::converged(format!("{part} of the limit load"), (&report).into(), checks));
    }
    for part in [1.1, 1.5] {
        let variant = format!("{part} of the limit load");
        lines.push(match loaded(part * limit_n)? {
            Ok((depth, report)) => {
                let checks = vec![
                    Check::within(
                        "depth / that at the limit",
                        depth / limit_mm,
                        [1.5, 10.0],
                        "the far branch",
                    ),
                    Check::relative(
                        "controlled force there",
                        controlled_n(depth)?,
                        part * limit_n,
                        1e-5,
                        "the load",
                    ),
                ];
                Line::converged(variant, (&report).into(), checks)
            }
            Err(error @ SolveError::CutsExhausted { reached, .. })
                if (part * reached - 1.0).abs() < 0.05 =>
            {
                Line::refused(
                    variant,
                    Err::<(), _>(error),
                    &["no equilibrium beyond load fraction"],
                )
            }
            Err(error) => Line::broken(variant, format!("not at the limit load: {error}")),
        });
    }
    Ok(lines)
}
