//! Paths refined, and indentations stopped and gone on with.

use super::*;
use crate::scene::Scene;
use crate::simulation::Simulation;
use papilla_fem::solve::Options;

#[test]
fn a_path_is_refined_by_as_much_as_it_misses() {
    for (excess, first) in [(1.1, 2), (3.9, 2), (4.1, 4), (51.4, 8), (1e9, 16)] {
        assert_eq!(path_refinements(excess)[0], first, "{excess}");
    }
    assert_eq!(path_refinements(5.0), [4, 8, 16]);
    assert_eq!(path_refinements(f64::NAN), [2, 4, 8, 16]);
}

const SCENE: &str = "[geometry]\nkind = \"block\"\nsize_mm = [6.0, 6.0]\nelements = [4, 4]\n\
    layers = [{ tissue = \"dermis\", thickness_mm = 2.0, elements = 2 }]\n\
    [indenter]\nshape = \"sphere\"\nradius_mm = 4.0\n[motion]\ndepth_mm = 0.3\nincrements = 2\n";

/// What a dataset keeps of a state, to the bit.
fn bits(r: &IncrementRecord, pressure_mpa: &[f64]) -> Vec<u64> {
    let checks = [r.checks.energy_vs_work, r.checks.residual_relative, r.checks.j_min];
    let counts = [r.checks.newton_iterations, r.checks.factorizations, r.checks.cg_iterations];
    let values = r.force_n.iter().chain(&checks).chain(pressure_mpa);
    values.map(|v| v.to_bits()).chain(counts.map(u64::from)).collect()
}

/// Presses from where `from` stood, in a process of its own as it were, until `until` depths
/// were stored; no path balances to 1e-12, so every way is taken.
fn press(from: Option<&[u8]>, until: usize) -> (Balanced<Vec<u64>>, Option<Vec<u8>>) {
    let scene = Scene::parse("scene.toml".as_ref(), SCENE.into()).unwrap();
    let Simulation { body, approach, drive, .. } = Simulation::new(&scene).unwrap();
    let mut solver = body.solver(Options::default()).unwrap();
    let surface = &body.problem.mesh.surfaces[&body.contact];
    let keep = &mut |_: usize, s: &Solver<'_>, r: &IncrementRecord, _: &StepReport| {
        bits(r, &s.pressure_mpa(surface))
    };
    let from = from.map(|bytes| postcard::from_bytes(bytes).unwrap());
    let (mut stored, mut left) = (None, until);
    let at_state = &mut |at: &AtState<'_, Vec<u64>>| {
        if left > 0 {
            left -= 1;
            return ControlFlow::Continue(());
        }
        stored = Some(postcard::to_stdvec(&at.standing()).unwrap());
        ControlFlow::Break(())
    };
    let stoppable = Stoppable { from, at_state };
    let limit = 1e-12;
    (body.press_stoppable(&mut solver, &approach, &drive, limit, keep, stoppable), stored)
}

/// Stopped at each of its states on each of its ways, and gone on with by another solver, an
/// indentation ends in the same bits.
#[test]
fn a_stopped_indentation_goes_on_to_the_same_bits() {
    let (whole, stored) = press(None, usize::MAX);
    whole.pressed.unwrap();
    assert!(stored.is_none() && whole.kept.len() == 2);
    assert!(whole.attempts.len() >= 3, "{:?}", whole.attempts);
    for until in 0..2 * whole.attempts.len() {
        let (stopped, stored) = press(None, until);
        assert!(matches!(stopped.pressed, Err(SimulationError::Halted)), "{until}");
        // Once more in between: what was gone on with can be stopped again.
        let (next, again) = press(stored.as_deref(), 0);
        let end = match again {
            Some(again) => press(Some(&again), usize::MAX).0,
            None => next,
        };
        end.pressed.unwrap();
        assert!(end.kept == whole.kept, "stopped at {until}");
        assert_eq!(end.attempts, whole.attempts);
    }
}

#[test]
fn the_state_of_another_mesh_is_refused() {
    let (_, stored) = press(None, 0);
    let standing: Standing<Vec<u64>> = postcard::from_bytes(&stored.unwrap()).unwrap();
    let text = SCENE.replace("[4, 4]", "[3, 3]");
    let scene = Scene::parse("scene.toml".as_ref(), text).unwrap();
    let Simulation { body, approach, drive, .. } = Simulation::new(&scene).unwrap();
    let mut solver = body.solver(Options::default()).unwrap();
    let keep = &mut |_: usize, _: &Solver<'_>, _: &IncrementRecord, _: &StepReport| Vec::new();
    let at_state = &mut |_: &AtState<'_, Vec<u64>>| ControlFlow::Continue(());
    let stoppable = Stoppable { from: Some(standing), at_state };
    let limit = 5e-3;
    let found = body.press_stoppable(&mut solver, &approach, &drive, limit, keep, stoppable);
    assert!(matches!(found.pressed, Err(SimulationError::Snapshot(_))));
}
