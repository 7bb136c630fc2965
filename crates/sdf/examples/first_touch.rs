//! How far a shape is from points, and how far it can travel until it touches one of them.
//!
//! ```sh
//! cargo run -p papilla-sdf --example first_touch
//! ```

use papilla_sdf::{Cylinder, Placement, SignedDistance, Sphere, first_touch_travel};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let ball = Sphere { radius_mm: 5.0 };
    let bar = Cylinder { radius_mm: 2.0, length_mm: 20.0, end_radius_mm: 0.5 };
    let shapes: [(&str, &dyn SignedDistance); 2] = [("ball", &ball), ("bar", &bar)];

    // Three points of a skin that looks down. The shapes start 10 mm below and travel up.
    let skin_mm = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.2], [0.0, 3.0, 0.5]];
    let below = Placement::turned(0.0, 0.0, 0.0, [0.0, 0.0, -10.0]);
    for (name, shape) in shapes {
        let found = below.distance(shape, skin_mm[1]);
        let (gap_mm, normal) = (found.gap_mm, found.normal);
        println!("{name}: {gap_mm:.3} mm from the second point, whose normal is {normal:.2?}");
        let travel_mm = first_touch_travel(shape, &below, [0.0, 0.0, 1.0], &skin_mm)?;
        println!("{name}: touches after {travel_mm:.3} mm");
    }
    Ok(())
}
