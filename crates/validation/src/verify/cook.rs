//! Cook's membrane, plane strain, finite strain: planar elements, and a slab of
//! hexahedra that cannot move through its thickness.

use super::bodies::{solve, uniform};
use super::{CaseError, Check, Context};
use papilla_fem::element::ElementKind;
use papilla_fem::mesh::block::even;
use papilla_fem::mesh::lattice::{intervals, lattice};
use papilla_fem::mesh::supports::hold;
use papilla_fem::solve::{Loading, Options, Problem};

/// Rise of the middle of the loaded end, `(48, 52)` mm, converged, published for
/// `U = mu/2 (I1bar - 3) + K/4 (J^2 - 1 - 2 ln J)`. With the volumetric law
/// used here, `K/2 (J - 1)^2`, an independent two-dimensional code (Q2, full
/// integration) finds 0.06 % less; the corner `(48, 60)` rises 13.77 mm.
const PUBLISHED_MM: f64 = 14.74;
const PUBLISHED: &str = "published; its volumetric law, K/4 (J^2 - 1 - 2 ln J), adds 0.06 %";
const QUADRATIC: &str = "this code, Hex27";
const MU_MPA: f64 = 0.4225;

pub(super) fn run(context: &Context) -> Result<Vec<Check>, CaseError> {
    let (linear, quadratic) = if context.quick { (32, 16) } else { (64, 24) };
    let mut rows = Vec::new();
    let reference = rise_mm(ElementKind::Hex27, quadratic, 0.3)?;
    let fine = rise_mm(ElementKind::Hex8, linear, 0.3)?;
    let row = |kind: &str, cells: usize, nu: f64| {
        format!("{kind}, {cells} x {cells}, nu {nu}: rise of the end, mm")
    };
    rows.push(Check::relative(
        row("Hex27", quadratic, 0.3),
        reference,
        PUBLISHED_MM,
        0.005,
        PUBLISHED,
    ));
    rows.push(Check::relative(row("Hex8", linear, 0.3), fine, PUBLISHED_MM, 0.005, PUBLISHED));
    rows.push(Check::relative(row("Hex8", linear, 0.3), fine, reference, 0.005, QUADRATIC));
    let reference = rise_mm(ElementKind::Hex27, quadratic, 0.4999)?;
    for (cells, tolerance) in [(linear / 2, 0.02), (linear, 0.01)] {
        let rise = rise_mm(ElementKind::Hex8, cells, 0.4999)?;
        let quantity = row("Hex8", cells, 0.4999);
        rows.push(Check::relative(quantity, rise, reference, tolerance, QUADRATIC));
    }
    rows.extend(planar()?);
    Ok(rows)
}

/// Planar elements against the published value, and against the slab, whose
/// plane solution they have to repeat digit for digit.
fn planar() -> Result<Vec<Check>, CaseError> {
    let (linear, quadratic, slab) = (32, 16, 8);
    let mut rows = Vec::new();
    let kinds = [
        (ElementKind::Quad4, "Quad4", linear),
        (ElementKind::Quad8, "Quad8", quadratic),
        (ElementKind::Quad9, "Quad9", quadratic),
    ];
    let reference = rise_mm(ElementKind::Quad9, 2 * quadratic, 0.4999)?;
    for (kind, name, cells) in kinds {
        let rise = rise_mm(kind, cells, 0.3)?;
        let quantity = format!("{name}, {cells} x {cells}, nu 0.3: rise of the end, mm");
        rows.push(Check::relative(quantity, rise, PUBLISHED_MM, 0.005, PUBLISHED));
        let rise = rise_mm(kind, cells, 0.4999)?;
        let quantity = format!("{name}, {cells} x {cells}, nu 0.4999: rise of the end, mm");
        let source = "this code, Quad9, twice as fine";
        rows.push(Check::relative(quantity, rise, reference, 0.01, source));
    }
    let twins = [
        (ElementKind::Quad4, ElementKind::Hex8, "Quad4", "a slab of Hex8 on the same mesh"),
        (ElementKind::Quad9, ElementKind::Hex27, "Quad9", "a slab of Hex27 on the same mesh"),
    ];
    for (flat, solid, name, source) in twins {
        for nu in [0.3, 0.4999] {
            let [rise, slab_mm] = [rise_mm(flat, slab, nu)?, rise_mm(solid, slab, nu)?];
            let quantity = format!("{name}, {slab} x {slab}, nu {nu}: rise of the end, mm");
            rows.push(Check::relative(quantity, rise, slab_mm, 1e-7, source));
        }
    }
    Ok(rows)
}

/// Rise of the middle of the loaded end under 1 N per mm of thickness.
fn rise_mm(kind: ElementKind, cells: usize, nu: f64) -> Result<f64, CaseError> {
    let (problem, loading, tip) = membrane(kind, cells, nu)?;
    let options = Options { residual_tolerance: 1e-9, ..Options::default() };
    let (solver, _) = solve(&problem, loading, options, 4)?;
    Ok(solver.displacement_mm()[tip][1])
}

/// The membrane, its load and the node in the middle of the loaded end.
pub(crate) fn membrane(
    kind: ElementKind,
    cells: usize,
    nu: f64,
) -> Result<(Problem, Loading, usize), CaseError> {
    let step = intervals(kind);
    let n = step * cells;
    let mesh = lattice(kind, [even(1.0, n), even(1.0, n), even(1.0, step)], |[s, t, z]| {
        [48.0 * s, 44.0 * s + t * (44.0 + s * (16.0 - 44.0)), z]
    });
    let mut fixed = hold(&mesh, &[("x_min", [true; 3])]);
    // Plane strain of the slab: nothing moves through the thickness.
    for n in 0..mesh.nodes.len() {
        fixed[3 * n + 2] = true;
    }
    let mut dead_n = vec![[0.0; 3]; mesh.nodes.len()];
    let end = &mesh.surfaces["x_max"];
    end.integrate(&end.kind.quadrature(), &|n| mesh.nodes[n as usize], &mut |face, value, area| {
        for (&node, v) in face.iter().zip(value) {
            dead_n[node as usize][1] += v * papilla_vector::norm(area) / 16.0;
        }
    });
    let middle = |p: &[f64; 3]| p[0] > 47.999 && (p[1] - 52.0).abs() < 1e-6;
    let tip = mesh.nodes.iter().position(middle).ok_or("no node in the middle of the end")?;
    let problem = Problem::new(mesh, uniform(2.0 * MU_MPA * (1.0 + nu), nu)?, fixed, None)?;
    Ok((problem, Loading { dead_n, ..Loading::default() }, tip))
}
