//! A nearly incompressible block, bonded below, squeezed by a smooth plate.

use super::bodies::{solve, uniform};
use super::{CaseError, Check, Context};
use papilla_fem::element::ElementKind;
use papilla_fem::mesh::block::even;
use papilla_fem::mesh::lattice::{intervals, lattice};
use papilla_fem::mesh::supports::hold;
use papilla_fem::solve::{Loading, MovingIndenter, Options, Problem};
use papilla_sdf::{Placement, RoundedPlate};
use std::sync::Arc;

const SOURCE: &str = "this code, Hex27";
const PLANAR: &str = "this code, Quad9, twice as fine";

pub(super) fn run(context: &Context) -> Result<Vec<Check>, CaseError> {
    let (linear, quadratic) = if context.quick { (8, 4) } else { (12, 6) };
    let mut rows = Vec::new();
    for nu in [0.4, 0.4999] {
        let reference = force_n(ElementKind::Hex27, quadratic, nu)?;
        let found = force_n(ElementKind::Hex8, linear, nu)?;
        let quantity = format!("Hex8, {linear} cells across, nu {nu}: force at 15 %, N");
        rows.push(Check::relative(quantity, found, reference, 0.03, SOURCE));
        let reference = force_n(ElementKind::Quad9, 2 * linear, nu)?;
        for (kind, name, cells, tolerance) in [
            (ElementKind::Quad4, "Quad4", 2 * linear, 0.03),
            (ElementKind::Quad8, "Quad8", linear, 0.02),
            (ElementKind::Quad9, "Quad9", linear, 0.02),
        ] {
            let found = force_n(kind, cells, nu)?;
            let quantity =
                format!("{name}, {cells} cells across, nu {nu}: force at 15 %, N per mm");
            rows.push(Check::relative(quantity, found, reference, tolerance, PLANAR));
        }
    }
    Ok(rows)
}

fn force_n(kind: ElementKind, cells: usize, nu: f64) -> Result<f64, CaseError> {
    let (problem, loading, up) = squeezed(kind, cells, nu)?;
    let (solver, _) = solve(&problem, loading, Options::default(), 3)?;
    Ok(solver.balance().contact_force_n[up].abs())
}

/// The problem of a quarter of a 10 x 10 x 5 mm block squeezed by 0.75 mm; of planar
/// elements of half of a 10 x 5 mm section, 1 mm long. The number is the axis of the squeeze.
pub(crate) fn squeezed(
    kind: ElementKind,
    cells: usize,
    nu: f64,
) -> Result<(Problem, Loading, usize), CaseError> {
    let n = intervals(kind) * cells;
    let mesh = lattice(kind, [even(5.0, n), even(5.0, n), even(5.0, n)], |p| p);
    let up = kind.dimension() - 1;
    let (held, touched) = [("y_min", "y_max"), ("z_min", "z_max")][up - 1];
    let mut sides = vec![("x_min", [true, false, false]), (held, [true; 3])];
    // Upside down: the plate presses with its local +z face.
    let rotation = if kind.is_planar() {
        [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]
    } else {
        sides.push(("y_min", [false, true, false]));
        [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]
    };
    let fixed = hold(&mesh, &sides);
    let problem = Problem::new(mesh, uniform(0.1, nu)?, fixed, Some(touched))?;
    let plate = Arc::new(RoundedPlate { half_mm: [20.0, 20.0, 2.0], edge_radius_mm: 0.5 });
    let along = |v: f64| std::array::from_fn(|i| if i == up { v } else { 0.0 });
    let start = Placement { rotation, origin_mm: along(7.0) };
    let indenter = MovingIndenter::straight(plate, start, along(-0.75));
    let loading = Loading { indenter: Some(indenter), ..Loading::default() };
    Ok((problem, loading, up))
}
