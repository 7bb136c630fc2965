//! A rigid sphere pressed lightly on a half-space (Hertz).

use super::bodies::{quarter_space, solve, uniform};
use super::{CaseError, Check, Context};
use papilla_fem::element::ElementKind;
use papilla_fem::solve::{Loading, MovingIndenter, Options, Problem};
use papilla_sdf::{Placement, Sphere};
use papilla_vector::norm;
use std::sync::Arc;

const SOURCE: &str = "Hertz (Johnson 1985, sec. 4.2)";
const E_MPA: f64 = 1.0;
const SPHERE_MM: f64 = 10.0;
/// Contact radius that the depth is chosen for, mm: 4 % of the sphere's.
const RADIUS_MM: f64 = 0.4;

pub(super) fn run(context: &Context) -> Result<Vec<Check>, CaseError> {
    let mut rows = Vec::new();
    let per_radius = if context.quick { 6.0 } else { 9.0 };
    for (kind, name) in [(ElementKind::Hex8, "Hex8"), (ElementKind::Hex27, "Hex27")] {
        let nu = 0.3;
        let depth = RADIUS_MM * RADIUS_MM / SPHERE_MM;
        let [force, radius, peak] = press(kind, RADIUS_MM / per_radius, nu, depth)?;
        let modulus = E_MPA / (1.0 - nu * nu);
        let exact = 4.0 / 3.0 * modulus * SPHERE_MM.sqrt() * depth.powf(1.5);
        let exact_peak = 1.5 * exact / (std::f64::consts::PI * RADIUS_MM * RADIUS_MM);
        rows.push(Check::relative(format!("{name}: force, N"), force, exact, 0.02, SOURCE));
        let quantity = format!("{name}: contact radius (second moment of pressure), mm");
        rows.push(Check::relative(quantity, radius, RADIUS_MM, 0.02, SOURCE));
        let quantity = format!("{name}: pressure at the centre, MPa");
        rows.push(Check::relative(quantity, peak, exact_peak, 0.03, SOURCE));
    }
    Ok(rows)
}

/// Force (N), contact radius (mm), pressure at the centre (MPa).
fn press(kind: ElementKind, h: f64, nu: f64, depth: f64) -> Result<[f64; 3], CaseError> {
    let far = 250.0 * RADIUS_MM;
    let (mesh, fixed) = quarter_space(kind, h, 4.0 / 3.0 * RADIUS_MM, far, RADIUS_MM);
    let problem = Problem::new(mesh, uniform(E_MPA, nu)?, fixed, Some("touch"))?;
    let rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let start = Placement { rotation, origin_mm: [0.0, 0.0, SPHERE_MM] };
    let sphere = Arc::new(Sphere { radius_mm: SPHERE_MM });
    let indenter = MovingIndenter::straight(sphere, start, [0.0, 0.0, -depth]);
    let loading = Loading { indenter: Some(indenter), ..Loading::default() };
    let options =
        Options { residual_tolerance: 1e-6, gap_tolerance_mm: 1e-4 * depth, ..Options::default() };
    let (solver, _) = solve(&problem, loading, options, 2)?;
    let force = 4.0 * norm(problem_force(&solver));
    // For Hertz' pressure the mean of r^2 over the load is 2/5 a^2.
    let surface = &problem.mesh.surfaces["touch"];
    let pressure = solver.pressure_mpa(surface);
    let x = solver.deformed();
    let (mut load, mut moment) = (0.0, 0.0);
    surface.integrate(&surface.kind.quadrature(), &|n| x[n as usize], &mut |face, value, area| {
        let mut at = [0.0; 4];
        for (&n, v) in face.iter().zip(value) {
            let p = x[n as usize];
            for (a, b) in at.iter_mut().zip([p[0], p[1], p[2], pressure[n as usize]]) {
                *a += v * b;
            }
        }
        load += at[3] * area[2];
        moment += at[3] * area[2] * (at[0] * at[0] + at[1] * at[1]);
    });
    let peak = pressure.iter().copied().fold(0.0, f64::max);
    Ok([force, (2.5 * moment / load).sqrt(), peak])
}

/// Normal force of the sphere; tangential parts belong to the symmetry planes.
fn problem_force(solver: &papilla_fem::solve::Solver<'_>) -> [f64; 3] {
    let [_, _, z] = solver.balance().contact_force_n;
    [0.0, 0.0, z]
}
