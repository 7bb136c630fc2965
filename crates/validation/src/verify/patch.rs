//! Patch test: constant strain on a distorted mesh.

use super::bodies::{largest, noise, points, solve, tight, uniform};
use super::{CaseError, Check, Context};
use papilla_fem::element::{ElementKind, HistoryVariables};
use papilla_fem::mesh::lattice::{REGION, cube, intervals};
use papilla_fem::mesh::supports::{hold_boundary, prescribe};
use papilla_fem::solve::{Loading, Problem};
use papilla_solid::tensor::{Kinematics, Mat3};

const SOURCE: &str = "exact (Irons & Razzaque 1972)";

/// A displacement gradient without symmetry, in the plane for planar elements;
/// `times` scales it.
fn gradient(kind: ElementKind, times: f64) -> Mat3 {
    let h = [[0.9, 0.5, -0.3], [0.2, -0.6, 0.4], [-0.5, 0.3, 0.7]];
    let d = kind.dimension();
    std::array::from_fn(|i| {
        std::array::from_fn(|j| if i < d && j < d { times * h[i][j] } else { 0.0 })
    })
}

pub(super) fn run(_: &Context) -> Result<Vec<Check>, CaseError> {
    let mut rows = Vec::new();
    let kinds = [
        (ElementKind::Hex8, "Hex8", 3),
        (ElementKind::Hex20, "Hex20", 2),
        (ElementKind::Hex27, "Hex27", 2),
        (ElementKind::Tet10, "Tet10", 2),
        (ElementKind::Tet4, "Tet4", 3),
        (ElementKind::Quad4, "Quad4", 3),
        (ElementKind::Quad8, "Quad8", 2),
        (ElementKind::Quad9, "Quad9", 2),
    ];
    for (kind, name, cells) in kinds {
        for (size, strain) in [("small", 1e-3), ("finite", 0.25)] {
            let [u, stress] = errors(kind, cells, gradient(kind, strain))?;
            let row = |what, value| {
                let quantity = format!("{name}, {size} strain: relative error of {what}");
                Check::vanishes(quantity, value, 1e-10, SOURCE)
            };
            rows.extend([row("displacement", u), row("stress", stress)]);
        }
    }
    Ok(rows)
}

/// Largest relative errors of displacement and stress for `u = H X` on the boundary.
fn errors(kind: ElementKind, cells: usize, h: Mat3) -> Result<[f64; 2], CaseError> {
    // Interior nodes move by up to a seventh of a cell (of a half cell: quadratic
    // elements, whose edges and faces then curve).
    let steps = (intervals(kind) * cells) as f64;
    let d = kind.dimension();
    let mesh = cube(kind, cells, |p| {
        if p[..d].iter().any(|v| *v < 1e-12 || *v > 1.0 - 1e-12) {
            return p;
        }
        let key = p.iter().fold(7u64, |k, v| 31 * k + (v * steps).round() as u64);
        let shift = |i: usize| noise(3 * key + i as u64) / (7.0 * steps);
        std::array::from_fn(|i| if i < d { p[i] + shift(i) } else { p[i] })
    });
    let field =
        |x: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| (0..3).map(|j| h[i][j] * x[j]).sum()) };
    let fixed = hold_boundary(&mesh);
    let prescribed_mm = prescribe(&mesh, &fixed, field);
    let problem = Problem::new(mesh, uniform(0.08, 0.48)?, fixed, None)?;
    let loading = Loading { prescribed_mm, ..Loading::default() };
    let (solver, _) = solve(&problem, loading, tight(), 4)?;
    let u = solver.displacement_mm();
    let exact: Vec<_> = problem.mesh.nodes.iter().map(|&x| field(x)).collect();
    let scale = largest(exact.as_flattened());
    let difference: Vec<f64> =
        u.as_flattened().iter().zip(exact.as_flattened()).map(|(a, b)| a - b).collect();
    let k = Kinematics::new(h);
    let stress =
        problem.materials[REGION].first_piola_mpa(&k, k.j_minus_1, HistoryVariables::default());
    let stress_scale = largest(stress.as_flattened());
    let mut worst = 0.0f64;
    points(&problem, u, &mut |p| {
        for (a, b) in p.stress.as_flattened().iter().zip(stress.as_flattened()) {
            worst = worst.max((a - b).abs());
        }
    })?;
    Ok([largest(&difference) / scale, worst / stress_scale])
}
