use super::*;
use crate::scene::effects::EFFECTS;
use crate::simulation::record::IncrementRecord;
use papilla_fem::solve::{Options, Solver, StepReport};
use std::path::Path;

/// A coarse finger pressed so that every effect which it can have is possible.
const FINGER: &str = "[geometry]\nkind = \"fingertip\"\ndensity = \"coarse\"\norder = \"linear\"\n\
    [friction]\ncoefficient = 0.3\n[motion]\n\
    path = [{ time_s = 0.1, depth_mm = 0.05 }]\n";

/// Fluid below the epidermis.
const WATER: &str = "[materials.subcutaneous]\nyoungs_modulus_mpa = 0.034\npoissons_ratio = 0.48\n\
    biphasic = { permeability_mm4_per_n_s = 1e-3, drained_poissons_ratio = 0.2 }\n";

fn finger(effects: &[&str]) -> Scene {
    let named: Vec<_> = effects.iter().map(|e| format!("\"{e}\"")).collect();
    let mut text = format!("effects = [{}]\n{FINGER}", named.join(", "));
    if effects.contains(&"biphasic") {
        text = text.replace("linear", "quadratic") + WATER;
    }
    Scene::parse(Path::new("finger.toml"), text).unwrap()
}

/// Effects that the finger can have: alone or with what they need.
fn possible() -> Vec<Vec<&'static str>> {
    let with_needs = EFFECTS.iter().map(|e| [e.needs, &[e.name]].concat());
    with_needs.filter(|names| !names.contains(&"plane_strain")).collect()
}

#[test]
fn an_effect_that_is_not_named_assembles_and_stores_nothing() {
    for names in std::iter::once(Vec::new()).chain(possible()) {
        let scene = finger(&names);
        let setup = Simulation::new(&scene).unwrap();
        let census = census(&scene, &setup);
        for effect in EFFECTS {
            let (state, on) = ((effect.state)(&census), names.contains(&effect.name));
            assert_eq!(state > 0, on, "{}: {state} {} in {names:?}", effect.name, effect.state_is);
        }
    }
}

/// What the census counts is what the solver holds.
#[test]
fn the_solver_holds_what_the_census_counts() {
    for names in [&[][..], &["viscoelastic"], &["friction"], &["elastic_bone", "nail"]] {
        let scene = finger(names);
        let setup = Simulation::new(&scene).unwrap();
        let census = census(&scene, &setup);
        let body = &setup.body;
        let mut solver = body.solver(Options::default()).unwrap();
        let mut seen = 0;
        let mut visit = |solver: &Solver<'_>, _: &IncrementRecord, _: &StepReport| {
            seen += 1;
            let blocks = body.problem.mesh.blocks.iter().enumerate();
            let history: usize = blocks
                .flat_map(|(b, block)| (0..block.len()).map(move |e| (b, e)))
                .map(|(b, e)| solver.history_of(b, e).len())
                .sum();
            assert_eq!(history, census.history_numbers, "{names:?}");
            assert_eq!(solver.shear_traction_mpa().len(), census.friction_states, "{names:?}");
            assert_eq!(solver.traction_mpa().len(), census.contact_nodes, "{names:?}");
            let free = body.problem.fixed.iter().filter(|fixed| !**fixed).count();
            assert_eq!(free, census.unknowns, "{names:?}");
        };
        body.press(&mut solver, &setup.approach, &setup.drive, 1, &mut visit).unwrap();
        assert_eq!(seen, 1);
    }
}

#[test]
fn an_effect_adds_its_own_state_and_no_other() {
    let count = |names: &[&str]| {
        let scene = finger(names);
        census(&scene, &Simulation::new(&scene).unwrap())
    };
    let bare = count(&[]);
    let friction = count(&["friction"]);
    assert_eq!(Census { friction_states: bare.contact_nodes, ..bare }, friction);
    let strain = count(&["finite_strain"]);
    assert_eq!(Census { finite_strain_points: bare.points, ..bare }, strain);
    let bone = count(&["elastic_bone"]);
    assert!(bone.unknowns > bare.unknowns && bone.history_numbers == 0);
}

#[test]
fn a_forecast_counts_the_factor_and_predicts_something() {
    let scene = finger(&["finite_strain", "layers"]);
    let setup = Simulation::new(&scene).unwrap();
    let forecast = Forecast::new(&scene, &setup);
    // A full lower triangle bounds entries and operations.
    let n = forecast.census.unknowns as f64;
    let (entries, flops) = (forecast.factor_entries as f64, forecast.factor_flops);
    assert!(entries > forecast.census.tangent_entries as f64 && entries < n * n);
    assert!(flops > entries && flops < n.powi(3) / 3.0 + n * n);
    let s = forecast.seconds;
    assert!(s.assembly > 0.0 && s.factorization > 0.0 && s.linear_solves > 0.0);
    assert!(s.total.is_finite());
}

#[test]
fn a_section_counts_its_plane_elements() {
    let text = "effects = [\"plane_strain\"]\n[geometry]\nkind = \"section\"\ndensity = \"coarse\"\n\
                [motion]\ndepth_mm = 0.2\n";
    let scene = Scene::parse(Path::new("section.toml"), text.into()).unwrap();
    let census = census(&scene, &Simulation::new(&scene).unwrap());
    for effect in EFFECTS {
        assert_eq!((effect.state)(&census) > 0, effect.name == "plane_strain", "{}", effect.name);
    }
}
