//! Gaps in place of objects.

use crate::support::{SIDE, ball, small_strain, solver, vertex};
use papilla_contact::{ContactError, Gaps, NetForce, Object};

pub(crate) fn depths(object: &Object) -> Vec<f32> {
    let depth = |i: usize| {
        let [x, y] = vertex(i);
        -object.placement.distance(object.shape.as_ref(), [x, y, 0.0]).gap_mm as f32
    };
    (0..SIDE * SIDE).map(depth).collect()
}

#[test]
fn gaps_press_as_the_object_does() {
    for (radius, at, depth) in [(10.0, [0.0, 0.0], 0.05), (6.0, [0.3, -0.2], 0.08)] {
        let object = ball(radius, at, depth);
        let (mut by_object, mut due) = solver(small_strain());
        by_object.solve(std::slice::from_ref(&object), &mut due).expect("an answer");
        let (mut by_gaps, mut out) = solver(small_strain());
        by_gaps.solve(Gaps::rigid(&depths(&object)), &mut out).expect("an answer");
        let miss: f32 =
            out.pressure_pa.iter().zip(&due.pressure_pa).map(|(a, b)| (a - b).powi(2)).sum();
        let size: f32 = due.pressure_pa.iter().map(|p| p * p).sum();
        assert!(miss < 1e-3 * size, "{miss} of {size}");
        assert!((out.force_n[2] / due.force_n[2] - 1.0).abs() < 0.01, "{:?}", out.force_n);
        assert!(out.quality.settled && out.effort.distances > 0);
    }
}

#[test]
fn gaps_meet_a_force_and_air_is_air() {
    let (mut solver, mut out) = solver(small_strain());
    let far = depths(&ball(10.0, [0.0; 2], -5.0));
    solver.solve(Gaps::rigid(&far), &mut out).expect("an answer");
    assert!(out.touched().is_empty() && out.effort.iterations == 0);
    let net = NetForce { direction: [0.0, 0.0, 1.0], force_n: 0.006 };
    let near = depths(&ball(10.0, [0.0; 2], -0.01));
    solver.solve_for_force(Gaps::rigid(&near), net, &mut out).expect("a travel");
    assert!((out.force_n[2] / 0.006 - 1.0).abs() < 3e-3, "{}", out.force_n[2]);
}

#[test]
fn what_is_no_gap_is_named() {
    let (mut solver, mut out) = solver(small_strain());
    let mut depth_mm = depths(&ball(10.0, [0.0; 2], 0.05));
    depth_mm[7] = f32::NAN;
    let error = solver.solve(Gaps::rigid(&depth_mm), &mut out).expect_err("refused");
    assert!(error.to_string().contains("depth_mm[7]"), "{error}");
    let few = solver.solve(Gaps::rigid(&depth_mm[..5]), &mut out).expect_err("refused");
    assert_eq!(few, ContactError::Gaps { found: 5, expected: SIDE * SIDE });
    depth_mm[7] = -1.0;
    let limp = Gaps { stiffness_mpa_per_mm: 0.0, ..Gaps::rigid(&depth_mm) };
    assert!(solver.solve(limp, &mut out).expect_err("refused").to_string().contains("stiffness"));
    solver.solve(Gaps::rigid(&depth_mm), &mut out).expect("the solver lives on");
}
