//! A tap: down and up again, with tissues that relax.

use crate::people::PeopleError;
use crate::people::press::Subject;
use papilla_fem::solve::Options;
use papilla_fingertip::mesh::fingertip::{Density, Order};
use papilla_fingertip::scene::{EffectName, Geometry, PathPoint, Scene, TissueTable};
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::body::SimulationError;
use papilla_processor::thread_s;
use papilla_validation::stored;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Stored states each way.
const STATES: usize = 10;

/// What a tap does.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Tap {
    /// What it was solved from.
    fingerprint: String,
    /// Share of its work that the finger keeps, %.
    pub lost_percent: f64,
    /// Largest force, N.
    pub force_n_max: f64,
    /// Processor time, s.
    pub solve_s: f64,
}

impl Tap {
    /// From `folder`, or solved and written there: with a plate, `time_s` down to `depth_mm` and
    /// `time_s` up, on the even coarse mesh; the tissues relax if `relaxes`.
    pub(crate) fn found_or_solved(
        subject: &Subject,
        relaxes: bool,
        depth_mm: f64,
        time_s: f64,
        folder: &Path,
    ) -> Result<Self, PeopleError> {
        let scene = scene(subject, relaxes, depth_mm, time_s);
        let fingerprint = stored::fingerprint(&(&scene, env!("CARGO_PKG_VERSION")))?;
        let path = folder.join(format!("tap-{}.json", &fingerprint[..8]));
        let found: Option<Self> = stored::read_json(&path)?;
        if let Some(found) = found.filter(|f| f.fingerprint == fingerprint) {
            return Ok(found);
        }
        let failed =
            |e: SimulationError| PeopleError::Press { press: "tap".into(), source: e.into() };
        let tap = Self { fingerprint, ..solved(&scene).map_err(failed)? };
        papilla_output::atomic::write_json(&path, &tap)?;
        Ok(tap)
    }
}

fn scene(subject: &Subject, relaxes: bool, depth_mm: f64, time_s: f64) -> Scene {
    let geometry = Geometry::Fingertip {
        density: Density::Coarse,
        order: Order::Linear,
        shape: subject.shape.clone(),
        finger: None,
    };
    let (effects, materials) = (subject.effects(), subject.table.clone());
    let mut scene = Scene { geometry, effects, materials, ..Scene::usual() };
    if relaxes {
        scene.effects.extend(EffectName::named("viscoelastic"));
    }
    let point = |time_s, depth_mm| PathPoint { time_s, depth_mm, shift_mm: [0.0; 2] };
    scene.motion.depth_mm = None;
    scene.motion.path = Some(vec![point(time_s, depth_mm), point(2.0 * time_s, 0.0)]);
    scene.motion.increments = STATES;
    scene
}

fn solved(scene: &Scene) -> Result<Tap, SimulationError> {
    let begun_s = thread_s();
    let setup = Simulation::new(scene)?;
    let mut solver = setup.body.solver(Options::default())?;
    let (mut most_mj, mut last_mj, mut force_n_max) = (0.0f64, 0.0, 0.0f64);
    setup.body.press(&mut solver, &setup.approach, &setup.drive, 1, &mut |solver, record, _| {
        last_mj = solver.indenter_work_mj();
        most_mj = most_mj.max(last_mj);
        force_n_max = force_n_max.max(record.force_n[2]);
    })?;
    let lost_percent = 100.0 * last_mj / most_mj;
    let solve_s = thread_s() - begun_s;
    Ok(Tap { lost_percent, force_n_max, solve_s, ..Tap::default() })
}

/// Relaxation times of the tissues' series, s, rising.
pub(crate) fn relaxation_times_s(table: &TissueTable) -> Vec<f64> {
    let tissues = [&table.epidermis, &table.dermis, &table.subcutaneous];
    let series = tissues.into_iter().filter_map(|t| t.prony.as_ref());
    let mut times: Vec<f64> = series.flat_map(|p| p.time_s.iter().copied()).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    times
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::people::press::Materials;

    #[test]
    #[ignore = "long"]
    fn what_does_not_relax_gives_its_work_back() {
        let folder = tempfile::tempdir().unwrap();
        let tap = |relaxes, time_s| {
            let subject = Materials::NeoHookean.subject();
            Tap::found_or_solved(&subject, relaxes, 1.0, time_s, folder.path()).unwrap()
        };
        let taps = [tap(false, 0.05), tap(true, 0.2)];
        let [elastic, relaxing] = [0, 1].map(|i: usize| taps[i].lost_percent);
        let force_n = [0, 1].map(|i: usize| taps[i].force_n_max);
        assert!(elastic.abs() < 1.5, "{elastic}");
        assert!(relaxing > 3.0 && relaxing < 100.0, "{relaxing}");
        assert!(force_n.iter().all(|f| (0.05..5.0).contains(f)), "{force_n:?}");
    }

    #[test]
    fn times_are_those_of_both_series() {
        assert_eq!(relaxation_times_s(&TissueTable::default()), [0.2136, 0.3834, 4.6731, 8.854]);
    }
}
