//! Indentations of the coarse fingertip: in one increment, deep, tilted.

use super::lab::{Pressed, press_body, tight};
use super::{Line, Suite};
use crate::verify::{CaseError, Check};
use papilla_fem::solve::{Effort, Loading, Options, StepReport};
use papilla_fingertip::geometry::fingertip::FingertipShape;
use papilla_fingertip::mesh::fingertip::{Density, Order, Parts};
use papilla_fingertip::scene::{Plan, Pose, TissueTable};
use papilla_fingertip::simulation::body::{Body, SimulationError};
use papilla_fingertip::simulation::drive::{Approach, Drive};
use papilla_fingertip::simulation::laws::solids;
use papilla_sdf::{Plate, RoundedPlate};
use std::sync::Arc;

fn pose(pitch_deg: f64, roll_deg: f64) -> Pose {
    Pose { pitch_deg, roll_deg, yaw_deg: 0.0 }
}

/// Straight to `depth_mm` in exactly `increments` increments.
fn incremented(
    body: &Body,
    pose: Pose,
    depth_mm: f64,
    increments: u32,
) -> Result<Pressed, SimulationError> {
    let mut solver = body.solver(Options {
        residual_tolerance: 1e-9,
        gap_tolerance_mm: 1e-6,
        ..Options::default()
    })?;
    let indenter = body.indenter(&Approach::plate(pose), &Drive::Depths(vec![depth_mm]))?;
    solver.start(Loading { indenter: Some(indenter), ..Loading::default() });
    let (mut report, mut effort) = (StepReport::default(), Effort::default());
    for i in 1..=increments {
        let at = |source| SimulationError::Solve { depth_mm, source };
        report = solver.advance_to(f64::from(i) / f64::from(increments)).map_err(at)?;
        effort = effort.plus(&report.effort);
    }
    Pressed::of(body, &solver, depth_mm, StepReport { effort, ..report })
}

pub(super) fn one_increment(suite: &Suite) -> Result<Vec<Line>, CaseError> {
    let body = suite.finger()?;
    let mut lines = Vec::new();
    let (pitches, increments, source) = if suite.quick() {
        (&[30.0][..], 4, "four increments")
    } else {
        (&[0.0, 30.0][..], 10, "ten increments")
    };
    for &pitch in pitches {
        let once = incremented(body, pose(pitch, 0.0), 2.0, 1)?;
        let often = incremented(body, pose(pitch, 0.0), 2.0, increments)?;
        let checks = once.same_as(&often, 1e-5, source);
        // Energy against work needs the way between: one increment has none.
        lines.push(crate::stability::Line::converged(
            format!("2 mm at once, pitch {pitch}"),
            once.hardness(),
            [
                checks,
                once.balances()
                    .into_iter()
                    .filter(|c| c.quantity != "energy against work")
                    .collect(),
            ]
            .concat(),
        ));
    }
    Ok(lines)
}

pub(super) fn deep(suite: &Suite) -> Result<Vec<Line>, CaseError> {
    let approach = Approach::plate(Pose::default());
    let drive = Drive::Depths(vec![1.0, 2.0, 3.0]);
    let linear = press_body(suite.finger()?, &approach, &drive, Options::default())?;
    if suite.quick() {
        return Ok(vec![linear.line("3 mm, Hex8", Vec::new())]);
    }
    let plan = Plan::usual();
    let materials = solids(&TissueTable::default(), &plan)?;
    let shape = FingertipShape::default();
    let body = Body::fingertip(
        &shape,
        materials,
        Density::Coarse,
        Order::Quadratic,
        Parts::default(),
        None,
    )?;
    let quadratic = press_body(&body, &approach, &drive, Options::default())?;
    let source = "Hex27 on the same nodes";
    let force = Check::relative("force", linear.force_n(), quadratic.force_n(), 0.1, source);
    Ok(vec![linear.line("3 mm, Hex8", vec![force]), quadratic.line("3 mm, Hex27", Vec::new())])
}

pub(super) fn tilt(suite: &Suite) -> Result<Vec<Line>, CaseError> {
    let body = suite.finger()?;
    let (depths, pitches) = if suite.quick() {
        (vec![0.3], &[60.0][..])
    } else {
        (vec![0.5, 1.0], &[0.0, 30.0, 60.0, 80.0][..])
    };
    let drive = Drive::Depths(depths);
    let mut lines = Vec::new();
    for &pitch in pitches {
        let options = Options { residual_tolerance: 1e-9, gap_tolerance_mm: 1e-7, ..tight() };
        let pressed = press_body(body, &Approach::plate(pose(pitch, 0.0)), &drive, options)?;
        let side = pressed.record.force_n[1] / pressed.force_n();
        let side = Check::vanishes("sideways force / force", side, 1e-6, "the finger's symmetry");
        lines.push(pressed.line(format!("plate at {pitch} deg"), vec![side]));
    }
    lines.push(corner_first(body, &drive)?);
    Ok(lines)
}

/// A small plate so far aside that a corner alone meets the finger, and its mirror image.
fn corner_first(body: &Body, drive: &Drive) -> Result<Line, CaseError> {
    let plate = RoundedPlate::from(&Plate { size_mm: [7.0, 7.0], edge_radius_mm: 2.0 });
    let aside = |side: f64| Approach {
        top_mm: plate.half_mm[2],
        shape: Arc::new(plate),
        offset_mm: [3.0, 3.0 * side],
        pose: pose(15.0, 10.0 * side),
        friction: 0.0,
        contact: None,
    };
    let [left, right] = [1.0, -1.0].map(|side| press_body(body, &aside(side), drive, tight()));
    let (left, right) = (left?, right?);
    let mirrored = {
        let [x, y, z] = right.record.force_n;
        let l = left.record.force_n;
        papilla_vector::norm([l[0] - x, l[1] + y, l[2] - z]) / left.force_n()
    };
    let checks = vec![Check::vanishes(
        "force against its mirror image",
        mirrored,
        1e-6,
        "the finger's symmetry",
    )];
    Ok(left.line("a corner first", checks))
}
