//! Hard cases of compression: bodies squeezed to 0.05 of their volume, and turned inside out.

use super::lab::{solve, tight};
use super::{Line, Suite};
use crate::verify::bodies::{internal_force, noise, uniform};
use crate::verify::{CaseError, Check};
use papilla_fem::element::ElementKind;
use papilla_fem::mesh::lattice::cube;
use papilla_fem::mesh::supports::{hold, prescribe};
use papilla_fem::solve::{Loading, Problem};

const E_MPA: f64 = 0.08;
const NU: f64 = 0.45;

pub(super) fn run(_: &Suite) -> Result<Vec<Line>, CaseError> {
    let mut lines = Vec::new();
    for kind in [ElementKind::Hex8, ElementKind::Hex27, ElementKind::Tet10, ElementKind::Quad9] {
        for j in [0.8, 0.5, 0.2, 0.05] {
            lines.push(squeezed(kind, j)?);
        }
    }
    let (problem, loading) = column(ElementKind::Hex8, -0.1)?;
    let beyond = solve(&problem, loading, tight(), 1).map(drop);
    lines.push(Line::refused(
        "Hex8, J -0.1",
        beyond,
        &["no equilibrium beyond load fraction", "cuts"],
    ));
    Ok(lines)
}

/// A cube with its inner nodes moved about, squeezed along its last axis; its sides hold.
fn column(kind: ElementKind, j: f64) -> Result<(Problem, Loading), CaseError> {
    let inner = |v: f64| v > 1e-9 && v < 1.0 - 1e-9;
    let up = kind.dimension() - 1;
    let mesh = cube(kind, 2, |p| {
        if !p[..=up].iter().all(|&v| inner(v)) {
            return p;
        }
        let seed = p.iter().fold(1u64, |s, v| s.wrapping_mul(31).wrapping_add(v.to_bits()));
        std::array::from_fn(|i| if i <= up { p[i] + 0.05 * noise(seed + i as u64) } else { p[i] })
    });
    let along = |axis: usize| std::array::from_fn(|i| i == axis);
    let names = [["x_min", "x_max"], ["y_min", "y_max"], ["z_min", "z_max"]];
    let sets: Vec<_> =
        (0..=up).flat_map(|axis| names[axis].map(|name| (name, along(axis)))).collect();
    let fixed = hold(&mesh, &sets);
    let prescribed_mm = prescribe(&mesh, &fixed, |x| {
        std::array::from_fn(|i| if i == up { (j - 1.0) * x[i] } else { 0.0 })
    });
    let problem = Problem::new(mesh, uniform(E_MPA, NU)?, fixed, None)?;
    Ok((problem, Loading { prescribed_mm, ..Loading::default() }))
}

fn squeezed(kind: ElementKind, j: f64) -> Result<Line, CaseError> {
    let (problem, loading) = column(kind, j)?;
    let up = kind.dimension() - 1;
    let (solver, report) = solve(&problem, loading, tight(), 1)?;
    let force = internal_force(&problem, solver.displacement_mm())?;
    let end = &problem.mesh.node_sets[["y_max", "z_max"][up - 1]];
    let push: f64 = end.iter().map(|&n| force[3 * n as usize + up]).sum();
    let [mu, bulk] = [E_MPA / (2.0 * (1.0 + NU)), E_MPA / (3.0 * (1.0 - 2.0 * NU))];
    // dU/dJ of U = mu/2 (J^(-2/3) (J^2 + 2) - 3) + K/2 (J - 1)^2.
    let exact = mu * j.powf(-2.0 / 3.0) * (j - (j * j + 2.0) / (3.0 * j)) + bulk * (j - 1.0);
    let checks = vec![
        Check::relative("force", push, exact, 1e-8, "closed form, confined squeeze"),
        Check::relative("smallest J", report.j_min, j, 1e-6, "homogeneous strain"),
    ];
    Ok(Line::converged(format!("{kind:?}, J {j}"), (&report).into(), checks))
}
