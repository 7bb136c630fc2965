//! Least and median time of a map of each shipped network on maps: by tract, which runs the graph
//! as it stands, and by rows.
//!
//! ```sh
//! RUNS=400 cargo bench -p papilla-engine [-- NAME ...]
//! ```
//!
//! Both ways take turns in one thread, so that what else the machine does meets both alike. The
//! least times are those that it disturbs least.

use papilla_engine::{MAP_LEN, MAP_SIDE_PX, Session, load, load_as_it_stands};
use std::error::Error;
use std::time::Instant;

const NETWORKS: [&str; 4] = ["nano", "small", "large", "large-maps"];

/// Hertz' pressure on an ellipse: middle and half axes in rows and columns, and the peak in Pa.
struct Contact {
    name: &'static str,
    middle: [f32; 2],
    radii: [f32; 2],
    peak_pa: f32,
}

/// A pixel is 0.137 mm wide.
const CONTACTS: [Contact; 2] = [
    Contact {
        name: "ball, 4 mm across",
        middle: [90.0, 112.0],
        radii: [15.0, 15.0],
        peak_pa: 30e3,
    },
    Contact {
        name: "plate over the pad, 20 x 18 mm",
        middle: [100.0, 112.0],
        radii: [75.0, 65.0],
        peak_pa: 20e3,
    },
];

impl Contact {
    fn map(&self) -> Vec<f32> {
        let value = |place: usize| {
            let at = [(place / MAP_SIDE_PX) as f32, (place % MAP_SIDE_PX) as f32];
            let [y, x] = [0, 1].map(|axis| (at[axis] - self.middle[axis]) / self.radii[axis]);
            self.peak_pa * (1.0 - y * y - x * x).max(0.0).sqrt()
        };
        (0..MAP_LEN).map(value).collect()
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let runs = std::env::var("RUNS").map_or(Ok(200), |runs| runs.parse())?.max(1);
    let names: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let (processor, arch) = (papilla_processor::described(), std::env::consts::ARCH);
    println!("{processor}, {arch}, {runs} runs, us: least (median)\n");
    println!("| network | contact | tract | by rows | tract / by rows |\n|---|---|---|---|---|");
    for name in NETWORKS {
        if !names.is_empty() && !names.iter().any(|wanted| wanted == name) {
            continue;
        }
        let path = format!("{}/../../models/{name}.onnx", env!("CARGO_MANIFEST_DIR"));
        let onnx = std::fs::read(path)?;
        let by_rows = load(&onnx, None)?;
        if !by_rows.info().backend.ends_with("by rows") {
            return Err(format!("{name} is not evaluated by rows").into());
        }
        let mut sessions = [load_as_it_stands(&onnx)?.session()?, by_rows.session()?];
        for contact in &CONTACTS {
            let [plain, rows] = times(&mut sessions, &contact.map(), runs)?;
            println!(
                "| `{name}` | {} | {:.0} ({:.0}) | {:.0} ({:.0}) | {:.1} |",
                contact.name,
                plain[0],
                plain[1],
                rows[0],
                rows[1],
                plain[0] / rows[0]
            );
        }
    }
    Ok(())
}

/// Least and median of both ways, us.
fn times(
    sessions: &mut [Box<dyn Session>; 2],
    pressure_pa: &[f32],
    runs: usize,
) -> Result<[[f64; 2]; 2], Box<dyn Error>> {
    let mut sed_j_per_m3 = vec![0.0; MAP_LEN];
    let mut times = [vec![], vec![]];
    for _ in 0..runs {
        for (session, times) in sessions.iter_mut().zip(&mut times) {
            let start = Instant::now();
            session.infer(pressure_pa, &mut sed_j_per_m3)?;
            times.push(1e6 * start.elapsed().as_secs_f64());
        }
    }
    Ok(times.map(|mut times: Vec<f64>| {
        times.sort_unstable_by(f64::total_cmp);
        [times[0], times[times.len() / 2]]
    }))
}
