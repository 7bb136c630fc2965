//! One element of each published Ogden law, pulled and squeezed three ways.

use super::bodies::{internal_force, solve, tight};
use super::{CaseError, Check, Context};
use crate::verify::bodies::everywhere;
use papilla_fem::element::{Elastic, ElementKind};
use papilla_fem::mesh::lattice::cube;
use papilla_fem::mesh::supports::{hold, prescribe};
use papilla_fem::solve::{Loading, Problem};
use papilla_fingertip::materials::OgdenSpec;

const SOURCE: &str = "closed form (Abaqus' convention), thickness by bisection";

/// What is done to the two directions of the sheet; the third is free.
#[derive(Clone, Copy)]
enum Mode {
    Uniaxial,
    Planar,
    Equibiaxial,
}

pub(super) fn run(_: &Context) -> Result<Vec<Check>, CaseError> {
    let mut rows = Vec::new();
    for (spec, tissue) in [(OgdenSpec::skin(), "skin"), (OgdenSpec::subcutaneous(), "subcutaneous")]
    {
        for (mode, name, stretches) in [
            (Mode::Uniaxial, "uniaxial", [0.75, 1.4]),
            (Mode::Planar, "planar", [0.8, 1.35]),
            (Mode::Equibiaxial, "equibiaxial", [0.85, 1.2]),
        ] {
            for stretch in stretches {
                let found = pulled(&spec, mode, stretch)?;
                let exact = closed_form(&spec, spec.law()?.1, mode, stretch);
                let quantity = format!("{tissue}, {name} {stretch}: force, N");
                rows.push(Check::relative(quantity, found, exact, 1e-9, SOURCE));
            }
        }
    }
    Ok(rows)
}

/// Force along x on a unit cube, N.
fn pulled(spec: &OgdenSpec, mode: Mode, stretch: f64) -> Result<f64, CaseError> {
    let (law, bulk) = spec.law()?;
    let solid = Elastic::shared(law, bulk);
    let mesh = cube(ElementKind::Hex8, 1, |p| p);
    let (y_held, y_stretch) = match mode {
        Mode::Uniaxial => (false, 1.0),
        Mode::Planar => (true, 1.0),
        Mode::Equibiaxial => (true, stretch),
    };
    let fixed = hold(
        &mesh,
        &[
            ("x_min", [true, false, false]),
            ("x_max", [true, false, false]),
            ("y_min", [false, true, false]),
            ("y_max", [false, y_held, false]),
            ("z_min", [false, false, true]),
        ],
    );
    let prescribed_mm =
        prescribe(&mesh, &fixed, |x| [(stretch - 1.0) * x[0], (y_stretch - 1.0) * x[1], 0.0]);
    let problem = Problem::new(mesh, everywhere(solid.clone()), fixed, None)?;
    let loading = Loading { prescribed_mm, ..Loading::default() };
    let (solver, _) = solve(&problem, loading, tight(), 4)?;
    let force = internal_force(&problem, solver.displacement_mm())?;
    Ok(problem.mesh.node_sets["x_max"].iter().map(|&n| force[3 * n as usize]).sum())
}

/// Nominal stress along x, MPa: Kirchhoff stresses
/// `sum 2 mu / alpha (l_a^alpha - mean) + K J (J - 1)`, the free ones zero.
fn closed_form(spec: &OgdenSpec, bulk: f64, mode: Mode, a: f64) -> f64 {
    let stretches = |free: f64| match mode {
        Mode::Uniaxial => [a, free, free],
        Mode::Planar => [a, 1.0, free],
        Mode::Equibiaxial => [a, a, free],
    };
    let kirchhoff = |free: f64, along: usize| {
        let l = stretches(free);
        let j = l[0] * l[1] * l[2];
        let bar = l.map(|v| v * j.cbrt().recip());
        let terms = spec.mu_mpa.iter().zip(&spec.alpha);
        let isochoric: f64 = terms
            .map(|(mu, alpha)| {
                let power = bar.map(|v| v.powf(*alpha));
                2.0 * mu / alpha * (power[along] - power.iter().sum::<f64>() / 3.0)
            })
            .sum();
        isochoric + bulk * j * (j - 1.0)
    };
    // The free stress rises with the free stretch wherever the law is stable.
    let (mut low, mut high) = (0.3, 3.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if kirchhoff(middle, 2) < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    kirchhoff(0.5 * (low + high), 0) / a
}
