//! Random poses of things under a finger.

use papilla_atlas::{Atlas, MAP_SIDE_PX, Patch, Raster};
use papilla_contact::{ContactModel, Object, PixelSkin};
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
pub(crate) const DEPTH_MM: f64 = 2.0;

/// A shape's name, the shape, and how high its top is above its origin, mm.
pub(crate) type Shape = (&'static str, Arc<dyn SignedDistance>, f64);

pub(crate) fn shapes() -> Vec<Shape> {
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

/// A finger, and where its pixels are, mm.
pub(crate) struct Pad {
    pub(crate) model: Arc<ContactModel>,
    pub(crate) skin: Arc<PixelSkin>,
    places_mm: Vec<[f64; 3]>,
}

impl Pad {
    /// From the folder of models.
    pub(crate) fn of(models: &Path) -> Result<Self, Box<dyn Error>> {
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
    pub(crate) fn throw(&self, random: &mut fastrand::Rng, (_, shape, top_mm): &Shape) -> Object {
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
    pub(crate) fn clearance_mm(&self, object: &Object) -> f64 {
        let of = |p: &[f64; 3]| object.placement.clearance_mm(object.shape.as_ref(), *p);
        self.places_mm.iter().map(of).fold(f64::INFINITY, f64::min)
    }
}
