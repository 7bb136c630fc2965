//! What another set of constants does to the maps that networks are taught.

use crate::people::PeopleError;
use crate::people::press::{Cells, Press, Tissues};
use papilla_fem::solve::Options;
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::body::SimulationError;
use papilla_fingertip::simulation::record::relative_l2;
use papilla_sdf::{IndenterSpec, Sphere};
use papilla_validation::part;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Forces that are held, N.
const FORCES_N: [f64; 2] = [0.5, 2.0];
/// Radius of the ball, mm.
const BALL_MM: f64 = 5.0;
/// What a set does to one pair of maps, against another set at the same force.
#[derive(Clone, Debug, Serialize)]
pub struct MapChange {
    /// Indenter.
    pub indenter: String,
    /// Force, N.
    pub force_n: f64,
    /// Depth with the first set and with the second, mm.
    pub depth_mm: [f64; 2],
    /// Relative L2 difference of pressure over the skin's vertices.
    pub pressure_l2: f64,
    /// Change of the greatest pressure over the greatest pressure.
    pub pressure_peak: f64,
    /// The same of SED at the interface, dermis' side.
    pub sed_l2: f64,
    /// The same of SED.
    pub sed_peak: f64,
}

/// Maps at [`FORCES_N`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Maps {
    /// What they were solved from.
    fingerprint: String,
    depth_mm: Vec<f64>,
    pressure_mpa: Vec<Vec<f64>>,
    sed_mpa: Vec<Vec<f64>>,
}

/// Plate and ball, with both sets.
pub(crate) fn changes(
    sets: [&Tissues; 2],
    folder: &Path,
    told: &mut dyn FnMut(&str),
) -> Result<Vec<MapChange>, PeopleError> {
    let mut changes = Vec::new();
    for name in ["plate", "ball"] {
        let mut found = Vec::with_capacity(sets.len());
        for set in sets {
            told(&format!("maps of a {name}"));
            found.push(Maps::found_or_solved(name, set, folder)?);
        }
        let [a, b] = &found[..] else { continue };
        let peak = |v: &[f64]| v.iter().copied().fold(0.0, f64::max);
        for (k, force_n) in FORCES_N.into_iter().enumerate() {
            let ([p, q], [s, t]) =
                ([&a.pressure_mpa[k], &b.pressure_mpa[k]], [&a.sed_mpa[k], &b.sed_mpa[k]]);
            changes.push(MapChange {
                indenter: name.into(),
                force_n,
                depth_mm: [a.depth_mm[k], b.depth_mm[k]],
                pressure_l2: relative_l2(q, p),
                pressure_peak: peak(q) / peak(p) - 1.0,
                sed_l2: relative_l2(t, s),
                sed_peak: peak(t) / peak(s) - 1.0,
            });
        }
    }
    Ok(changes)
}

impl Maps {
    fn found_or_solved(name: &str, set: &Tissues, folder: &Path) -> Result<Self, PeopleError> {
        let mut press = Press::plate(0.0, set.clone());
        if name == "ball" {
            press.indenter = IndenterSpec::Sphere(Sphere { radius_mm: BALL_MM });
        }
        let mut scene = press.scene(Cells::COARSE, 1.0);
        scene.motion.depth_mm = None;
        scene.motion.force_n = Some(FORCES_N[1]);
        scene.motion.increments = (FORCES_N[1] / FORCES_N[0]) as usize;
        let fingerprint = part::fingerprint(&(&scene, env!("CARGO_PKG_VERSION")))?;
        let path = folder.join(format!("maps-{name}-{}.json", &fingerprint[..8]));
        let found: Option<Self> = part::read_json(&path)?;
        if let Some(found) = found.filter(|f| f.fingerprint == fingerprint) {
            return Ok(found);
        }
        let failed =
            |e: SimulationError| PeopleError::Press { press: name.into(), source: e.into() };
        let mut maps = Self { fingerprint, ..Self::default() };
        let setup = Simulation::new(&scene).map_err(failed)?;
        let last = scene.motion.increments - 1;
        let mut solver = setup.body.solver(Options::default()).map_err(failed)?;
        let mut count = 0;
        let press =
            setup.body.press(&mut solver, &setup.approach, &setup.drive, 1, &mut |_, record, _| {
                if count == 0 || count == last {
                    maps.depth_mm.push(record.depth_mm);
                    maps.pressure_mpa.push(record.pressure_mpa.clone());
                    maps.sed_mpa.push(record.sed_dermis_mpa.clone());
                }
                count += 1;
            });
        press.map_err(failed)?;
        papilla_output::atomic::write_json(&path, &maps)?;
        Ok(maps)
    }
}
