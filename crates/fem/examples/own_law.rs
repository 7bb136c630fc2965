//! A constitutive law of one's own: Yeoh's, with two terms, in an element that knows nothing of it.
//!
//! ```sh
//! cargo run --release -p papilla-fem --example own_law
//! ```

use papilla_fem::element::{Elastic, ElementKind, Materials};
use papilla_fem::mesh::{block::even, lattice::lattice, supports::hold};
use papilla_fem::solve::{Loading, MovingIndenter, Options, Problem, Solver};
use papilla_sdf::{Placement, Plate, RoundedPlate};
use papilla_solid::tensor::{Kinematics, Mat3, Tensor4};
use papilla_solid::{Isochoric, NeoHookean};
use std::sync::Arc;

/// `U = mu w + k w^2` with `w = (I1bar - 3) / 2` (Yeoh 1990): soft at first, then stiffer.
#[derive(Clone, Copy, Debug)]
struct Yeoh {
    mu_mpa: f64,
    k_mpa: f64,
}

/// `w` is the energy of a neo-Hookean solid of unit modulus, so its derivatives are known.
const UNIT: NeoHookean = NeoHookean { mu_mpa: 1.0 };

impl Isochoric for Yeoh {
    const FINITE: bool = true;

    fn energy(&self, k: &Kinematics) -> f64 {
        let w = UNIT.energy(k);
        self.mu_mpa * w + self.k_mpa * w * w
    }

    /// `dU/dF = (mu + 2 k w) dw/dF`.
    fn first_piola(&self, k: &Kinematics) -> Mat3 {
        let factor = self.mu_mpa + 2.0 * self.k_mpa * UNIT.energy(k);
        UNIT.first_piola(k).map(|row| row.map(|p| factor * p))
    }

    /// `d2U/dF2 = (mu + 2 k w) d2w/dF2 + 2 k dw/dF (x) dw/dF`.
    fn tangent(&self, k: &Kinematics) -> Tensor4 {
        let factor = self.mu_mpa + 2.0 * self.k_mpa * UNIT.energy(k);
        let (p, unit) = (UNIT.first_piola(k), UNIT.tangent(k));
        std::array::from_fn(|a| {
            std::array::from_fn(|b| {
                std::array::from_fn(|c| {
                    std::array::from_fn(|d| {
                        factor * unit[a][b][c][d] + 2.0 * self.k_mpa * p[a][b] * p[c][d]
                    })
                })
            })
        })
    }

    fn shear_modulus_mpa(&self) -> f64 {
        self.mu_mpa
    }
}

papilla_fem::constitutive_model_of!(Yeoh);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let neo_hooke = forces_n(Yeoh { mu_mpa: 0.03, k_mpa: 0.0 })?;
    let yeoh = forces_n(Yeoh { mu_mpa: 0.03, k_mpa: 0.1 })?;
    println!("Force of a plate on a block of 10 mm that is held below, N");
    println!("depth, mm   neo-Hooke    Yeoh");
    for ((depth_mm, soft_n), (_, stiff_n)) in neo_hooke.into_iter().zip(yeoh) {
        println!("{depth_mm:9.1}   {soft_n:9.3}   {stiff_n:5.3}");
    }
    Ok(())
}

/// Depths, mm, and forces of the plate, N.
fn forces_n(law: Yeoh) -> Result<Vec<(f64, f64)>, Box<dyn std::error::Error>> {
    let axes = [even(5.0, 4), even(5.0, 4), even(10.0, 6)];
    let mesh = lattice(ElementKind::Hex8, axes, |p| p);
    let [x, y] = [[true, false, false], [false, true, false]];
    let fixed = hold(&mesh, &[("z_min", [true; 3]), ("x_min", x), ("y_min", y)]);
    let materials = Materials::new(vec![Elastic::shared(law, 1.0)]);
    let problem = Problem::new(mesh, materials, fixed, Some("z_max"))?;

    // A plate presses towards its own +z, so it is turned over. It is wider than the block.
    let plate = RoundedPlate::from(&Plate { size_mm: [30.0, 30.0], edge_radius_mm: 1.0 });
    let start = Placement::turned(180.0, 0.0, 0.0, [0.0, 0.0, 10.0 + plate.half_mm[2]]);
    let travel_mm = 2.0;
    let indenter = MovingIndenter::straight(Arc::new(plate), start, [0.0, 0.0, -travel_mm]);
    let mut solver = Solver::new(&problem, Options::default())?;
    solver.start(Loading { indenter: Some(indenter), ..Loading::default() });
    (1..=4)
        .map(|step| {
            let part = f64::from(step) / 4.0;
            solver.advance_to(part)?;
            Ok((part * travel_mm, -4.0 * solver.balance().contact_force_n[2]))
        })
        .collect()
}
