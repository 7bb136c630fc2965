//! A flat plate on the fingertip: every equilibrium balances.

use super::{CaseError, Check, Context};
use papilla_dataset::Checks;
use papilla_fem::solve::Options;
use papilla_fingertip::mesh::fingertip::Density;
use papilla_fingertip::scene::Pose;
use papilla_fingertip::simulation::body::Body;
use papilla_fingertip::simulation::drive::{Approach, Drive};

/// Refinement of the path between stored depths: the work integral needs it.
const REFINEMENT: u32 = 2;
/// Stored depths.
const STEPS: u32 = 10;
/// Depth from which balances are judged, mm: the shallowest a campaign stores.
/// Before it a handful of coarse nodes touch and the work integral is poor.
const DEPTH_MIN_MM: f64 = 0.25;

/// The integral of the pressure is no row: it is the reaction by construction, wherever all of
/// the contact is recorded.
pub(super) fn run(context: &Context) -> Result<Vec<Check>, CaseError> {
    let (density, step_mm) =
        if context.quick { (Density::Coarse, 0.1) } else { (Density::Medium, 0.2) };
    let finger = Body::usual(density)?;
    let mut solver = finger.solver(Options::default())?;
    let depths_mm: Vec<f64> = (1..=STEPS).map(|i| step_mm * f64::from(i)).collect();
    let mut judged: Vec<(f64, Checks)> = Vec::new();
    finger.press(
        &mut solver,
        &Approach::plate(Pose::default()),
        &Drive::Depths(depths_mm),
        REFINEMENT,
        &mut |_, record, _| {
            if record.depth_mm >= DEPTH_MIN_MM {
                judged.push((record.depth_mm, record.checks));
            }
        },
    )?;
    let [(first_mm, _), .., (deepest_mm, _)] = judged[..] else {
        return Err("too few equilibria to judge".into());
    };
    let row = |what: &str, of: fn(&Checks) -> f64, tolerance| {
        let worst = judged.iter().map(|(_, c)| of(c)).fold(0.0, f64::max);
        let quantity = format!("{density:?}, {first_mm:.1} to {deepest_mm:.1} mm: {what}, worst");
        Check::vanishes(quantity, worst, tolerance, "equilibrium")
    };
    Ok(vec![
        row("plate against supports", |c| c.plate_vs_support_reaction, 1e-5),
        row("energy against work", |c| c.energy_vs_work, 0.005),
        row("residual over forces", |c| c.residual_relative, 1e-6),
        row("penetration, mm", |c| c.penetration_mm_max, 1e-4),
    ])
}
