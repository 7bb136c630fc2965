//! Stress of three laws in uniaxial stretch at constant volume, MPa.
//!
//! ```sh
//! cargo run -p papilla-solid --example stretch
//! ```

use papilla_solid::tensor::Kinematics;
use papilla_solid::{Isochoric, LinearElastic, NeoHookean, Ogden, OgdenTerm};

fn main() {
    let mu_mpa = 0.03;
    let ogden = Ogden::new(&[OgdenTerm { mu_mpa, alpha: 9.0 }], [0.67, 1.5]);
    println!("Cauchy stress along the axis less that aside, MPa");
    println!("stretch     Hooke   neo-Hooke     Ogden");
    for percent in (70..=150).step_by(10) {
        let stretch = f64::from(percent) / 100.0;
        let hooke = axial_mpa(&LinearElastic { mu_mpa }, stretch);
        let neo_hooke = axial_mpa(&NeoHookean { mu_mpa }, stretch);
        let ogden = axial_mpa(&ogden, stretch);
        println!("{stretch:7.2}   {hooke:+.4}     {neo_hooke:+.4}   {ogden:+.4}");
    }
}

/// `F11 P11 - F22 P22`: the pressure that keeps the volume cancels in the difference.
fn axial_mpa(law: &impl Isochoric, stretch: f64) -> f64 {
    let aside = 1.0 / stretch.sqrt();
    let mut h = [[0.0; 3]; 3];
    (h[0][0], h[1][1], h[2][2]) = (stretch - 1.0, aside - 1.0, aside - 1.0);
    let p = law.first_piola(&Kinematics::new(h));
    stretch * p[0][0] - aside * p[1][1]
}
