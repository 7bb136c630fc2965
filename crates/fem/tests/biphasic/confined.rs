//! Confined compression at large strain, as in FEBio's test suite: a column between smooth rigid
//! walls, its drained top pushed down by a porous piston and held.
//!
//! In one dimension `lambda = 1 + du/dZ` is all there is: the total stress `P(lambda) - p` does not
//! depend on Z, and `d lambda/dt = d/dZ (k(lambda) / lambda dp/dZ)`, so
//! `d lambda/dt = d/dZ (k(lambda) / lambda P'(lambda) d lambda/dZ)`: solved here by finite
//! differences of the displacement, which share no code with the elements.

use papilla_fem::biphasic::{FluidSpec, HolmesMow, Permeability};
use papilla_fem::element::{Elastic, Materials};
use papilla_fem::mesh::supports::hold;
use papilla_fem::solve::{Loading, Problem};
use papilla_solid::{NeoHookean, moduli};

use crate::bodies::{march, rectangle};

const YOUNG_MPA: f64 = 0.5;
const NU: f64 = 0.15;
const K0: f64 = 1e-3;
const HEIGHT_MM: f64 = 1.0;
const PUSH_MM: f64 = 0.2;
/// Pushed within, and held until, s.
const RAMP_S: f64 = 1000.0;
const END_S: f64 = 1100.0;
const LAW: HolmesMow = HolmesMow { solid_share: 0.2, power: 2.0, exponent: 2.0 };

/// Uniaxial first Piola-Kirchhoff stress, MPa, of
/// `mu/2 (l^(-2/3) (l^2 + 2) - 3) + K/2 (l - 1)^2`.
fn stress(l: f64) -> f64 {
    let [mu, bulk] = moduli(YOUNG_MPA, NU);
    0.5 * mu * (4.0 / 3.0 * l.powf(1.0 / 3.0) - 4.0 / 3.0 * l.powf(-5.0 / 3.0)) + bulk * (l - 1.0)
}

fn permeability(l: f64, law: Option<HolmesMow>) -> f64 {
    law.map_or(K0, |h| {
        let pores = (l - h.solid_share) / (1.0 - h.solid_share);
        K0 * pores.powf(h.power) * (0.5 * h.exponent * (l * l - 1.0)).exp()
    })
}

/// Pressure at the base, MPa, at the ends of ramp and hold: finite differences in Z, explicit in
/// time.
///
/// With v = du/dt, flux against the solid is `-v` everywhere above the impermeable base, so
/// `v = k / lambda dp/dZ = k / lambda dP/dZ`.
fn one_dimensional(law: Option<HolmesMow>) -> [f64; 2] {
    let cells = 60;
    let h = HEIGHT_MM / cells as f64;
    // Half of what is stable at lambda = .5.
    let dt = 0.25 * h * h / (K0 * 4.0);
    let mut u = vec![0.0; cells + 1];
    let mut found = [0.0; 2];
    for (i, end) in [RAMP_S, END_S].into_iter().enumerate() {
        let begin = if i == 0 { 0.0 } else { RAMP_S };
        let steps = ((end - begin) / dt).ceil() as usize;
        let dt = (end - begin) / steps as f64;
        for s in 1..=steps {
            let stretch: Vec<f64> = u.windows(2).map(|w| 1.0 + (w[1] - w[0]) / h).collect();
            for z in 1..cells {
                let l = 0.5 * (stretch[z - 1] + stretch[z]);
                let slope = (stress(stretch[z]) - stress(stretch[z - 1])) / h;
                u[z] += dt * permeability(l, law) / l * slope;
            }
            let t = begin + s as f64 * dt;
            u[cells] = -PUSH_MM * (t / RAMP_S).min(1.0);
        }
        // At the top p = 0; between, P(top) - 0 = P(base) - p. Ends by extrapolation.
        let stretch: Vec<f64> = u.windows(2).map(|w| 1.0 + (w[1] - w[0]) / h).collect();
        let end = |a: f64, b: f64, c: f64| stress((15.0 * a - 10.0 * b + 3.0 * c) / 8.0);
        let base = end(stretch[0], stretch[1], stretch[2]);
        let top = end(stretch[cells - 1], stretch[cells - 2], stretch[cells - 3]);
        found[i] = base - top;
    }
    found
}

/// The same by elements: pressure at the base.
fn by_elements(law: Option<HolmesMow>) -> [f64; 2] {
    let cells = 16;
    let mesh = rectangle([HEIGHT_MM / cells as f64, HEIGHT_MM], [1, cells]);
    let (x, y) = ([true, false, false], [false, true, false]);
    let fixed = hold(&mesh, &[("x_min", x), ("x_max", x), ("y_min", y), ("y_max", y)]);
    let top = mesh.node_sets["y_max"].clone();
    let [mu_mpa, bulk_mpa] = moduli(YOUNG_MPA, NU);
    let materials = Materials::new(vec![Elastic::shared(NeoHookean { mu_mpa }, bulk_mpa)]);
    let permeability = Permeability { at_rest_mm4_per_n_s: K0, strain: law };
    let fluid = FluidSpec { permeability: vec![Some(permeability)], drained: Some("y_max".into()) };
    let problem = Problem::new(mesh, materials, fixed, None).unwrap().with_fluid(fluid).unwrap();
    let steps = 100;
    let part = |i: usize| i as f64 / steps as f64;
    let mut times: Vec<f64> = (1..=steps).map(|i| RAMP_S * part(i)).collect();
    times.extend((1..=steps).map(|i| RAMP_S + (END_S - RAMP_S) * part(i).powi(2)));
    let loading = Loading {
        prescribed_mm: top.iter().map(|&n| (3 * n as usize + 1, -PUSH_MM)).collect(),
        course: vec![(RAMP_S / END_S, 1.0), (1.0, 1.0)],
        ..Loading::default()
    };
    let mut found = [0.0; 2];
    march(&problem, loading, &times, |i, solver| {
        if i + 1 == steps || i + 1 == 2 * steps {
            found[usize::from(i >= steps)] =
                solver.fluid_pressure_mpa().into_iter().fold(0.0, f64::max);
        }
    });
    found
}

#[test]
fn confined_compression_agrees_with_an_independent_solution() {
    for law in [None, Some(LAW)] {
        let (due, found) = (one_dimensional(law), by_elements(law));
        println!("{law:?}: {found:?} {due:?}");
        for (f, d) in found.into_iter().zip(due) {
            assert!((f / d - 1.0).abs() < 0.01, "{law:?}: {found:?}, {due:?}");
        }
    }
}
