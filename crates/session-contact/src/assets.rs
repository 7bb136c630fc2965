//! The contact model of a service, and what a frame takes with it.

use std::{sync::Arc, time::Instant};

use papilla_contact::{
    Contact, ContactModel, InterfaceSkin, ModelError, Object, PixelContact, PixelSkin,
    PixelSpacing, Settings, ShearEnergy, Solver,
};
use papilla_proto::{
    MAP_LEN,
    atlas::{Atlas, Raster},
    sdf::{Placement, RoundedPlate},
};

use super::Hand;

/// Frames that are timed, of which the median counts.
const FRAMES: u32 = 15;

/// A contact model and its time.
pub struct ContactAssets {
    /// The model.
    pub model: Arc<ContactModel>,
    /// What pixels have to know; none if the model names no layers.
    pub pixels: Option<Arc<PixelSkin>>,
    /// What traction along the skin needs to be felt; none likewise.
    pub interface: Option<Arc<InterfaceSkin>>,
    /// Time that `shear_energy` adds to a frame, us.
    pub shear_us: Option<u64>,
    /// Time of a warm frame under a plate that moves by 10 um, us.
    pub frame_us: u64,
    /// The same on pixels.
    pub pixel_frame_us: Option<u64>,
    /// The same on every second pixel.
    pub coarse_pixel_frame_us: Option<u64>,
}

impl ContactAssets {
    /// Reads a file's bytes, which have to be of this atlas' finger, and times the solver.
    ///
    /// # Errors
    /// [`ModelError`] for what is no model, one that is damaged, or one of another finger.
    pub fn read(bytes: &[u8], atlas: &Atlas, raster: &Arc<Raster>) -> Result<Self, ModelError> {
        let model = Arc::new(ContactModel::read(bytes)?);
        model.require_atlas(atlas.hash())?;
        let pixels = PixelSkin::new(&model, atlas, Arc::clone(raster)).map(Arc::new);
        let interface = InterfaceSkin::new(&model, atlas, Arc::clone(raster)).map(Arc::new);
        let shear_us = interface.as_ref().map(|of| shear_us(of, model.vertices()));
        let frame_us = frame_us(&model, None).unwrap_or(0);
        let on_pixels = |spacing| {
            let pixels = PixelContact::new(Arc::clone(pixels.as_ref()?), &model, spacing);
            self::frame_us(&model, Some(pixels))
        };
        let [pixel_frame_us, coarse_pixel_frame_us] =
            [PixelSpacing::One, PixelSpacing::Two].map(on_pixels);
        Ok(Self {
            model,
            pixels,
            interface,
            shear_us,
            frame_us,
            pixel_frame_us,
            coarse_pixel_frame_us,
        })
    }

    /// Time that a frame of this hand is expected to take, us; none if nothing is solved.
    #[must_use]
    pub fn us_of(&self, hand: &Hand) -> Option<u64> {
        let us = match hand.pixels {
            None => self.frame_us,
            Some(PixelSpacing::One) => self.pixel_frame_us?,
            Some(PixelSpacing::Two) => self.coarse_pixel_frame_us?,
        };
        (!hand.form().takes_pressure()).then_some(us)
    }
}

/// What traction takes to be felt; the time does not depend on the values.
fn shear_us(of: &Arc<InterfaceSkin>, vertices: usize) -> u64 {
    let mut energy = ShearEnergy::new(Arc::clone(of));
    let (pressure_pa, mut sed) = (vec![1e3; MAP_LEN], vec![0.0; MAP_LEN]);
    let shear_pa = vec![[100.0; 3]; vertices];
    let mut times = [0; FRAMES as usize];
    for time in &mut times {
        let start = Instant::now();
        energy.add(&pressure_pa, &shear_pa, 1.0, &mut sed);
        *time = start.elapsed().as_micros() as u64;
    }
    times.sort_unstable();
    times[times.len() / 2]
}

/// A plate against the pad, half a millimetre and a bit deep.
fn frame_us(model: &Arc<ContactModel>, mut pixels: Option<PixelContact>) -> Option<u64> {
    let lowest = model.lowest_mm();
    let plate = Arc::new(RoundedPlate { half_mm: [10.0, 10.0, 3.0], edge_radius_mm: 1.0 });
    let mut solver = Solver::new(Arc::clone(model), Settings::default()).ok()?;
    let mut out = Contact::new(model.vertices());
    let mut times = Vec::new();
    for frame in 0..FRAMES {
        let depth = 0.5 + 0.01 * f64::from(frame % 2);
        let origin_mm = [lowest[0], lowest[1], lowest[2] + depth - plate.half_mm[2]];
        let object = Object::rigid(plate.clone(), Placement::turned(0.0, 0.0, 0.0, origin_mm));
        let start = Instant::now();
        match &mut pixels {
            Some(pixels) => solver.solve_on_pixels(&[object], pixels, &mut out).ok()?,
            None => solver.solve(&[object], &mut out).ok()?,
        }
        times.push(start.elapsed().as_micros() as u64);
    }
    times.sort_unstable();
    Some(times[times.len() / 2])
}
