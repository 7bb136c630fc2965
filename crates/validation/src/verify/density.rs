//! What refining the mesh still changes in a flat indentation.

use super::{CaseError, Check, Context};
use papilla_fem::mesh::nearest::NearestPoints;
use papilla_fem::solve::Options;
use papilla_fingertip::mesh::fingertip::Density;
use papilla_fingertip::scene::Pose;
use papilla_fingertip::simulation::body::Body;
use papilla_fingertip::simulation::drive::{Approach, Drive};
use papilla_fingertip::simulation::record::{IncrementRecord, relative_l2};

const SOURCE: &str = "coarse against medium: changes fall as elements shrink";
const DEPTH_MM: f64 = 1.0;
/// What is compared.
const QUANTITIES: [&str; 4] = ["force", "pressure", "SED, dermis side", "SED, epidermis side"];

pub(super) fn run(_: &Context) -> Result<Vec<Check>, CaseError> {
    let [coarse, medium, fine] = [Density::Coarse, Density::Medium, Density::Fine].map(press);
    let (coarse, medium, fine) = (coarse?, medium?, fine?);
    let changes = medium.changes_to(&fine).into_iter().zip(coarse.changes_to(&medium));
    let row = |(what, (change, before)): (&str, (f64, f64))| {
        let quantity = format!("medium against fine, 1 mm: {what}, relative change");
        Check::at_most(quantity, change, before, SOURCE)
    };
    Ok(QUANTITIES.into_iter().zip(changes).map(row).collect())
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

    /// Relative differences of [`QUANTITIES`] from those of a finer mesh.
    fn changes_to(&self, finer: &Self) -> [f64; 4] {
        let (a, b) = (&self.record, &finer.record);
        let read = |values: &[f64], points| self.read(finer, values, points);
        [
            (self.force_n() / finer.force_n() - 1.0).abs(),
            relative_l2(&a.pressure_mpa, &read(&b.pressure_mpa, |p| &p.skin)),
            relative_l2(&a.sed_dermis_mpa, &read(&b.sed_dermis_mpa, |p| &p.interface)),
            relative_l2(&a.sed_epidermis_mpa, &read(&b.sed_epidermis_mpa, |p| &p.interface)),
        ]
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
        record: last.ok_or("no state was recorded")?,
        skin: at(&patch.skin),
        interface: at(&patch.interface),
        triangles: patch.triangles.clone(),
    })
}
