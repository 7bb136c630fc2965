//! How far each mesh is from the fine one: the discretisation error of an indentation.

use super::{CaseError, Check, Context};
use papilla_fem::mesh::nearest::NearestPoints;
use papilla_fem::solve::Options;
use papilla_fingertip::mesh::fingertip::Density;
use papilla_fingertip::scene::Pose;
use papilla_fingertip::simulation::body::Body;
use papilla_fingertip::simulation::drive::{Approach, Drive};
use papilla_fingertip::simulation::record::{IncrementRecord, relative_l2};

const SOURCE: &str = "the same press on the next finer mesh";
const DEPTH_MM: f64 = 1.0;

/// Largest differences accepted: force, pressure, SED of both sides.
type Accepted = [f64; 4];

pub(super) fn run(_: &Context) -> Result<Vec<Check>, CaseError> {
    let pairs: [(Density, Density, Accepted); 2] = [
        (Density::Coarse, Density::Medium, [0.03, 0.25, 0.25, 0.35]),
        (Density::Medium, Density::Fine, [0.02, 0.12, 0.12, 0.15]),
    ];
    let mut rows = Vec::new();
    for (coarse, fine, accepted) in pairs {
        rows.extend(compare(coarse, fine, accepted)?);
    }
    Ok(rows)
}

fn compare(coarse: Density, fine: Density, accepted: Accepted) -> Result<Vec<Check>, CaseError> {
    let (a, b) = (press(coarse)?, press(fine)?);
    let relative = |get: fn(&Pressed) -> &[f64], points: fn(&Pressed) -> &[[f64; 3]]| {
        relative_l2(get(&a), &a.read(&b, get(&b), points))
    };
    let name = |what: &str| {
        format!("{coarse:?} against {fine:?}, flat press to 1 mm: {what}").to_lowercase()
    };
    let [force, pressure, dermis, epidermis] = accepted;
    let row = |what: &str, value, tolerance| {
        Check::vanishes(name(&format!("{what}, relative L2")), value, tolerance, SOURCE)
    };
    Ok(vec![
        Check::relative(name("force, N"), a.force_n(), b.force_n(), force, SOURCE),
        row("pressure", relative(|p| &p.record.pressure_mpa, |p| &p.skin), pressure),
        row("sed, dermis side", relative(|p| &p.record.sed_dermis_mpa, |p| &p.interface), dermis),
        row(
            "sed, epidermis side",
            relative(|p| &p.record.sed_epidermis_mpa, |p| &p.interface),
            epidermis,
        ),
    ])
}

/// An indentation and where its values are.
struct Pressed {
    record: IncrementRecord,
    skin: Vec<[f64; 3]>,
    interface: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Pressed {
    fn force_n(&self) -> f64 {
        self.record.force_n[2].abs()
    }

    /// Values of another mesh at this one's points: linear in the triangle whose
    /// plane point is nearest, seen along the finger's own height.
    fn read(&self, other: &Self, values: &[f64], points: fn(&Self) -> &[[f64; 3]]) -> Vec<f64> {
        NearestPoints::new(points(other), &other.triangles, points(self)).read(values)
    }
}

fn press(density: Density) -> Result<Pressed, CaseError> {
    let finger = Body::usual(density)?;
    let mut solver = finger.solver(Options::default())?;
    let (approach, drive) = (Approach::plate(Pose::default()), Drive::Depths(vec![DEPTH_MM]));
    let mut last = None;
    finger.press(&mut solver, &approach, &drive, 1, &mut |_, record, _| {
        last = Some(record.clone());
    })?;
    let patch = &finger.patch.as_ref().ok_or("the fingertip has no patch")?.patch;
    let at = |nodes: &[u32]| nodes.iter().map(|&n| finger.problem.mesh.nodes[n as usize]).collect();
    Ok(Pressed {
        record: last.ok_or("the press gave no record")?,
        skin: at(&patch.skin),
        interface: at(&patch.interface),
        triangles: patch.triangles.clone(),
    })
}
