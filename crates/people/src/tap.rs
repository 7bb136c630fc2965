//! A tap: down and up again, with tissues that relax.

use crate::PeopleError;
use crate::press::Materials;
use papilla_fem::solve::Options;
use papilla_fingertip::scene::{EffectName, PathPoint, Scene, TissueTable};
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::body::SimulationError;

/// Stored states each way.
const STATES: usize = 10;

/// Share of a tap's work that the finger keeps, %: with a plate, `time_s` down to `depth_mm` and
/// `time_s` up, on the even coarse mesh.
pub(crate) fn energy_lost_percent(
    materials: Materials,
    relaxes: bool,
    depth_mm: f64,
    time_s: f64,
) -> Result<f64, PeopleError> {
    let failed = |e: SimulationError| PeopleError::Press { press: "tap".into(), source: e.into() };
    let mut scene = Scene { effects: materials.effects(), ..Scene::usual() };
    if relaxes {
        scene.effects.extend(EffectName::named("viscoelastic"));
    }
    let point = |time_s, depth_mm| PathPoint { time_s, depth_mm, shift_mm: [0.0; 2] };
    scene.motion.depth_mm = None;
    scene.motion.path = Some(vec![point(time_s, depth_mm), point(2.0 * time_s, 0.0)]);
    scene.motion.increments = STATES;
    let setup = Simulation::new(&scene).map_err(failed)?;
    let mut solver = setup.body.solver(Options::default()).map_err(failed)?;
    let (mut most_mj, mut last_mj) = (0.0f64, 0.0);
    setup
        .body
        .press(&mut solver, &setup.approach, &setup.drive, 1, &mut |solver, _, _| {
            last_mj = solver.indenter_work_mj();
            most_mj = most_mj.max(last_mj);
        })
        .map_err(failed)?;
    Ok(100.0 * last_mj / most_mj)
}

/// Relaxation times of the tissues' series, s, rising.
pub(crate) fn relaxation_times_s() -> Vec<f64> {
    let table = TissueTable::default();
    let tissues = [&table.epidermis, &table.dermis, &table.subcutaneous];
    let series = tissues.into_iter().filter_map(|t| t.prony.as_ref());
    let mut times: Vec<f64> = series.flat_map(|p| p.time_s.iter().copied()).collect();
    times.sort_by(f64::total_cmp);
    times
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[ignore = "long"]
    fn what_does_not_relax_gives_its_work_back() {
        let elastic = energy_lost_percent(Materials::NeoHookean, false, 1.0, 0.05).unwrap();
        let relaxing = energy_lost_percent(Materials::NeoHookean, true, 1.0, 0.2).unwrap();
        assert!(elastic.abs() < 1.5, "{elastic}");
        assert!(relaxing > 3.0 && relaxing < 100.0, "{relaxing}");
    }

    #[test]
    fn times_are_those_of_both_series() {
        assert_eq!(relaxation_times_s(), [0.2136, 0.3834, 4.6731, 8.854]);
    }
}
