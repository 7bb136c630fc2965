//! Bone and nail as solids: half a million times as stiff as the fat between them.

use super::{CaseError, Check, Context};
use papilla_fem::solve::Options;
use papilla_fingertip::geometry::fingertip::FingertipShape;
use papilla_fingertip::mesh::fingertip::{Density, Order, Parts};
use papilla_fingertip::scene::{Plan, Pose, TissueTable};
use papilla_fingertip::simulation::body::Body;
use papilla_fingertip::simulation::drive::{Approach, Drive};
use papilla_fingertip::simulation::laws::solids;
use papilla_fingertip::simulation::record::IncrementRecord;
use papilla_vector::norm;

/// Depths on the coarse mesh, mm; the last is judged.
const DEPTHS_MM: [f64; 3] = [0.25, 0.5, 1.0];

fn press(parts: Parts) -> Result<IncrementRecord, CaseError> {
    let plan = Plan { parts, ..Plan::usual() };
    let materials = solids(&TissueTable::default(), &plan)?;
    let shape = FingertipShape::default();
    let body = Body::fingertip(&shape, materials, Density::Coarse, Order::Linear, parts, None)?;
    let mut solver = body.solver(Options::default())?;
    let (approach, drive) = (Approach::plate(Pose::default()), Drive::Depths(DEPTHS_MM.into()));
    let mut last = None;
    body.press(&mut solver, &approach, &drive, 2, &mut |_, r, _| last = Some(r.clone()))?;
    last.ok_or_else(|| "nothing was stored".into())
}

pub(super) fn run(_: &Context) -> Result<Vec<Check>, CaseError> {
    let rigid = norm(press(Parts::default())?.force_n);
    let mut rows = Vec::new();
    for (name, parts) in [
        ("bone", Parts { bone: true, nail: false }),
        ("bone and nail", Parts { bone: true, nail: true }),
    ] {
        let record = press(parts)?;
        let c = &record.checks;
        let ratio = norm(record.force_n) / rigid;
        rows.push(Check::at_most(
            format!("coarse, 1 mm, elastic {name}: force over the rigid one's"),
            ratio,
            1.0,
            "what gives way carries less",
        ));
        for (what, value, tolerance) in [
            ("plate against supports", c.plate_vs_support_reaction, 1e-5),
            ("energy against work", c.energy_vs_work, 0.005),
            ("residual over forces", c.residual_relative, 1e-6),
        ] {
            let quantity = format!("coarse, 1 mm, elastic {name}: {what}");
            rows.push(Check::vanishes(quantity, value, tolerance, "equilibrium"));
        }
    }
    Ok(rows)
}
