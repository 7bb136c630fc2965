//! Rigid indenters on an elastic half-plane (plane strain).

use super::bodies::{solve, uniform};
use super::{CaseError, Check, Context};
use papilla_fem::element::ElementKind;
use papilla_fem::mesh::lattice::{graded, lattice, part};
use papilla_fem::mesh::supports::{hold, merge};
use papilla_fem::solve::{Loading, MovingIndenter, Options, Problem};
use papilla_sdf::{Cylinder, Placement, RoundedPlate, SignedDistance, Wedge};
use std::f64::consts::PI;
use std::sync::Arc;

const E_MPA: f64 = 1.0;
const NU: f64 = 0.3;
/// Half-width of contact that depths are chosen for, mm.
const HALF_WIDTH_MM: f64 = 0.4;
/// Extent of the mesh over the half-width of contact.
const FAR: f64 = 250.0;
const KINDS: [(ElementKind, &str); 2] =
    [(ElementKind::Quad4, "Quad4"), (ElementKind::Quad9, "Quad9")];

/// `E / (1 - nu^2)`.
fn modulus_mpa() -> f64 {
    E_MPA / (1.0 - NU * NU)
}

/// Depth for about a force, mm. A half-plane gives way without bound, so depth depends
/// on the mesh's extent `d` and is no row: `P / (pi E*) (2 ln (2 d / a) - nu / (1 - nu))`
/// is its displacement relative to a point `d` below (Johnson 1985, sec. 5.6).
fn depth_mm(force_n_per_mm: f64) -> f64 {
    force_n_per_mm / (PI * modulus_mpa()) * (2.0 * (2.0 * FAR).ln() - NU / (1.0 - NU))
}

/// What an indenter does to the half-plane.
struct Pressed {
    /// Force, N per mm.
    force: f64,
    /// Root of the pressure-weighted mean of x^2, mm.
    spread_mm: f64,
    /// Nodes in contact from the middle on: x (mm) and pressure (MPa).
    pressure: Vec<(f64, f64)>,
}

/// A cylinder of radius 10 mm along the half-plane.
pub(super) fn cylinder(context: &Context) -> Result<Vec<Check>, CaseError> {
    const SOURCE: &str = "Hertz, line contact (Johnson 1985, eq. 4.43, 4.45)";
    const RADIUS_MM: f64 = 10.0;
    let mut rows = Vec::new();
    for (kind, name) in KINDS {
        let shape = Cylinder { radius_mm: RADIUS_MM, length_mm: 30.0, end_radius_mm: 1.0 };
        let due = PI * modulus_mpa() * HALF_WIDTH_MM.powi(2) / (4.0 * RADIUS_MM);
        let found = press(kind, per_width(context), Arc::new(shape), RADIUS_MM, depth_mm(due))?;
        let exact = (4.0 * found.force * RADIUS_MM / (PI * modulus_mpa())).sqrt();
        // Of a half ellipse the mean of x^2 is a^2 / 4.
        let quantity = format!("{name}, cylinder: half-width for its force, mm");
        rows.push(Check::relative(quantity, 2.0 * found.spread_mm, exact, 0.02, SOURCE));
        let peak = (found.force * modulus_mpa() / (PI * RADIUS_MM)).sqrt();
        let quantity = format!("{name}, cylinder: pressure at the middle, MPa");
        rows.push(Check::relative(quantity, found.pressure[0].1, peak, 0.02, SOURCE));
    }
    Ok(rows)
}

/// A wedge whose flanks rise 1 in 50.
pub(super) fn wedge(context: &Context) -> Result<Vec<Check>, CaseError> {
    const SOURCE: &str = "blunt wedge: P = E* a cot alpha (Johnson 1985, sec. 5.2; Sneddon)";
    const SLOPE: f64 = 0.02;
    let shape = Wedge {
        tip_width_mm: 0.002,
        base_width_mm: 0.002 + 2.0 * 0.2 / SLOPE,
        height_mm: 0.2,
        tip_radius_mm: 0.05,
        length_mm: 30.0,
    };
    let mut rows = Vec::new();
    for (kind, name) in KINDS {
        let depth = depth_mm(modulus_mpa() * HALF_WIDTH_MM * SLOPE);
        let found = press(kind, per_width(context), Arc::new(shape), 0.0, depth)?;
        // Of pressure as arcosh (a / x) the mean of x^2 is a^2 / 6.
        let half_width = 6f64.sqrt() * found.spread_mm;
        let exact = found.force / (modulus_mpa() * SLOPE);
        let quantity = format!("{name}, wedge of 1 in 50: half-width for its force, mm");
        rows.push(Check::relative(quantity, half_width, exact, 0.03, SOURCE));
        // Away from the tip, where pressure has no bound, and from the edge.
        let (x, p) = nearest(&found.pressure, 0.5 * exact);
        let exact = modulus_mpa() * SLOPE / PI * (exact / x).acosh();
        let quantity = format!("{name}, wedge of 1 in 50: pressure half way out, MPa");
        rows.push(Check::relative(quantity, p, exact, 0.03, SOURCE));
    }
    Ok(rows)
}

