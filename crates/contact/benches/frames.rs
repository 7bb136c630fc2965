//! Processor time of frames of contact on the shipped finger, at random poses: the first frame, from nothing,
//! and next ones, after moves of 10 um.
//!
//! ```sh
//! cargo bench -p papilla-contact --bench frames -- --poses 300 [--friction 0.5]
//! ```
//!
//! The poses are those of the example `unsettled`. Of each pose's next frames the least time counts, which
//! other work on the machine disturbs least. With friction the moves are along the skin as well.

#[path = "../examples/poses/mod.rs"]
mod poses;

use papilla_contact::{Contact, Object, PixelContact, PixelSpacing, Settings, Solver};
use papilla_processor::thread_s;
use poses::{DEPTH_MM, Pad, shapes};
use std::error::Error;
use std::path::Path;
use std::sync::Arc;

/// The shipped finger.
const MODELS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models");

/// How far a pose moves, to and fro, mm.
const MOVE_MM: f64 = 0.01;

/// Times of one pose, us.
#[derive(Clone, Copy)]
struct Times {
    first: f64,
    next: f64,
    settled: bool,
}

/// Two methods on pixels, and the one at vertices.
const METHODS: [(&str, Option<PixelSpacing>); 3] = [
    ("pixels", Some(PixelSpacing::One)),
    ("coarse_pixels", Some(PixelSpacing::Two)),
    ("second_order", None),
];

fn main() -> Result<(), Box<dyn Error>> {
    let (mut poses, mut seed, mut moves, mut friction) = (300, 20, 8, 0.0);
    // `cargo test` starts benches too, with words of its own.
    if !std::env::args().any(|word| word == "--bench") {
        return Ok(());
    }
    let mut words = std::env::args().skip(1).filter(|word| word != "--bench");
    while let Some(word) = words.next() {
        let number = words.next().ok_or(format!("{word} needs a number"))?;
        match word.as_str() {
            "--friction" => friction = number.parse()?,
            "--poses" => poses = number.parse()?,
            "--seed" => seed = number.parse()?,
            "--moves" => moves = number.parse()?,
            _ => {
                let use_instead = "--poses N, --seed N, --moves N, --friction COEFFICIENT";
                return Err(format!("{word}: use {use_instead}").into());
            }
        }
    }
    let pad = Pad::of(Path::new(MODELS))?;
    println!("{poses} poses of seed {seed}, friction {friction}, us: median / 95th percentile\n");
    println!("| method | poses that touch | first frame | next frame | next frame, settled |");
    println!("|---|---|---|---|---|");
    for (name, spacing) in METHODS {
        let times = measure(&pad, spacing, [poses, moves], seed, friction)?;
        let column = |of: &dyn Fn(&Times) -> Option<f64>| {
            let mut column: Vec<f64> = times.iter().filter_map(of).collect();
            column.sort_by(f64::total_cmp);
            let at = |q: f64| column.get(((column.len().max(1) - 1) as f64 * q) as usize);
            let [median, most] = [0.5, 0.95].map(|q| at(q).copied().unwrap_or(f64::NAN));
            format!("{median:.0} / {most:.0}")
        };
        let (first, next) = (column(&|t| Some(t.first)), column(&|t| Some(t.next)));
        let settled = column(&|t| t.settled.then_some(t.next));
        println!("| `{name}` | {} | {first} | {next} | {settled} |", times.len());
    }
    Ok(())
}

fn measure(
    pad: &Pad,
    spacing: Option<PixelSpacing>,
    [poses, moves]: [usize; 2],
    seed: u64,
    friction: f64,
) -> Result<Vec<Times>, Box<dyn Error>> {
    let shapes = shapes();
    let settings = Settings { friction: friction > 0.0, ..Settings::default() };
    let mut solver = Solver::new(Arc::clone(&pad.model), settings)?;
    let mut pixels = spacing.map(|s| PixelContact::new(Arc::clone(&pad.skin), &pad.model, s));
    let mut out = Contact::new(pad.model.vertices());
    let mut random = fastrand::Rng::with_seed(seed);
    let mut times = Vec::with_capacity(poses);
    for _ in 0..poses {
        let shape = &shapes[random.usize(..shapes.len())];
        let mut object = pad.throw(&mut random, shape);
        if pad.clearance_mm(&object) < -DEPTH_MM {
            continue;
        }
        object.friction = friction;
        solver.reset();
        if let Some(pixels) = &mut pixels {
            pixels.reset();
        }
        let mut frame = |object: &Object| {
            let began = thread_s();
            match &mut pixels {
                Some(pixels) => {
                    solver.solve_on_pixels(std::slice::from_ref(object), pixels, &mut out)
                }
                None => solver.solve(std::slice::from_ref(object), &mut out),
            }?;
            let us = 1e6 * (thread_s() - began);
            let touches = out.force_n.iter().any(|force| *force != 0.0);
            Ok::<_, Box<dyn Error>>((us, touches, out.quality.settled))
        };
        let (first, touches, _) = frame(&object)?;
        if !touches {
            continue;
        }
        let (mut next, mut settled) = (f64::INFINITY, true);
        for step in 0..moves {
            let by_mm = if step % 2 == 0 { MOVE_MM } else { -MOVE_MM };
            object.placement.origin_mm[2] += by_mm;
            if friction > 0.0 {
                object.placement.origin_mm[1] += by_mm;
            }
            let (us, _, is_settled) = frame(&object)?;
            next = next.min(us);
            settled &= is_settled;
        }
        times.push(Times { first, next, settled });
    }
    Ok(times)
}
