//! The contact model of a service, and what a frame takes with it.

use std::{sync::Arc, time::Instant};

use papilla_contact::{Contact, ContactModel, ModelError, Object, Settings, Solver};
use papilla_proto::sdf::{Placement, RoundedPlate};

/// Frames that are timed, of which the median counts.
const FRAMES: u32 = 15;

/// A contact model and its time.
pub struct ContactAssets {
    /// The model.
    pub model: Arc<ContactModel>,
    /// Time of a warm frame under a plate that moves by 10 um, us.
    pub frame_us: u64,
}

impl ContactAssets {
    /// Reads a file's bytes, and times the solver.
    ///
    /// # Errors
    /// [`ModelError`] for what is no model, or one that is damaged.
    pub fn read(bytes: &[u8]) -> Result<Self, ModelError> {
        let model = Arc::new(ContactModel::read(bytes)?);
        let frame_us = frame_us(&model).unwrap_or(0);
        Ok(Self { model, frame_us })
    }
}

/// A plate against the pad, half a millimetre and a bit deep.
fn frame_us(model: &Arc<ContactModel>) -> Option<u64> {
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
        solver.solve(&[object], &mut out).ok()?;
        times.push(start.elapsed().as_micros() as u64);
    }
    times.sort_unstable();
    Some(times[times.len() / 2])
}
