//! Counts the random poses under the shipped finger that contact on pixels does not settle, by shape:
//! the table of `docs/reports/contact.md`.
//!
//! ```sh
//! cargo run --release -p papilla-contact --example unsettled -- --poses 10000
//! ```
//!
//! A pose is the one before, moved by up to .05 mm (two times of three), or a new one: one object,
//! or two (one time of eight), tilted by up to 30 degrees, up to 2 mm deep, or 6 (one time of ten).

use papilla_atlas::{Atlas, MAP_SIDE_PX, Patch, Raster};
use papilla_contact::{
    Contact, ContactModel, Object, PixelContact, PixelSkin, PixelSpacing, Settings, Solver,
};
use papilla_sdf::{
    Cylinder, Dots, Grating, Placement, Plate, Punch, Ring, RoundedPlate, SignedDistance, Sphere,
    Wedge,
};
use std::error::Error;
use std::path::Path;
use std::sync::Arc;

/// Objects' tops are thrown so far round the pad's lowest point, mm.
const AROUND_MM: f64 = 6.0;
/// Deepest throw, mm; one in ten goes three times as deep.
const DEPTH_MM: f64 = 2.0;

/// A shape's name, the shape, and how high its top is above its origin, mm.
type Shape = (&'static str, Arc<dyn SignedDistance>, f64);

fn shapes() -> Vec<Shape> {
    let plate = RoundedPlate::from(&Plate::default());
    let bar = Cylinder { radius_mm: 2.0, length_mm: 20.0, end_radius_mm: 0.5 };
    vec![
        ("plate", Arc::new(plate), plate.half_mm[2]),
        ("ball 4 mm", Arc::new(Sphere { radius_mm: 4.0 }), 4.0),
        ("ball .5 mm", Arc::new(Sphere { radius_mm: 0.5 }), 0.5),
        ("bar", Arc::new(bar), 2.0),
        ("wedge", Arc::new(Wedge::default()), 0.0),
        ("punch", Arc::new(Punch::default()), 0.0),
        ("ring", Arc::new(Ring::default()), Ring::default().height_mm / 2.0),
        ("grating", Arc::new(Grating::default()), 0.0),
        ("dots", Arc::new(Dots::default()), 0.0),
    ]
}

/// The shipped finger, and where its pixels are, mm.
struct Pad {
    model: Arc<ContactModel>,
    skin: Arc<PixelSkin>,
    places_mm: Vec<[f64; 3]>,
}

impl Pad {
    fn shipped() -> Result<Self, Box<dyn Error>> {
        let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models");
        let atlas = Atlas::from_json(&std::fs::read_to_string(models.join("atlas.json"))?)?;
        let model = Arc::new(ContactModel::read(&std::fs::read(models.join("finger.contact"))?)?);
        let raster = Arc::new(Raster::new(&atlas, Patch::Skin));
        let places = raster.indices().iter().filter_map(|index| {
            let [row, column] = [*index as usize / MAP_SIDE_PX, *index as usize % MAP_SIDE_PX];
            Some(raster.position_mm(&atlas, row, column)?.map(f64::from))
        });
        let places_mm = places.collect();
        let skin = PixelSkin::new(&model, &atlas, raster).ok_or("the model names no layers")?;
        Ok(Self { model, skin: Arc::new(skin), places_mm })
    }

    /// A shape, its top as deep below a random place of the pad, tilted and spun.
    fn throw(&self, random: &mut fastrand::Rng, (_, shape, top_mm): &Shape) -> Object {
        let lowest = self.model.lowest_mm();
        let at = loop {
            let at = self.places_mm[random.usize(..self.places_mm.len())];
            if (at[0] - lowest[0]).hypot(at[1] - lowest[1]) < AROUND_MM {
                break at;
            }
        };
        let most = if random.u8(..10) == 0 { 3.0 * DEPTH_MM } else { DEPTH_MM };
        let depth_mm = -0.5 + (most + 0.5) * random.f64();
        let [pitch, roll, spin] = [60.0, 60.0, 360.0].map(|range| range * (random.f64() - 0.5));
        let Placement { rotation, .. } = Placement::turned(pitch, roll, spin, [0.0; 3]);
        let tip_mm = [0, 1, 2].map(|i| rotation[i][2] * top_mm);
        let up = [0.0, 0.0, depth_mm];
        let origin_mm = [0, 1, 2].map(|i| at[i] + up[i] - tip_mm[i]);
        Object::rigid(shape.clone(), Placement { rotation, origin_mm })
    }

    /// Least distance of the undeformed skin's pixels from an object, mm.
    fn clearance_mm(&self, object: &Object) -> f64 {
        let of = |p: &[f64; 3]| object.placement.clearance_mm(object.shape.as_ref(), *p);
        self.places_mm.iter().map(of).fold(f64::INFINITY, f64::min)
    }
}

/// What was asked on the command line.
struct Asked {
    poses: usize,
    seed: u64,
    spacing: PixelSpacing,
}

impl Asked {
    fn read() -> Result<Self, Box<dyn Error>> {
        let mut asked = Self { poses: 500, seed: 20, spacing: PixelSpacing::One };
        let mut words = std::env::args().skip(1);
        while let Some(word) = words.next() {
            let mut number = || words.next().ok_or(format!("{word} needs a number"));
            match word.as_str() {
                "--poses" => asked.poses = number()?.parse()?,
                "--seed" => asked.seed = number()?.parse()?,
                "--coarse" => asked.spacing = PixelSpacing::Two,
                _ => return Err(format!("{word}: use --poses N, --seed N, --coarse").into()),
            }
        }
        Ok(asked)
    }
}

/// Poses that touch, and those that were flagged as unsettled.
#[derive(Clone, Copy, Default)]
struct Count {
    touching: usize,
    unsettled: usize,
}

impl Count {
    fn note(&mut self, is_settled: bool) {
        self.touching += 1;
        self.unsettled += usize::from(!is_settled);
    }

    fn told(self, name: &str) -> String {
        let share = 100.0 * self.unsettled as f64 / self.touching.max(1) as f64;
        format!("| {name} | {} | {} | {share:.1} |", self.touching, self.unsettled)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let Asked { poses, seed, spacing } = Asked::read()?;
    let (pad, shapes) = (Pad::shipped()?, shapes());
    let mut solver = Solver::new(Arc::clone(&pad.model), Settings::default())?;
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
                objects.push(pad.throw(&mut random, &shapes[which]));
            }
        } else {
            objects[0].placement.origin_mm[2] += 0.1 * (random.f64() - 0.5);
        }
        solver.solve_on_pixels(&objects, &mut pixels, &mut out)?;
        if !(pixels.peak_pa() > 0.0) {
            continue;
        }
        let settled = out.quality.settled;
        units.push(1e-6 * out.effort.work as f64);
        all.note(settled);
        if out.quality.is_held {
            held.note(settled);
        }
        if objects.len() > 1 {
            two.note(settled);
        } else if pad.clearance_mm(&objects[0]) > -DEPTH_MM {
            by_shape[which].note(settled);
        } else {
            deep.note(settled);
        }
    }
    println!("{poses} poses of seed {seed}, {spacing:?}\n");
    println!("| poses | touch | unsettled | % |\n|---|---|---|---|");
    for ((name, ..), count) in shapes.iter().zip(&by_shape) {
        println!("{}", count.told(name));
    }
    println!("{}", deep.told("one object, deeper than 2 mm"));
    println!("{}", two.told("two objects"));
    println!("{}", all.told("all"));
    println!("{}\n", held.told("of these, with a held body"));
    units.sort_by(f64::total_cmp);
    let at = |q: f64| units.get(((units.len().max(1) - 1) as f64 * q) as usize);
    let [median, most] = [0.5, 0.99].map(|q| at(q).copied().unwrap_or(0.0));
    println!("million units of work: median {median:.1}, 99th percentile {most:.0}");
    Ok(())
}
