//! What each effect of a scene changes and what it costs: the scene solved with each
//! effect switched off, or on, in turn.

use papilla_atlas::PA_PER_MPA;
use papilla_fem::solve::{Effort, Options};
use papilla_fingertip::forecast::census;
use papilla_fingertip::scene::effects::EFFECTS;
use papilla_fingertip::scene::{EffectName, Scene, SceneError};
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::body::SimulationError;
use papilla_fingertip::simulation::maps::{FingerMaps, MapError};
use papilla_fingertip::simulation::record::relative_l2;
use papilla_processor::thread_s;
use papilla_vector::norm;
use serde::Serialize;

/// Why a study cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum EffectStudyError {
    /// The scene itself cannot be solved.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// Its states have no maps.
    #[error(transparent)]
    Maps(#[from] MapError),
}

/// The last stored state of one solve, and its price.
#[derive(Clone, Debug, Serialize)]
pub struct Solved {
    /// Unknowns.
    pub unknowns: usize,
    /// Processor time of mesh, symbolic factorization and set-up, s.
    pub setup_s: f64,
    /// Processor time of the indentation, s.
    pub solve_s: f64,
    /// Iterations and the like.
    pub effort: Effort,
    /// Force on the body at the last state, N (plane sections: N per mm of length).
    pub force_n: f64,
    /// Greatest pressure, Pa.
    pub pressure_pa_max: f64,
    /// Greatest SED on the dermis side of the interface, J/m3.
    pub sed_j_per_m3_max: f64,
    /// Pressure and SED: the pixels of their maps, or values at the skin's nodes of a body without
    /// an atlas.
    #[serde(skip)]
    fields: [Vec<f64>; 2],
}

/// What switching an effect does to the last state, relative to the scene as
/// it stands.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Change {
    /// Relative L2 difference of SED over the pixels of its map; of a body without an atlas over the
    /// interface's nodes.
    pub sed_l2: f64,
    /// Change of the greatest SED over the greatest SED.
    pub sed_peak: f64,
    /// The same of pressure.
    pub pressure_l2: f64,
    /// Change of the greatest pressure over the greatest pressure.
    pub pressure_peak: f64,
    /// Change of force over force.
    pub force: f64,
}

/// What became of one switch.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Solved.
    Solved {
        /// The variant.
        state: Box<Solved>,
        /// Against the scene as it stands; absent where the body's nodes differ.
        change: Option<Change>,
    },
    /// The scene cannot be without it, or have it.
    Refused(String),
    /// The variant found no equilibrium.
    Failed(String),
}

/// One effect switched.
#[derive(Clone, Debug, Serialize)]
pub struct Switched {
    /// The effect.
    pub effect: &'static str,
    /// Whether the scene names it, so that it was switched off.
    pub named: bool,
    /// Effects that had to be switched with it.
    pub along: Vec<&'static str>,
    /// What came of it.
    pub outcome: Outcome,
}

/// The scene as it stands and with each effect switched.
#[derive(Clone, Debug, Serialize)]
pub struct Study {
    /// Effects that the scene names.
    pub effects: Vec<EffectName>,
    /// The scene as it stands.
    pub base: Solved,
    /// One entry an effect that was asked for, in the order of the table of effects.
    pub switched: Vec<Switched>,
}

/// A scene whose path over time is taken in another time, as fast or slow all along.
///
/// # Errors
/// [`SceneError`] for one without a path.
pub fn taken_in(scene: &Scene, seconds: f64) -> Result<Scene, SceneError> {
    let mut taken = scene.clone();
    let Some(path) = &mut taken.motion.path else {
        let rule = "a depth or force has no time to be taken in: give motion.path in its place, such as \
                    path = [{ time_s = 1.0, depth_mm = 1.0 }]";
        return Err(SceneError::Fields { field: "motion", rule }.at(scene));
    };
    let end_s = path.last().map_or(1.0, |p| p.time_s);
    path.iter_mut().for_each(|p| p.time_s *= seconds / end_s);
    taken.validate()?;
    Ok(taken)
}

/// Solves `scene` and its variants, those of the effects `only` or of all if that is empty; `visit`
/// is told of each before.
///
/// # Errors
/// [`EffectStudyError`] if the scene itself cannot be solved; variants report theirs in
/// [`Outcome`].
pub fn run(
    scene: &Scene,
    only: &[EffectName],
    visit: &mut dyn FnMut(&str),
) -> Result<Study, EffectStudyError> {
    visit("as it stands");
    let base = solve(scene)?;
    let mut switched = Vec::new();
    let wanted = |name: &str| only.is_empty() || only.iter().any(|o| o.as_str() == name);
    for effect in EFFECTS.into_iter().filter(|e| wanted(e.name)) {
        let named = scene.has(effect.name);
        visit(effect.name);
        let (variant, along) = switch(scene, effect.name, named);
        let outcome = match variant.validate() {
            Err(why) => Outcome::Refused(why.to_string()),
            Ok(()) => match solve(&variant) {
                Err(why) => Outcome::Failed(why.to_string()),
                Ok(state) => {
                    let change = change(&base, &state);
                    Outcome::Solved { state: Box::new(state), change }
                }
            },
        };
        switched.push(Switched { effect: effect.name, named, along, outcome });
    }
    Ok(Study { effects: scene.effects.clone(), base, switched })
}