/// A flat punch with sharp edges: pressure at the edge has no bound.
pub(super) fn punch(context: &Context) -> Result<Vec<Check>, CaseError> {
    const SOURCE: &str = "P / (pi sqrt(a^2 - x^2)) (Johnson 1985, eq. 2.64; Sadowsky)";
    const EDGE_MM: f64 = 1e-4;
    // Flat up to the last node; to the mesh the edge is sharp.
    let half = HALF_WIDTH_MM + EDGE_MM;
    let shape = RoundedPlate { half_mm: [half, 15.0, 1.0], edge_radius_mm: EDGE_MM };
    let per = per_width(context);
    let mut rows = Vec::new();
    for (kind, name) in KINDS {
        let depth = 0.01 * HALF_WIDTH_MM;
        let edge = |per: f64| -> Result<(Pressed, f64), CaseError> {
            let found = press(kind, per, Arc::new(shape), 1.0, depth)?;
            let last = found.pressure.last().map_or(f64::NAN, |(_, p)| *p);
            let mean = found.force / (2.0 * HALF_WIDTH_MM);
            Ok((found, last / mean))
        };
        let ((_, coarse), (found, fine)) = (edge(per)?, edge(4.0 * per)?);
        let exact = found.force / (PI * HALF_WIDTH_MM);
        let quantity = format!("{name}, punch: pressure at the middle, MPa");
        rows.push(Check::relative(quantity, found.pressure[0].1, exact, 0.02, SOURCE));
        let (x, p) = nearest(&found.pressure, 0.8 * HALF_WIDTH_MM);
        let exact = found.force / (PI * (HALF_WIDTH_MM * HALF_WIDTH_MM - x * x).sqrt());
        let quantity = format!("{name}, punch: pressure 4/5 of the way out, MPa");
        rows.push(Check::relative(quantity, p, exact, 0.02, SOURCE));
        let quantity =
            format!("{name}, punch: growth of the edge's pressure, elements 1/4 as long");
        let source = "edge singularity 1/sqrt(distance): 2";
        rows.push(Check::relative(quantity, fine / coarse, 2.0, 0.05, source));
    }
    Ok(rows)
}

/// Elements over half the width of contact.
fn per_width(context: &Context) -> f64 {
    if context.quick { 8.0 } else { 16.0 }
}

/// The node nearest to `x`.
fn nearest(pressure: &[(f64, f64)], x: f64) -> (f64, f64) {
    let off = |p: &&(f64, f64)| (p.0 - x).abs();
    pressure
        .iter()
        .min_by(|a, b| off(a).total_cmp(&off(b)))
        .copied()
        .unwrap_or((f64::NAN, f64::NAN))
}

/// Presses half of the half-plane `y <= 0`, symmetric about `x = 0`.
fn press(
    kind: ElementKind,
    per_width: f64,
    shape: Arc<dyn SignedDistance>,
    top_mm: f64,
    depth_mm: f64,
) -> Result<Pressed, CaseError> {
    let (h, far) = (HALF_WIDTH_MM / per_width, FAR * HALF_WIDTH_MM);
    let fine = 1.5 * HALF_WIDTH_MM;
    let side = graded(h, fine, 1.25, far);
    let down = graded(h, fine, 1.25, far).iter().rev().map(|y| -y).collect();
    let mut mesh = lattice(kind, [side, down, vec![0.0]], |p| p);
    let touch = part(&mesh.surfaces["y_max"], |n| mesh.nodes[n as usize][0] <= 1.001 * fine);
    mesh.surfaces.insert("touch".into(), touch);
    let fixed = hold(&mesh, &[("x_min", [true, false, false])]);
    let fixed = merge(fixed, &hold(&mesh, &[("y_min", [true; 3])]));
    let problem = Problem::new(mesh, uniform(E_MPA, NU)?, fixed, Some("touch"))?;
    // Local z presses along -y, local y lies along z.
    let rotation = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]];
    let start = Placement { rotation, origin_mm: [0.0, top_mm, 0.0] };
    let indenter = MovingIndenter::straight(shape, start, [0.0, -depth_mm, 0.0]);
    let loading = Loading { indenter: Some(indenter), ..Loading::default() };
    let options = Options { gap_tolerance_mm: 1e-5 * depth_mm, ..Options::default() };
    let (solver, _) = solve(&problem, loading, options, 4)?;
    let surface = &problem.mesh.surfaces["touch"];
    let (nodal, x) = (solver.pressure_mpa(surface), solver.deformed());
    let (mut load, mut moment) = (0.0, 0.0);
    surface.integrate(&surface.kind.quadrature(), &|n| x[n as usize], &mut |face, value, area| {
        let (mut at, mut p) = (0.0, 0.0);
        for (&n, v) in face.iter().zip(value) {
            at += v * x[n as usize][0];
            p += v * nodal[n as usize];
        }
        load += p * area[1];
        moment += p * area[1] * at * at;
    });
    let mut pressure: Vec<_> = surface
        .nodes()
        .iter()
        .map(|&n| (x[n as usize][0], nodal[n as usize]))
        .filter(|(_, p)| *p > 0.0)
        .collect();
    pressure.sort_by(|a, b| a.0.total_cmp(&b.0));
    if pressure.is_empty() {
        return Err("nothing touches".into());
    }
    let force = 2.0 * solver.balance().contact_force_n[1].abs();
    Ok(Pressed { force, spread_mm: (moment / load).sqrt(), pressure })
}
