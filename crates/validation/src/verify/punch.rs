//! A flat circular punch on a half-space (Sneddon).

use super::bodies::{quarter_space, solve, uniform};
use super::{CaseError, Check, Context};
use papilla_fem::element::ElementKind;
use papilla_fem::solve::{Loading, MovingIndenter, Options, Problem};
use papilla_sdf::{Placement, Punch};
use std::sync::Arc;

const SOURCE: &str = "F = 2 a E* d (Sneddon 1965)";
const E_MPA: f64 = 1.0;
const NU: f64 = 0.3;
const RADIUS_MM: f64 = 1.0;
const RIM_MM: f64 = 1e-3;
const DEPTH_MM: f64 = 0.01;

/// The nodes under the flat end touch, on a square grid: to the mesh the punch is smaller by
/// a part of an element all round, and its force lower by as much. That error falls
/// with the element and not with its square, hence the tolerance of half an element.
pub(super) fn run(context: &Context) -> Result<Vec<Check>, CaseError> {
    let per_radius = if context.quick { 6.0 } else { 16.0 };
    let exact = 2.0 * RADIUS_MM * E_MPA / (1.0 - NU * NU) * DEPTH_MM;
    let force = force_n(RADIUS_MM / per_radius)?;
    let quantity = format!("Hex8, {per_radius} elements a radius: force of a flat punch, N");
    let mut rows = vec![Check::relative(quantity, force, exact, 0.5 / per_radius, SOURCE)];
    rows.extend(super::half_plane::punch(context)?);
    Ok(rows)
}

/// Force of the punch, N.
fn force_n(h: f64) -> Result<f64, CaseError> {
    let far = 100.0 * RADIUS_MM;
    let (mesh, fixed) = quarter_space(ElementKind::Hex8, h, 1.25 * RADIUS_MM, far, RADIUS_MM);
    let problem = Problem::new(mesh, uniform(E_MPA, NU)?, fixed, Some("touch"))?;
    let rotation = [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]];
    let start = Placement { rotation, origin_mm: [0.0; 3] };
    let punch = Punch { radius_mm: RADIUS_MM + RIM_MM, rim_radius_mm: RIM_MM, height_mm: 1.0 };
    let indenter = MovingIndenter::straight(Arc::new(punch), start, [0.0, 0.0, -DEPTH_MM]);
    let loading = Loading { indenter: Some(indenter), ..Loading::default() };
    let options = Options { gap_tolerance_mm: 1e-4 * DEPTH_MM, ..Options::default() };
    let (solver, _) = solve(&problem, loading, options, 2)?;
    Ok(4.0 * solver.balance().contact_force_n[2].abs())
}
