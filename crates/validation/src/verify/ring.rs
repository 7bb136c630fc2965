//! A ring under internal pressure in plane strain (Lame), with planar elements.

use super::bodies::{solve, uniform};
use super::{CaseError, Check, Context};
use papilla_fem::element::ElementKind;
use papilla_fem::mesh::block::even;
use papilla_fem::mesh::lattice::{intervals, lattice};
use papilla_fem::mesh::supports::hold;
use papilla_fem::solve::{Loading, Options, Problem};
use std::f64::consts::FRAC_PI_2;

const SOURCE: &str = "Lame: (1 + nu) p a ((1 - 2 nu) a^2 + b^2) / E (b^2 - a^2)";
const E_MPA: f64 = 1.0;
/// Small enough that finite strain changes no digit that is compared.
const PRESSURE_MPA: f64 = 1e-6;
const INNER_MM: f64 = 1.0;
const OUTER_MM: f64 = 2.0;

pub(super) fn run(_: &Context) -> Result<Vec<Check>, CaseError> {
    let mut rows = Vec::new();
    for (kind, name, cells, tolerance) in [
        (ElementKind::Quad4, "Quad4", 24, 5e-3),
        (ElementKind::Quad8, "Quad8", 8, 1e-3),
        (ElementKind::Quad9, "Quad9", 8, 1e-3),
    ] {
        for nu in [0.3, 0.4999] {
            let (a, b) = (INNER_MM, OUTER_MM);
            let exact = (1.0 + nu) * PRESSURE_MPA * a * ((1.0 - 2.0 * nu) * a * a + b * b)
                / (E_MPA * (b * b - a * a));
            let found = opens_mm(kind, cells, nu)?;
            let quantity = format!("{name}, {cells} x {cells}, nu {nu}: inner radius grows by, mm");
            rows.push(Check::relative(quantity, found, exact, tolerance, SOURCE));
        }
    }
    Ok(rows)
}

/// Radial displacement of the inner side of a quarter of the ring.
fn opens_mm(kind: ElementKind, cells: usize, nu: f64) -> Result<f64, CaseError> {
    let axis = even(1.0, intervals(kind) * cells);
    let mesh = lattice(kind, [axis.clone(), axis.clone(), axis], |[s, t, _]| {
        let (r, angle) = (INNER_MM + s * (OUTER_MM - INNER_MM), t * FRAC_PI_2);
        [r * angle.cos(), r * angle.sin(), 0.0]
    });
    let fixed = hold(&mesh, &[("y_min", [false, true, false]), ("y_max", [true, false, false])]);
    let mut dead_n = vec![[0.0; 3]; mesh.nodes.len()];
    let inside = &mesh.surfaces["x_min"];
    inside.integrate(
        &inside.kind.quadrature(),
        &|n| mesh.nodes[n as usize],
        &mut |edge, value, normal| {
            for (&node, v) in edge.iter().zip(value) {
                for i in 0..3 {
                    dead_n[node as usize][i] -= PRESSURE_MPA * v * normal[i];
                }
            }
        },
    );
    let first = mesh.node_sets["x_min"]
        .iter()
        .map(|&n| n as usize)
        .find(|&n| mesh.nodes[n][1].abs() < 1e-12)
        .ok_or("no node on the inner side")?;
    let problem = Problem::new(mesh, uniform(E_MPA, nu)?, fixed, None)?;
    let loading = Loading { dead_n, ..Loading::default() };
    let options = Options { residual_tolerance: 1e-9, ..Options::default() };
    let (solver, _) = solve(&problem, loading, options, 1)?;
    Ok(solver.displacement_mm()[first][0])
}
