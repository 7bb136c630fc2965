//! An elastic indentation ends in the same state however many steps led there.

use super::{CaseError, Check, Context};
use papilla_fem::solve::{Loading, Options, StepReport};
use papilla_fingertip::mesh::fingertip::Density;
use papilla_fingertip::scene::Pose;
use papilla_fingertip::simulation::body::Body;
use papilla_fingertip::simulation::drive::{Approach, Drive};
use papilla_fingertip::simulation::record::{IncrementRecord, relative_l2};

const SOURCE: &str = "an elastic state does not depend on its path";
const DEPTH_MM: f64 = 1.0;

pub(super) fn run(context: &Context) -> Result<Vec<Check>, CaseError> {
    let finger = Body::usual(Density::Coarse)?;
    let many = if context.quick { 4 } else { 100 };
    let (once, often) = (press(&finger, 1)?, press(&finger, many)?);
    let row = |what: &str, a: &[f64], b: &[f64]| {
        let quantity = format!("1 against {many} steps to 1 mm: {what}, relative L2");
        Check::vanishes(quantity, relative_l2(a, b), 1e-5, SOURCE)
    };
    Ok(vec![
        row("pressure", &once.pressure_mpa, &often.pressure_mpa),
        row("SED of the dermis", &once.sed_dermis_mpa, &often.sed_dermis_mpa),
        row("SED of the epidermis", &once.sed_epidermis_mpa, &often.sed_epidermis_mpa),
    ])
}

fn press(finger: &Body, steps: u32) -> Result<IncrementRecord, CaseError> {
    let options =
        Options { residual_tolerance: 1e-9, gap_tolerance_mm: 1e-6, ..Options::default() };
    let mut solver = finger.solver(options)?;
    let approach = Approach::plate(Pose { pitch_deg: 15.0, roll_deg: 0.0, yaw_deg: 0.0 });
    let indenter = finger.indenter(&approach, &Drive::Depths(vec![DEPTH_MM]))?;
    solver.start(Loading { indenter: Some(indenter), ..Loading::default() });
    let mut report = StepReport::default();
    for s in 1..=steps {
        report = solver.advance_to(f64::from(s) / f64::from(steps))?;
    }
    Ok(finger.record(&solver, DEPTH_MM, &report)?)
}
