//! Times inference of models, one line a model: name, median and least milliseconds, runs.
//! `tests/builds/run` compiles it beside two commits.

use papilla_engine::{MAP_LEN, MAP_SIDE_PX};
use std::{
    error::Error,
    path::Path,
    time::{Duration, Instant},
};

/// Time spent on each model.
const BUDGET: Duration = Duration::from_millis(1000);
/// Fewest maps a model is timed with.
const RUNS_MIN: usize = 9;

/// A paraboloid of pressure in the middle of the map, as a round tip makes it.
fn press_pa() -> Vec<f32> {
    let at = |i: usize| {
        let row = (i / MAP_SIDE_PX) as f32 - 100.0;
        let column = (i % MAP_SIDE_PX) as f32 - 112.0;
        20_000.0 * (1.0 - (row * row + column * column) / 900.0).max(0.0)
    };
    (0..MAP_LEN).map(at).collect()
}

fn main() -> Result<(), Box<dyn Error>> {
    let pressure_pa = press_pa();
    let mut sed_j_per_m3 = vec![0.0; MAP_LEN];
    for file in std::env::args().skip(1) {
        let model = papilla_engine::load(&std::fs::read(&file)?, None)?;
        let mut session = model.session()?;
        session.infer(&pressure_pa, &mut sed_j_per_m3)?;
        let (mut times_ms, start) = (Vec::new(), Instant::now());
        while start.elapsed() < BUDGET || times_ms.len() < RUNS_MIN {
            let begin = Instant::now();
            session.infer(&pressure_pa, &mut sed_j_per_m3)?;
            times_ms.push(begin.elapsed().as_secs_f64() * 1e3);
        }
        times_ms.sort_by(f64::total_cmp);
        let name = Path::new(&file).file_stem().unwrap_or_default().to_string_lossy();
        println!("{name} {:.4} {:.4} {}", times_ms[times_ms.len() / 2], times_ms[0], times_ms.len());
    }
    Ok(())
}
