//! Times of both ways, for `docs/concepts/networks.md`:
//!
//! ```sh
//! RUNS=400 cargo test --release -p papilla-engine --lib map_net::tests::times -- --ignored --nocapture
//! ```

use super::{MAP_NETS, Pair, Patch};
use crate::MAP_LEN;
use std::time::{Duration, Instant};

/// Least and median time of a map, in turn with tract's.
#[test]
#[ignore = "prints times"]
fn times() {
    let ball = Patch {
        middle: [90.0, 112.0],
        radii: [15.0; 2],
        is_box: false,
        is_rough: false,
        peak: 0.3,
    };
    let plate = Patch {
        middle: [100.0, 112.0],
        radii: [75.0, 65.0],
        is_box: false,
        is_rough: false,
        peak: 0.2,
    };
    let runs: usize = std::env::var("RUNS").ok().and_then(|runs| runs.parse().ok()).unwrap_or(200);
    for name in MAP_NETS {
        let mut pair = Pair::new(name);
        let count = if name.starts_with("large") { runs / 4 } else { runs };
        for (what, patch) in [("ball", &ball), ("plate", &plate)] {
            let mut map = vec![0.0; MAP_LEN];
            patch.add(pair.max_pa, &mut map);
            let mut answer = vec![0.0; MAP_LEN];
            let mut times = [vec![], vec![]];
            for _ in 0..count {
                let sessions = [&mut pair.plain, &mut pair.by_rows];
                for (session, times) in sessions.into_iter().zip(&mut times) {
                    let start = Instant::now();
                    session.infer(&map, &mut answer).unwrap();
                    times.push(start.elapsed());
                }
            }
            let [plain, by_rows] = times.map(|mut times: Vec<Duration>| {
                times.sort_unstable();
                [times[0], times[times.len() / 2]].map(|time| time.as_secs_f64() * 1e6)
            });
            println!(
                "{name} {what}: tract {plain:.0?} us, by rows {by_rows:.0?} us (least, median)"
            );
        }
    }
}
