//! One pressure map through one model: a round contact in, strain energy density (SED) out.
//!
//! ```sh
//! cargo run --release -p papilla-engine --example one_map [models/NAME.onnx]
//! ```

use papilla_engine::{MAP_LEN, MAP_SIDE_PX, load};
use std::{path::PathBuf, time::Instant};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let shipped = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../models/small.onnx");
    let path = std::env::args_os().nth(1).map_or(shipped, PathBuf::from);
    let model = load(&std::fs::read(path)?, None)?;
    let mut session = model.session()?; // one for each thread

    // Hertz' pressure: 10 kPa in the middle, zero from 20 pixels (some 3 mm) on.
    let middle = MAP_SIDE_PX as f32 / 2.0;
    let pressure_pa: Vec<f32> = (0..MAP_LEN)
        .map(|i| {
            let (row, column) = ((i / MAP_SIDE_PX) as f32, (i % MAP_SIDE_PX) as f32);
            let away = (row - middle).hypot(column - middle) / 20.0;
            1e4 * (1.0 - away * away).max(0.0).sqrt()
        })
        .collect();
    let mut sed_j_per_m3 = vec![0.0; MAP_LEN];
    session.infer(&pressure_pa, &mut sed_j_per_m3)?; // the first one also fills caches
    let start = Instant::now();
    session.infer(&pressure_pa, &mut sed_j_per_m3)?;
    let took = start.elapsed();

    let peak = sed_j_per_m3.iter().copied().fold(0.0, f32::max);
    println!("{}: at most {peak:.1} J/m3, in {took:.2?}", model.info().name);
    Ok(())
}
