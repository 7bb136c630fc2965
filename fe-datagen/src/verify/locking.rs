//! A nearly incompressible block, bonded below, squeezed by a smooth plate.

use super::bodies::{hold, lattice, solve, uniform};
use super::{CaseError, Check, Context};
use crate::element::ElementKind;
use crate::indenter::{Placement, RoundedPlate};
use crate::mesh::block::even;
use crate::solve::{Loading, MovingIndenter, Options, Problem};
use std::sync::Arc;

const SOURCE: &str = "this code, Hex27";

pub(super) fn run(context: &Context) -> Result<Vec<Check>, CaseError> {
    let (linear, quadratic) = if context.quick { (8, 4) } else { (12, 6) };
    let mut rows = Vec::new();
    for nu in [0.4, 0.4999] {
        let reference = force_n(ElementKind::Hex27, quadratic, nu)?;
        let found = force_n(ElementKind::Hex8, linear, nu)?;
        let quantity = format!("Hex8, {linear} cells across, nu {nu}: force at 15 %, N");
        rows.push(Check::relative(quantity, found, reference, 0.03, SOURCE));
    }
    Ok(rows)
}

/// Force on a quarter of a 10 x 10 x 5 mm block squeezed by 0.75 mm.
fn force_n(kind: ElementKind, cells: usize, nu: f64) -> Result<f64, CaseError> {
    let n = if kind == ElementKind::Hex27 { 2 * cells } else { cells };
    let mesh = lattice(kind, [even(5.0, n), even(5.0, n), even(5.0, n)], |p| p);
    let fixed = hold(
        &mesh,
        &[("x_min", [true, false, false]), ("y_min", [false, true, false]), ("z_min", [true; 3])],
    );
    let problem = Problem::new(mesh, uniform(0.1, nu)?, fixed, Some("z_max"))?;
    // Upside down: the plate presses with its local +z face.
    let rotation = [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]];
    let plate = Arc::new(RoundedPlate { half_mm: [20.0, 20.0, 2.0], edge_radius_mm: 0.5 });
    let start = Placement { rotation, origin_mm: [0.0, 0.0, 7.0] };
    let indenter = MovingIndenter::straight(plate, start, [0.0, 0.0, -0.75]);
    let loading = Loading { indenter: Some(indenter), ..Loading::default() };
    let (solver, _) = solve(&problem, loading, Options::default(), 3)?;
    Ok(solver.balance().contact_force_n[2].abs())
}
