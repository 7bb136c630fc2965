//! A block of rubber under a rigid ball, beside Hertz' closed form.
//!
//! ```sh
//! cargo run --release -p papilla-fem --example hertz
//! ```

use papilla_fem::element::{Elastic, ElementKind, Materials};
use papilla_fem::mesh::{lattice::lattice, supports::hold};
use papilla_fem::solve::{Loading, MovingIndenter, Options, Problem, Solver};
use papilla_sdf::{Placement, Sphere};
use papilla_solid::{NeoHookean, moduli};
use std::sync::Arc;

const YOUNG_MPA: f64 = 0.1;
const POISSON: f64 = 0.45;
const RADIUS_MM: f64 = 4.0;
const DEPTH_MM: f64 = 0.5;
const STEPS: u32 = 5;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A quarter of a block, 20 mm wide and 10 mm high, finer towards the ball. Two faces are planes
    // of symmetry; the lower one is held.
    let finer: Vec<f64> = (0..=12).map(|i| 10.0 * (f64::from(i) / 12.0).powf(1.6)).collect();
    let height = finer.iter().rev().map(|z| 10.0 - z).collect();
    let axes = [finer.clone(), finer, height];
    let mesh = lattice(ElementKind::Hex8, axes, |p| p);
    let [x, y] = [[true, false, false], [false, true, false]];
    let fixed = hold(&mesh, &[("z_min", [true; 3]), ("x_min", x), ("y_min", y)]);

    let [mu_mpa, bulk_mpa] = moduli(YOUNG_MPA, POISSON);
    let materials = Materials::new(vec![Elastic::shared(NeoHookean { mu_mpa }, bulk_mpa)]);
    let problem = Problem::new(mesh, materials, fixed, Some("z_max"))?;

    // The ball touches the top of the block and comes down by DEPTH_MM while time runs from 0 to 1.
    let ball = Arc::new(Sphere { radius_mm: RADIUS_MM });
    let start = Placement::turned(0.0, 0.0, 0.0, [0.0, 0.0, 10.0 + RADIUS_MM]);
    let indenter = MovingIndenter::straight(ball, start, [0.0, 0.0, -DEPTH_MM]);
    let mut solver = Solver::new(&problem, Options::default())?;
    solver.start(Loading { indenter: Some(indenter), ..Loading::default() });

    println!("depth, mm   force, N   Hertz, N");
    for step in 1..=STEPS {
        let part = f64::from(step) / f64::from(STEPS);
        solver.advance_to(part)?;
        let depth_mm = part * DEPTH_MM;
        // Hertz: F = 4/3 E / (1 - nu^2) sqrt(R) d^(3/2).
        let modulus_mpa = YOUNG_MPA / (1.0 - POISSON * POISSON);
        let hertz_n = 4.0 / 3.0 * modulus_mpa * RADIUS_MM.sqrt() * depth_mm.powf(1.5);
        let force_n = -4.0 * solver.balance().contact_force_n[2];
        println!("{depth_mm:9.2}   {force_n:8.4}   {hertz_n:8.4}");
    }
    Ok(())
}
