//! Counts the random poses under the shipped finger that contact on pixels does not settle, by shape:
//! the table of `docs/reports/contact.md`.
//!
//! ```sh
//! cargo run --release -p papilla-contact --example unsettled -- --poses 10000
//! ```
//!
//! A pose is the one before, moved by up to .05 mm (two times of three), or a new one: one object,
//! or two (one time of eight), tilted by up to 30 degrees, up to 2 mm deep, or 6 (one time of ten).

mod poses;

use papilla_contact::{Contact, Object, PixelContact, PixelSpacing, Quality, Settings, Solver};
use poses::{DEPTH_MM, Pad, shapes};
use std::error::Error;
use std::path::Path;
use std::sync::Arc;

/// The shipped finger.
const MODELS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models");

/// What was asked on the command line.
struct Asked {
    poses: usize,
    seed: u64,
    spacing: PixelSpacing,
    /// Coefficient of friction of all objects.
    friction: f64,
}

impl Asked {
    fn read() -> Result<Self, Box<dyn Error>> {
        let mut asked = Self { poses: 500, seed: 20, spacing: PixelSpacing::One, friction: 0.0 };
        let mut words = std::env::args().skip(1);
        while let Some(word) = words.next() {
            let mut number = || words.next().ok_or(format!("{word} needs a number"));
            match word.as_str() {
                "--poses" => asked.poses = number()?.parse()?,
                "--seed" => asked.seed = number()?.parse()?,
                "--friction" => asked.friction = number()?.parse()?,
                "--coarse" => asked.spacing = PixelSpacing::Two,
                _ => {
                    let known = "--poses N, --seed N, --friction COEFFICIENT, --coarse";
                    return Err(format!("{word}: use {known}").into());
                }
            }
        }
        Ok(asked)
    }
}

/// Poses that touch, those that were flagged as unsettled, and those of them whose rounds settled,
/// but whose force fell while the object moved further in. Those whose force led along the skin are
/// flagged too, and counted apart.
#[derive(Clone, Copy, Default)]
struct Count {
    touching: usize,
    unsettled: usize,
    faded: usize,
    aside: usize,
}

impl Count {
    fn note(&mut self, quality: Quality) {
        self.touching += 1;
        self.unsettled += usize::from(!quality.settled && !quality.is_aside);
        self.faded += usize::from(quality.has_faded);
        self.aside += usize::from(quality.is_aside);
    }

    fn told(self, name: &str) -> String {
        let Self { touching, unsettled, faded, aside } = self;
        let share = 100.0 * unsettled as f64 / touching.max(1) as f64;
        format!("| {name} | {touching} | {unsettled} | {share:.1} | {faded} | {aside} |")
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let Asked { poses, seed, spacing, friction } = Asked::read()?;
    let (pad, shapes) = (Pad::of(Path::new(MODELS))?, shapes());
    let settings = Settings { friction: friction > 0.0, ..Settings::default() };
    let mut solver = Solver::new(Arc::clone(&pad.model), settings)?;
    let mut pixels = PixelContact::new(Arc::clone(&pad.skin), &pad.model, spacing);
    let mut out = Contact::new(pad.model.vertices());
    let mut random = fastrand::Rng::with_seed(seed);
    let mut by_shape = vec![Count::default(); shapes.len()];
    let [mut deep, mut two, mut held, mut all] = [Count::default(); 4];
    let mut units = Vec::new();
    let (mut objects, mut which) = (Vec::new(), 0);
    for pose in 0..poses {
        if pose == 0 || random.u8(..3) == 0 {
            objects.clear();
            for _ in 0..1 + usize::from(random.u8(..8) == 0) {
                which = random.usize(..shapes.len());
                let object = pad.throw(&mut random, &shapes[which]);
                objects.push(Object { friction, ..object });
            }
        } else {
            objects[0].placement.origin_mm[2] += 0.1 * (random.f64() - 0.5);
        }
        solver.solve_on_pixels(&objects, &mut pixels, &mut out)?;
        if !(pixels.peak_pa() > 0.0) {
            continue;
        }
        units.push(1e-6 * out.effort.work as f64);
        all.note(out.quality);
        if out.quality.is_held {
            held.note(out.quality);
        }
        if objects.len() > 1 {
            two.note(out.quality);
        } else if pad.clearance_mm(&objects[0]) > -DEPTH_MM {
            by_shape[which].note(out.quality);
        } else {
            deep.note(out.quality);
        }
    }
    println!("{poses} poses of seed {seed}, {spacing:?}\n");
    println!(
        "| poses | touch | unsettled | % | of these, the force fell | flagged as the force led along the skin |"
    );
    println!("|---|---|---|---|---|---|");
    for ((name, ..), count) in shapes.iter().zip(&by_shape) {
        println!("{}", count.told(name));
    }
    println!("{}", deep.told("one object, deeper than 2 mm"));
    println!("{}", two.told("two objects"));
    println!("{}", all.told("all"));
    println!("{}\n", held.told("of these, with a held body"));
    units.sort_by(f64::total_cmp);
    let at = |q: f64| units.get(((units.len().max(1) - 1) as f64 * q) as usize);
    let [median, bad, most] = [0.5, 0.95, 0.99].map(|q| at(q).copied().unwrap_or(0.0));
    println!(
        "million units of work: median {median:.1}, 95th percentile {bad:.0}, 99th percentile {most:.0}, in \
         all {:.0}",
        units.iter().sum::<f64>()
    );
    Ok(())
}
