//! A two-layer block from a Gmsh file under a sphere, against the same block made here.

use super::{CaseError, Check, Context};
use papilla_fem::solve::Options;
use papilla_fingertip::scene::Scene;
use papilla_fingertip::simulation::Simulation;
use std::path::Path;

const SOURCE: &str = "the same elements made by this code";

/// Scene and mesh as shipped in `scenes/`.
const SCENE: &str = include_str!("../../../../scenes/two-layer-sphere.toml");
const MESH: &[u8] = include_bytes!("../../../../scenes/two-layer.msh");

/// The block of two-layer.geo. Its fat lies on top, as the file's does.
const BLOCK: &str = r#"
kind = "block"
size_mm = [8.0, 8.0]
elements = [10, 10]
layers = [
  { tissue = "dermis", thickness_mm = 1.0, elements = 3 },
  { tissue = "subcutaneous", thickness_mm = 3.0, elements = 4 },
]
"#;

pub(super) fn run(_: &Context) -> Result<Vec<Check>, CaseError> {
    let folder = tempfile::tempdir()?;
    std::fs::write(folder.path().join("two-layer.msh"), MESH)?;
    let from_file = press(folder.path(), SCENE)?;
    let mut scene: toml::Table = SCENE.parse()?;
    scene.insert("geometry".into(), toml::Value::Table(BLOCK.parse()?));
    let made = press(folder.path(), &toml::to_string(&scene)?)?;
    let row = |what: &str, i: usize| {
        let quantity = format!("two-layer.msh, sphere 0.8 mm deep: {what}");
        Check::relative(quantity, from_file[i], made[i], 1e-6, SOURCE)
    };
    Ok(vec![row("force, N", 0), row("greatest pressure, MPa", 1), row("stored energy, mJ", 2)])
}

/// Force, greatest pressure and stored energy of the last state.
fn press(folder: &Path, text: &str) -> Result<[f64; 3], CaseError> {
    let scene = Scene::parse(&folder.join("scene.toml"), text.into())?;
    let setup = Simulation::new(&scene)?;
    let options =
        Options { residual_tolerance: 1e-9, gap_tolerance_mm: 1e-7, ..Options::default() };
    let mut solver = setup.body.solver(options)?;
    let surface = &setup.body.problem.mesh.surfaces[&setup.body.contact];
    let mut last = None;
    setup.body.press(&mut solver, &setup.approach, &setup.drive, 1, &mut |s, r, report| {
        let peak = s.pressure_mpa(surface).into_iter().fold(0.0, f64::max);
        last = Some([papilla_vector::norm(r.force_n), peak, report.stored_mj]);
    })?;
    last.ok_or_else(|| "no state was recorded".into())
}
