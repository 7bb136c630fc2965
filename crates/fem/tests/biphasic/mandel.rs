//! Mandel's problem: a slab between rigid, smooth, impermeable plates that a force presses together,
//! drained at its sides. In its middle pressure rises before it falls.

use crate::bodies::{Body, march, place, rectangle, times};
use papilla_fem::solve::Loading;
use std::f64::consts::{FRAC_PI_2, PI};

const HALF_WIDTH_MM: f64 = 2.0;
const HALF_HEIGHT_MM: f64 = 0.5;
/// Force on a half width, N per mm of length.
const FORCE_N: f64 = 0.03;

/// Poisson's ratio; `p / p0` in the middle at T = .01, .05, .1, .5, 1; its peak and when.
const TABLE: [(f64, [f64; 5], f64, f64); 3] = [
    (0.0, [1.059_016, 1.136_520, 1.151_791, 0.702_735, 0.356_285], 1.155_55, 0.083),
    (0.2, [1.043_761, 1.098_883, 1.095_414, 0.592_785, 0.258_844], 1.106_90, 0.072),
    (0.4, [1.019_088, 1.040_305, 1.010_322, 0.453_427, 0.156_896], 1.040_49, 0.054),
];
const STOPS: [f64; 5] = [0.01, 0.05, 0.1, 0.5, 1.0];

/// `tan a / a = (1 - nu) / (1/2 - nu)`, a root between each two poles.
fn roots(nu: f64) -> Vec<f64> {
    let ratio = (1.0 - nu) / (0.5 - nu);
    let root = |k: u32| {
        let (mut low, mut high) =
            (f64::from(k) * PI + if k == 0 { 1e-9 } else { 0.0 }, f64::from(k) * PI + FRAC_PI_2);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if middle.tan() < ratio * middle { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    };
    (0..400).map(root).collect()
}

/// `sum sin a cos a / (a - sin a cos a) exp(-a^2 T)`.
fn sum(roots: &[f64], t: f64) -> f64 {
    let term = |a: &f64| {
        let sc = a.sin() * a.cos();
        sc / (a - sc) * (-a * a * t).exp()
    };
    roots.iter().map(term).sum()
}

/// The plates come as close as Mandel's force presses them (Cheng & Detournay 1988): pressure
/// and the sides' bulge are what that force gives.
#[test]
fn mandel_is_met_with_its_rise() {
    for (nu, table, peak, peak_at) in TABLE {
        let (x, y) = ([true, false, false], [false, true, false]);
        let held = [("x_min", x), ("y_min", y), ("y_max", y)];
        let mesh = rectangle([HALF_WIDTH_MM, HALF_HEIGHT_MM], [12, 1]);
        let body = Body::new(mesh, nu, &held, "x_max");
        let t = times(&STOPS, &[32; 5]);
        let scale_s = HALF_WIDTH_MM * HALF_WIDTH_MM / body.c();
        let seconds: Vec<f64> = t.iter().map(|t| t * scale_s).collect();
        let roots = roots(nu);
        // Strain over F / 2 G a; times that, displacement.
        let strain = |t: f64| (1.0 - nu) - sum(&roots, t);
        let unit = FORCE_N / (2.0 * body.shear_mpa * HALF_WIDTH_MM);
        let course = t.iter().map(|&v| (v / t.last().unwrap(), strain(v))).collect();
        let prescribed_mm = body.problem.mesh.node_sets["y_max"]
            .iter()
            .map(|&n| (3 * n as usize + 1, -unit * HALF_HEIGHT_MM))
            .collect();
        let loading = Loading { prescribed_mm, course, ..Loading::default() };
        let (middle, side) = (body.node([0.0; 3]), body.node([HALF_WIDTH_MM, 0.0, 0.0]));
        let p0 = FORCE_N / (2.0 * HALF_WIDTH_MM);
        let mut found = Vec::new();
        march(&body.problem, loading, &seconds, |_, solver| {
            let p = solver.fluid_pressure_mpa()[middle] / p0;
            found.push([p, solver.displacement_mm()[side][0] / (unit * HALF_WIDTH_MM)]);
        });
        for (at, due) in STOPS.into_iter().zip(table) {
            let [p, bulge] = found[place(&t, at)];
            // u_x(a) / (F / 2 G): nu - sum + 2 sum, with nu_u = 1/2.
            let bulge_due = nu + sum(&roots, at);
            println!("nu {nu} T {at}: {p:.6} {due}; {bulge:.6} {bulge_due:.6}");
            assert!((p / due - 1.0).abs() < 5e-3, "nu {nu}, T {at}: {p}, {due}");
            assert!((bulge / bulge_due - 1.0).abs() < 5e-3, "nu {nu}, T {at}: {bulge}");
        }
        let (highest, when) = found
            .iter()
            .zip(&t)
            .fold((0.0, 0.0), |m, (f, &t)| if f[0] > m.0 { (f[0], t) } else { m });
        println!("nu {nu}: peak {highest} at {when}; {peak} at {peak_at}");
        assert!((highest / peak - 1.0).abs() < 5e-3, "nu {nu}: {highest}");
        assert!((when / peak_at - 1.0).abs() < 0.15, "nu {nu}: {when}");
    }
}
