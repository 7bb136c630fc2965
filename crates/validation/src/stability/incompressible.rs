//! Hard cases of nearly incompressible tissue: Poisson's ratios from 0.49 to 0.49999.

use super::lab::solve;
use super::{Hardness, Line, Suite};
use crate::verify::cook::membrane;
use crate::verify::{CaseError, Check};
use papilla_fem::element::ElementKind;
use papilla_fem::solve::Options;
use papilla_fem::testing::squeezed_block;

const RATIOS: [f64; 4] = [0.49, 0.499, 0.4999, 0.49999];

pub(super) fn run(suite: &Suite) -> Result<Vec<Line>, CaseError> {
    let (linear, quadratic) = if suite.long() { (64, 32) } else { (32, 16) };
    let (solid, cube) = if suite.long() { (12, 6) } else { (8, 4) };
    let mut lines = Vec::new();
    for nu in RATIOS {
        let found = cook_mm(ElementKind::Quad4, linear, nu);
        let reference = cook_mm(ElementKind::Quad9, quadratic, nu);
        let source = "Quad9, condensed pressure";
        let variant = format!("Cook, Quad4, nu {nu}");
        lines.push(line(variant, "rise of the tip", 0.01, source, found, reference));
    }
    for nu in RATIOS {
        for (kind, name, cells, twin, twin_cells, source) in [
            (ElementKind::Hex8, "Hex8", solid, ElementKind::Hex27, cube, "Hex27"),
            (ElementKind::Quad4, "Quad4", linear / 2, ElementKind::Quad9, linear / 2, "Quad9"),
        ] {
            let found = squeeze_n(kind, cells, nu);
            let reference = squeeze_n(twin, twin_cells, nu);
            let variant = format!("indentation, {name}, nu {nu}");
            lines.push(line(variant, "force of the indentation", 0.03, source, found, reference));
        }
    }
    Ok(lines)
}

type Found = Result<(f64, Hardness), CaseError>;

/// Both have to converge, to values that differ by no more than `tolerance`.
fn line(
    variant: String,
    quantity: &str,
    tolerance: f64,
    source: &'static str,
    found: Found,
    reference: Found,
) -> Line {
    match (found, reference) {
        (Ok((value, hard)), Ok((reference, _))) => {
            let check = Check::relative(quantity, value, reference, tolerance, source);
            Line::converged(variant, hard, vec![check])
        }
        (Err(error), _) => Line::broken(variant, error.to_string()),
        (_, Err(error)) => Line::broken(variant, format!("the reference, {source}: {error}")),
    }
}

fn cook_mm(kind: ElementKind, cells: usize, nu: f64) -> Found {
    let (problem, loading, tip) = membrane(kind, cells, nu)?;
    let options = Options { residual_tolerance: 1e-9, ..Options::default() };
    let (solver, report) = solve(&problem, loading, options, 2)?;
    Ok((solver.displacement_mm()[tip][1], (&report).into()))
}

fn squeeze_n(kind: ElementKind, cells: usize, nu: f64) -> Found {
    let (problem, loading, up) = squeezed_block(kind, cells, nu)?;
    let (solver, report) = solve(&problem, loading, Options::default(), 1)?;
    Ok((solver.balance().contact_force_n[up].abs(), (&report).into()))
}
