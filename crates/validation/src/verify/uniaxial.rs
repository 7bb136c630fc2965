//! One element in uniaxial tension and compression.

use super::bodies::{internal_force, solve, tight, uniform};
use super::{CaseError, Check, Context};
use papilla_fem::element::{ConstitutiveModel, ElementKind};
use papilla_fem::mesh::lattice::{REGION, cube};
use papilla_fem::mesh::supports::{hold, prescribe};
use papilla_fem::solve::{Loading, Problem};

const SOURCE: &str = "closed form, lateral stretch by Newton";

pub(super) fn run(_: &Context) -> Result<Vec<Check>, CaseError> {
    let mut rows = Vec::new();
    for (kind, name) in [(ElementKind::Hex8, "Hex8"), (ElementKind::Hex27, "Hex27")] {
        for stretch in [0.5, 0.8, 1.25, 2.0] {
            let mesh = cube(kind, 1, |p| p);
            let fixed = hold(
                &mesh,
                &[
                    ("x_min", [true, false, false]),
                    ("x_max", [true, false, false]),
                    ("y_min", [false, true, false]),
                    ("z_min", [false, false, true]),
                ],
            );
            let prescribed_mm = prescribe(&mesh, &fixed, |x| [(stretch - 1.0) * x[0], 0.0, 0.0]);
            let problem = Problem::new(mesh, uniform(0.08, 0.45)?, fixed, None)?;
            let loading = Loading { prescribed_mm, ..Loading::default() };
            let (solver, _) = solve(&problem, loading, tight(), 4)?;
            let u = solver.displacement_mm();
            let force = internal_force(&problem, u)?;
            let end = &problem.mesh.node_sets["x_max"];
            let pull: f64 = end.iter().map(|&n| force[3 * n as usize]).sum();
            let (lateral, stress) = closed_form(&problem.materials[REGION], stretch);
            let corner = problem.mesh.node_sets["y_max"][0] as usize;
            let quantity = |what| format!("{name}, stretch {stretch}: {what}");
            rows.push(Check::relative(quantity("force, N"), pull, stress, 1e-9, SOURCE));
            let found = 1.0 + u[corner][1];
            rows.push(Check::relative(quantity("lateral stretch"), found, lateral, 1e-9, SOURCE));
        }
    }
    Ok(rows)
}

/// Lateral stretch and nominal stress (MPa) of
/// `U = mu/2 (I1bar - 3) + K/2 (J - 1)^2` with free sides.
fn closed_form(material: &dyn ConstitutiveModel, a: f64) -> (f64, f64) {
    let (mu, bulk) = (material.shear_modulus_mpa(), material.bulk_modulus_mpa());
    // Lateral Cauchy stress s(l) = mu J^(-5/3) (l^2 - a^2)/3 + K (J - 1), J = a l^2.
    let mut l = a.powf(-0.5);
    for _ in 0..50 {
        let (j, dj) = (a * l * l, 2.0 * a * l);
        let (power, d) = (mu * j.powf(-5.0 / 3.0), (l * l - a * a) / 3.0);
        let s = power * d + bulk * (j - 1.0);
        let ds = power * (2.0 * l / 3.0 - 5.0 / 3.0 * d * dj / j) + bulk * dj;
        l -= s / ds;
    }
    let j = a * l * l;
    let i1 = a * a + 2.0 * l * l;
    let nominal = mu * j.powf(-2.0 / 3.0) * (a - i1 / (3.0 * a)) + bulk * (j - 1.0) * j / a;
    (l, nominal)
}
