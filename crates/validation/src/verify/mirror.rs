//! Indentations rolled to either side are mirror images.

use super::{CaseError, Check, Context};
use papilla_fem::solve::Options;
use papilla_fingertip::mesh::fingertip::Density;
use papilla_fingertip::scene::Pose;
use papilla_fingertip::simulation::body::Body;
use papilla_fingertip::simulation::drive::{Approach, Drive};
use papilla_fingertip::simulation::record::IncrementRecord;
use std::collections::HashMap;

const SOURCE: &str = "symmetry of the finger";

pub(super) fn run(context: &Context) -> Result<Vec<Check>, CaseError> {
    let finger = Body::usual(Density::Coarse)?;
    let depth_mm = if context.quick { 0.5 } else { 1.0 };
    let [left, right] = [-15.0, 15.0].map(|roll_deg| press(&finger, roll_deg, depth_mm));
    let (left, right) = (left?, right?);
    let patch = &finger.patch.as_ref().ok_or("the fingertip has no patch")?.patch;
    let skin: Vec<_> = patch.skin.iter().map(|&n| finger.problem.mesh.nodes[n as usize]).collect();
    // The mesh mirrors bit for bit; adding zero turns -0 into 0.
    let key = |p: &[f64; 3], sign: f64| [p[0], sign * p[1] + 0.0, p[2]].map(f64::to_bits);
    let at: HashMap<_, _> = skin.iter().enumerate().map(|(i, p)| (key(p, 1.0), i)).collect();
    let twin = skin
        .iter()
        .map(|p| at.get(&key(p, -1.0)).copied())
        .collect::<Option<Vec<_>>>()
        .ok_or("a skin vertex has no mirror image")?;
    let difference = |of: fn(&IncrementRecord) -> &[f64]| {
        let (a, b) = (of(&left), of(&right));
        let scale = a.iter().copied().fold(0.0, f64::max);
        let worst = twin.iter().enumerate().map(|(i, &j)| (a[i] - b[j]).abs()).fold(0.0, f64::max);
        worst / scale
    };
    let row = |what: &str, value| {
        let quantity = format!("roll -15 against +15 deg, {depth_mm} mm: {what}, over its maximum");
        Check::vanishes(quantity, value, 1e-8, SOURCE)
    };
    Ok(vec![
        row("pressure", difference(|r| &r.pressure_mpa)),
        row("SED of the dermis", difference(|r| &r.sed_dermis_mpa)),
        row("SED of the epidermis", difference(|r| &r.sed_epidermis_mpa)),
    ])
}

fn press(finger: &Body, roll_deg: f64, depth_mm: f64) -> Result<IncrementRecord, CaseError> {
    let options = Options {
        residual_tolerance: 1e-12,
        gap_tolerance_mm: 1e-9,
        augmentations_max: 40,
        ..Options::default()
    };
    let mut solver = finger.solver(options)?;
    let pose = Pose { pitch_deg: 10.0, roll_deg, yaw_deg: 0.0 };
    let mut last = None;
    finger.press(
        &mut solver,
        &Approach::plate(pose),
        &Drive::Depths(vec![0.5 * depth_mm, depth_mm]),
        1,
        &mut |_, record, _| {
            last = Some(record.clone());
        },
    )?;
    last.ok_or_else(|| "no state was recorded".into())
}
