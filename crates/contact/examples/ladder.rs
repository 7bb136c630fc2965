//! Error against FE and processor time a frame of every method, side by side:
//! `ladder MODEL FRAMES [verbose]`.
//!
//! MODEL is a file of `fe-datagen contact`. Each line of FRAMES is an FE state in JSON: `set`,
//! `ind` (name of the indenter), `press` (id), `depth` (mm), `indenter` (as in a scene),
//! `rotation` and `origin` (its placement, mm), `force` (N) and `p`, pairs of vertex and pressure (Pa).

use papilla_contact::{Contact, ContactModel, Method, Object, Settings, Solver};
use papilla_sdf::{IndenterSpec, Placement};
use serde::Deserialize;
use std::path::Path;
use std::sync::Arc;

#[derive(Deserialize)]
struct Frame {
    set: String,
    ind: String,
    press: usize,
    depth: f64,
    indenter: IndenterSpec,
    rotation: [[f64; 3]; 3],
    origin: [f64; 3],
    force: [f64; 3],
    p: Vec<(usize, f64)>,
}

/// Frames of a warm path: to and fro by 10 um: 0.9 mm/s at 90 frames a second.
const WARM: usize = 20;

/// Processor time of this thread, s: what else the machine does does not count.
fn thread_s() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

fn percentile(values: &mut [f64], part: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * part).round() as usize]
}

fn main() {
    let mut args = std::env::args().skip(1);
    let (Some(model), Some(frames)) = (args.next(), args.next()) else {
        eprintln!("ladder MODEL FRAMES");
        return;
    };
    let verbose = args.next().is_some();
    let bytes = std::fs::read(model).expect("the model can be read");
    let model = Arc::new(ContactModel::read(&bytes).expect("a model"));
    let text = std::fs::read_to_string(frames).expect("the frames can be read");
    let frames: Vec<Frame> =
        text.lines().map(|l| serde_json::from_str(l).expect("a frame")).collect();
    let mut sets: Vec<&str> = frames.iter().map(|f| f.set.as_str()).collect();
    sets.dedup();
    println!("method, set: pressure median / p95 / max %, force %, us cold, us warm, iterations");
    for method in Method::ALL {
        for set in &sets {
            let settings = Settings { method, ..Settings::default() };
            let mut solver = Solver::new(model.clone(), settings).expect("a solver");
            let mut out = Contact::new(model.vertices());
            let [mut errors, mut forces, mut cold, mut warm, mut its, mut wits] =
                [const { Vec::new() }; 6];
            let (mut unsettled, mut outside) = (0, 0);
            for frame in frames.iter().filter(|f| f.set == *set) {
                let shape = frame.indenter.build(Path::new("")).expect("a shape");
                let placement = Placement { rotation: frame.rotation, origin_mm: frame.origin };
                let mut objects = [Object::rigid(shape, placement)];
                solver.reset();
                let clock = thread_s();
                solver.solve(&objects, &mut out).expect("an answer");
                cold.push((thread_s() - clock) * 1e6);
                its.push(f64::from(out.effort.iterations));
                let mut due = vec![0.0; model.vertices()];
                for &(i, p) in &frame.p {
                    due[i] = p;
                }
                let (mut miss, mut size) = (0.0, 0.0);
                for (p, due) in out.pressure_pa.iter().zip(&due) {
                    miss += (f64::from(*p) - due).powi(2);
                    size += due * due;
                }
                errors.push(100.0 * (miss / size).sqrt());
                let norm = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
                forces.push(100.0 * (norm(out.force_n) / norm(frame.force) - 1.0).abs());
                unsettled += usize::from(!out.quality.settled);
                outside += usize::from(out.quality.out_of_range);
                if verbose
                    && errors.last().is_some_and(|e| *e > 15.0)
                    && method == Method::SecondOrder
                {
                    println!(
                        "  {} {} {:.2} {:.1} {:?} {:?} pen {:.4}",
                        frame.ind,
                        frame.press,
                        frame.depth,
                        errors.last().unwrap_or(&0.0),
                        out.quality,
                        out.effort,
                        out.penetration_mm
                    );
                }
                for k in 0..WARM {
                    objects[0].placement.origin_mm[2] = frame.origin[2] + [0.01, 0.0][k % 2];
                    let clock = thread_s();
                    solver.solve(&objects, &mut out).expect("an answer");
                    warm.push((thread_s() - clock) * 1e6);
                    wits.push(f64::from(out.effort.iterations));
                }
            }
            let both =
                |v: &mut [f64]| format!("{:.1}/{:.1}", percentile(v, 0.5), percentile(v, 0.95));
            let most = percentile(&mut errors, 1.0);
            println!(
                "{}, {set}: {} / {most:.0} %, force {} %, cold {} us, warm {} us, iterations {} warm {}; unsettled {unsettled}, outside {outside} of {}",
                method.name(),
                both(&mut errors),
                both(&mut forces),
                both(&mut cold),
                both(&mut warm),
                both(&mut its),
                both(&mut wits),
                errors.len()
            );
        }
    }
}
