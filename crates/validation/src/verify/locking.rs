//! A nearly incompressible block, bonded below, squeezed by a smooth plate.

use super::bodies::solve;
use super::{CaseError, Check, Context};
use papilla_fem::element::ElementKind;
use papilla_fem::solve::Options;
use papilla_fem::testing::squeezed_block;

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
    let (problem, loading, up) = squeezed_block(kind, cells, nu)?;
    let (solver, _) = solve(&problem, loading, Options::default(), 3)?;
    Ok(solver.balance().contact_force_n[up].abs())
}
