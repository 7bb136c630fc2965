//! Equilibria sought from a guess.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

use papilla_fem::element::ElementKind;
use papilla_fem::solve::{Guess, Options, Solver};
use papilla_fem::testing::squeezed_block;

/// From a displacement nearby, the equilibrium is that of the path. From a turned one, where tangent
/// after tangent is indefinite, and from elements inside out the search is given up, and the body
/// stays as it was.
#[test]
fn a_guess_leads_to_the_equilibrium_of_the_path() {
    let (problem, loading, _) = squeezed_block(ElementKind::Hex8, 3, 0.48).unwrap();
    let tight = Options { residual_tolerance: 1e-9, gap_tolerance_mm: 1e-7, ..Options::default() };
    let mut guide = Solver::new(&problem, tight).unwrap();
    guide.start(loading.clone());
    for step in 1..=4 {
        guide.advance_to(0.25 * f64::from(step)).unwrap();
    }
    let due = guide.displacement_mm().to_vec();
    let near: Vec<_> = due.iter().map(|u| u.map(|v| 0.97 * v)).collect();
    let mut folded = due.clone();
    folded.reverse();
    let inverted: Vec<_> = due.iter().map(|u| u.map(|v| -1e3 * v)).collect();
    for (guess, leads) in [(near, true), (folded, false), (inverted, false)] {
        let mut solver = Solver::new(&problem, tight).unwrap();
        solver.start(loading.clone());
        let guess = Guess { displacement_mm: guess, dilatation: Vec::new() };
        match solver.advance_from(1.0, guess) {
            Ok(report) => assert!(leads && report.effort.steps == 1, "{report:?}"),
            Err(effort) => {
                assert!(!leads && effort.cuts == 1, "{effort:?}");
                assert!(solver.displacement_mm().as_flattened().iter().all(|v| v.abs() <= 0.0));
                solver.advance_to(1.0).unwrap();
            }
        }
        let largest = due.as_flattened().iter().fold(0.0f64, |m, v| m.max(v.abs()));
        for (found, due) in solver.displacement_mm().as_flattened().iter().zip(due.as_flattened()) {
            assert!((found - due).abs() < 1e-5 * largest, "{found} {due}");
        }
    }
}
