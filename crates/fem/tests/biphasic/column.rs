//! Terzaghi's column: a layer on an impermeable base, suddenly loaded on its drained top.

use crate::bodies::{Body, K, march, place, rectangle, sudden, times};
use papilla_fem::solve::Loading;

const P0_MPA: f64 = 0.02;
const NU: f64 = 0.2;
const HEIGHT_MM: f64 = 2.0;

/// `T = c t / H^2`, pressure at the base over `p0`, degree of consolidation.
const TABLE: [(f64, f64, f64); 5] = [
    (0.01, 1.000_000, 0.112_838),
    (0.05, 0.996_869, 0.252_313),
    (0.1, 0.949_305, 0.356_823),
    (0.5, 0.370_777, 0.763_950),
    (1.0, 0.107_977, 0.931_260),
];

fn column(cells: usize) -> Body {
    let h = HEIGHT_MM / cells as f64;
    let sides = [true, false, false];
    let held = [("x_min", sides), ("x_max", sides), ("y_min", [false, true, false])];
    Body::new(rectangle([h, HEIGHT_MM], [1, cells]), NU, &held, "y_max")
}

/// Pressure at the base over `p0` and degree of consolidation at each of the times.
fn consolidate(cells: usize, t: &[f64]) -> Vec<[f64; 2]> {
    let body = column(cells);
    let seconds: Vec<f64> = t.iter().map(|t| t * HEIGHT_MM * HEIGHT_MM / body.c()).collect();
    let loading = Loading {
        dead_n: body.pressed("y_max", P0_MPA),
        course: sudden(&seconds),
        ..Loading::default()
    };
    let (base, top) = (body.node([0.0; 3]), body.node([0.0, HEIGHT_MM, 0.0]));
    let settled_mm = P0_MPA * HEIGHT_MM / body.aggregate_mpa;
    let mut found = Vec::new();
    march(&body.problem, loading, &seconds, |_, solver| {
        let p = solver.fluid_pressure_mpa()[base] / P0_MPA;
        found.push([p, -solver.displacement_mm()[top][1] / settled_mm]);
    });
    found
}

#[test]
fn terzaghi_is_met() {
    let t = times(&TABLE.map(|row| row.0), &[40; 5]);
    let found = consolidate(32, &t);
    for (at, pressure, degree) in TABLE {
        let [p, u] = found[place(&t, at)];
        println!("T {at}: {p:.6} {pressure}, {u:.6} {degree}");
        assert!((p / pressure - 1.0).abs() < 5e-3, "pressure at {at}: {p}, {pressure}");
        assert!((u / degree - 1.0).abs() < 5e-3, "degree at {at}: {u}, {degree}");
    }
}

/// Half the step, a quarter of the error: on one mesh, so that what differs is time.
#[test]
fn time_is_integrated_in_second_order() {
    let at = |steps: usize| {
        let t: Vec<f64> = (1..=steps).map(|i| 0.5 * i as f64 / steps as f64).collect();
        consolidate(8, &t).last().unwrap()[0]
    };
    let [a, b, c, d] = [40, 80, 160, 320].map(at);
    let orders = [((a - b) / (b - c)).abs().log2(), ((b - c) / (c - d)).abs().log2()];
    println!("{a} {b} {c} {d} {orders:?}");
    assert!(orders.iter().all(|o| (o - 2.0).abs() < 0.2), "{orders:?}");
}

/// With the same time steps, so that what differs is space.
#[test]
fn pressure_converges_in_second_order_of_the_mesh() {
    let t: Vec<f64> = (1..=10).map(|i| 0.05 * f64::from(i)).collect();
    let at = |cells: usize| consolidate(cells, &t).last().unwrap()[0];
    let [a, b, c, d] = [2, 4, 8, 16].map(at);
    let orders = [((a - b) / (b - c)).abs().log2(), ((b - c) / (c - d)).abs().log2()];
    println!("{a} {b} {c} {d} {orders:?}");
    assert!(orders.iter().all(|o| *o > 1.8), "{orders:?}");
}

/// After one step pressure rises monotonely from the drained top if the step is at least
/// `h^2 / 6 c` (Vermeer & Verruijt 1981); after a shorter one it overshoots there, by no more than
/// the L2 projection of the jump does, and no longer once that time has passed.
#[test]
fn the_first_step_oscillates_no_more_than_theory_says() {
    let cells = 16;
    let body = column(cells);
    let h = HEIGHT_MM / cells as f64;
    let overshoot = |times_s: &[f64]| {
        let loading = Loading {
            dead_n: body.pressed("y_max", P0_MPA),
            course: sudden(times_s),
            ..Loading::default()
        };
        let mut largest = 0.0f64;
        march(&body.problem, loading, times_s, |_, solver| {
            largest = solver.fluid_pressure_mpa().into_iter().fold(0.0, f64::max);
        });
        largest / P0_MPA - 1.0
    };
    let bound_s = h * h / (6.0 * K * body.aggregate_mpa);
    let at_bound = overshoot(&[bound_s]);
    let below = overshoot(&[1e-3 * bound_s]);
    let later: Vec<f64> = (1..=24).map(|i| 0.25 * f64::from(i) * bound_s).collect();
    let after = overshoot(&later);
    println!("{at_bound:e} {below:e} {after:e}");
    assert!(at_bound < 1e-9, "{at_bound}");
    assert!(below > 0.01 && below < 0.3, "{below}");
    assert!(after < 0.01 * below, "{after}");
}
