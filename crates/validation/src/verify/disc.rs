//! Uniform pressure on a disc of a half-space (Boussinesq, Love).

use super::bodies::{quarter_space, solve, uniform};
use super::{CaseError, Check, Context};
use papilla_fem::element::ElementKind;
use papilla_fem::mesh::Mesh;
use papilla_fem::solve::{Loading, Options, Problem};

const SOURCE: &str = "Boussinesq: 2 (1 - nu^2) p a / E (Johnson 1985, eq. 3.29a)";
const E_MPA: f64 = 1.0;
const RADIUS_MM: f64 = 1.0;
const PRESSURE_MPA: f64 = 1e-4;

pub(super) fn run(context: &Context) -> Result<Vec<Check>, CaseError> {
    let mut rows = Vec::new();
    for (kind, name, h) in [(ElementKind::Hex8, "Hex8", 0.2), (ElementKind::Hex27, "Hex27", 0.25)] {
        for &nu in if context.quick { &[0.48][..] } else { &[0.3, 0.48] } {
            let found = centre_sink_mm(kind, h * RADIUS_MM, nu)?;
            let exact = 2.0 * (1.0 - nu * nu) * PRESSURE_MPA * RADIUS_MM / E_MPA;
            let quantity = format!("{name}, nu {nu}: sink of the disc's centre, mm");
            rows.push(Check::relative(quantity, found, exact, 0.02, SOURCE));
        }
    }
    Ok(rows)
}

fn centre_sink_mm(kind: ElementKind, h: f64, nu: f64) -> Result<f64, CaseError> {
    let fine = 1.2 * RADIUS_MM;
    let (mesh, fixed) = quarter_space(kind, h, fine, 300.0 * RADIUS_MM, 1.0 * RADIUS_MM);
    let dead_n = disc_load(&mesh);
    let centre = mesh
        .nodes
        .iter()
        .position(|p| p[0].abs() + p[1].abs() + p[2].abs() < 1e-9)
        .ok_or("no node at the origin")?;
    let problem = Problem::new(mesh, uniform(E_MPA, nu)?, fixed, None)?;
    let loading = Loading { dead_n, ..Loading::default() };
    let options = Options { residual_tolerance: 1e-7, ..Options::default() };
    let (solver, _) = solve(&problem, loading, options, 1)?;
    Ok(-solver.displacement_mm()[centre][2])
}

/// Consistent nodal forces of the pressure on the disc; the disc cuts through
/// faces, so each is sampled finely and the sum scaled to the exact load.
fn disc_load(mesh: &Mesh) -> Vec<[f64; 3]> {
    const N: usize = 24;
    let side = (0..N).map(|i| (2.0 * i as f64 + 1.0) / N as f64 - 1.0);
    let weight = 4.0 / (N * N) as f64;
    let rule: Vec<_> =
        side.clone().flat_map(|y| side.clone().map(move |x| ([x, y], weight))).collect();
    let mut force = vec![[0.0; 3]; mesh.nodes.len()];
    let mut total = 0.0;
    let touch = &mesh.surfaces["touch"];
    touch.integrate(&rule, &|n| mesh.nodes[n as usize], &mut |face, value, area| {
        let mut x = [0.0; 3];
        for (&node, v) in face.iter().zip(value) {
            for i in 0..3 {
                x[i] += v * mesh.nodes[node as usize][i];
            }
        }
        if x[0].hypot(x[1]) <= RADIUS_MM {
            total += area[2];
            for (&node, v) in face.iter().zip(value) {
                force[node as usize][2] -= v * area[2];
            }
        }
    });
    let quarter = 0.25 * std::f64::consts::PI * RADIUS_MM * RADIUS_MM;
    let scale = PRESSURE_MPA * quarter / total;
    force.iter_mut().for_each(|f| f[2] *= scale);
    force
}