/// The scene with one effect off (and those that need it), or on (and those
/// that it needs).
fn switch(scene: &Scene, effect: &'static str, named: bool) -> (Scene, Vec<&'static str>) {
    let mut names: Vec<_> = scene.effects.iter().map(EffectName::as_str).collect();
    let mut along = Vec::new();
    if named {
        names.retain(|n| *n != effect);
        while let Some(orphan) = EFFECTS
            .iter()
            .find(|e| names.contains(&e.name) && e.needs.iter().any(|n| !names.contains(n)))
        {
            names.retain(|n| *n != orphan.name);
            along.push(orphan.name);
        }
    } else {
        names.push(effect);
        while let Some(missing) = EFFECTS
            .iter()
            .filter(|e| names.contains(&e.name))
            .flat_map(|e| e.needs)
            .find(|n| !names.contains(n))
        {
            names.push(missing);
            along.push(missing);
        }
    }
    let effects = names.into_iter().filter_map(EffectName::named).collect();
    (Scene { effects, ..scene.clone() }, along)
}

fn solve(scene: &Scene) -> Result<Solved, EffectStudyError> {
    let begun_s = thread_s();
    let mut setup = Simulation::new(scene)?;
    let maps = FingerMaps::new(&mut setup.body)?;
    let mut solver = setup.body.solver(Options::default())?;
    let ready_s = thread_s();
    let (mut effort, mut last) = (Effort::default(), None);
    setup.body.press(&mut solver, &setup.approach, &setup.drive, 1, &mut |_, record, report| {
        effort = effort.plus(&report.effort);
        last = Some(record.clone());
    })?;
    let solve_s = thread_s() - ready_s;
    let last = last.ok_or(SimulationError::Empty)?;
    let fields = match &maps {
        Some(maps) => maps.pressure_and_sed(&last)?,
        None => [last.pressure_mpa.clone(), last.sed_dermis_mpa.clone()],
    };
    Ok(Solved {
        unknowns: census(scene, &setup).unknowns,
        setup_s: ready_s - begun_s,
        solve_s,
        effort,
        force_n: norm(last.force_n),
        pressure_pa_max: PA_PER_MPA * max(&last.pressure_mpa),
        sed_j_per_m3_max: PA_PER_MPA * max(&last.sed_dermis_mpa),
        fields,
    })
}

fn max(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

fn change(base: &Solved, other: &Solved) -> Option<Change> {
    let ([pressure_a, sed_a], [pressure_b, sed_b]) = (&base.fields, &other.fields);
    let same = pressure_a.len() == pressure_b.len() && sed_a.len() == sed_b.len();
    same.then(|| Change {
        sed_l2: relative_l2(sed_b, sed_a),
        sed_peak: other.sed_j_per_m3_max / base.sed_j_per_m3_max - 1.0,
        pressure_l2: relative_l2(pressure_b, pressure_a),
        pressure_peak: other.pressure_pa_max / base.pressure_pa_max - 1.0,
        force: other.force_n / base.force_n - 1.0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(effects: &str) -> Scene {
        let text = format!(
            "effects = {effects}\n[geometry]\nkind = \"block\"\nsize_mm = [4.0, 4.0]\n\
             elements = [3, 3]\nlayers = [{{ tissue = \"dermis\", thickness_mm = 2.0, elements = 2 }}]\n\
             [friction]\ncoefficient = 0.4\n\
             [indenter]\nshape = \"sphere\"\nradius_mm = 3.0\n\
             [motion]\ndepth_mm = 0.2\nincrements = 2\n"
        );
        toml::from_str(&text).unwrap()
    }

    #[test]
    fn switching_takes_along_what_cannot_stay() {
        let names = |s: &Scene| s.effects.iter().map(EffectName::as_str).collect::<Vec<_>>();
        let all = scene("[\"finite_strain\", \"hyperelastic\", \"layers\"]");
        let (off, along) = switch(&all, "finite_strain", true);
        assert_eq!((names(&off), along), (vec!["layers"], vec!["hyperelastic"]));
        let none = scene("[]");
        let (on, along) = switch(&none, "hyperelastic", false);
        assert_eq!(
            (names(&on), along),
            (vec!["hyperelastic", "finite_strain"], vec!["finite_strain"])
        );
    }

    #[test]
    fn a_path_is_taken_in_another_time_and_a_depth_is_not() {
        let mut still = scene("[]");
        assert!(matches!(taken_in(&still, 5.0), Err(SceneError::Fields { field: "motion", .. })));
        still.motion.depth_mm = None;
        let point = |time_s| papilla_fingertip::scene::PathPoint {
            time_s,
            depth_mm: 0.2,
            shift_mm: [0.0; 2],
        };
        still.motion.path = Some(vec![point(1.0), point(4.0)]);
        let path = taken_in(&still, 8.0).unwrap().motion.path.unwrap();
        assert_eq!([path[0].time_s, path[1].time_s], [2.0, 8.0]);
        assert!(taken_in(&still, -1.0).is_err());
    }

    #[test]
    fn every_effect_gets_a_row_and_friction_changes_the_force() {
        let study = run(&scene("[\"finite_strain\", \"layers\"]"), &[], &mut |_| {}).unwrap();
        assert_eq!(study.switched.len(), EFFECTS.len());
        let of = |name: &str| &study.switched.iter().find(|s| s.effect == name).unwrap().outcome;
        let Outcome::Solved { change: Some(change), .. } = of("friction") else {
            panic!("friction was not solved")
        };
        assert!(change.force > 1e-3, "friction stiffens a sphere's contact: {}", change.force);
        assert!(matches!(of("viscoelastic"), Outcome::Refused(why) if why.contains("motion.path")));
        assert!(matches!(of("finite_strain"), Outcome::Solved { .. }));
    }
}
