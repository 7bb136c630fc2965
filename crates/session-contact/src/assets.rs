//! The contact model of a service, and the time that a frame takes with it.

use std::{
    sync::{Arc, OnceLock},
    time::Instant,
};

use papilla_contact::{
    Contact, ContactModel, FingerFileError, InterfaceSkin, Method, ModelError, Object,
    PixelContact, PixelSkin, Settings, ShearEnergy, Solver, finger_file_sha256,
};
use papilla_proto::{
    MAP_LEN,
    atlas::{Atlas, Raster},
    contact::{ContactErrors, ContactMethod},
    json::{self, JsonError},
    sdf::{Placement, RoundedPlate},
};
use sha2::{Digest, Sha256};

use super::method::Chosen;

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
    /// What things take here, once it is measured.
    times: OnceLock<Times>,
    /// What methods err with this model; none if nobody measured it.
    pub errors: Option<ContactErrors>,
    /// SHA-256 of the model's file.
    pub sha256: String,
}

/// What things take, us.
#[derive(Debug, Clone, Default)]
struct Times {
    /// What `shear_energy` adds to a frame.
    shear_us: Option<u64>,
    /// A warm frame under a plate that moves by 10 um, by each method that this model can serve.
    frame_us: Vec<(ContactMethod, u64)>,
}

/// Why a contact model cannot be served.
#[derive(Debug, thiserror::Error)]
pub enum AssetsError {
    /// The model is no good.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The finger's description beside it cannot be read.
    #[error("finger.toml beside it: {0}")]
    Finger(#[from] FingerFileError),
    /// What methods err with it cannot be read.
    #[error(
        "contact.json beside it: {0}; make it again with `model-export contact --write`, or take it away"
    )]
    Errors(JsonError),
}

impl ContactAssets {
    /// Reads a file's bytes, which have to be of this atlas' finger. `errors` is the file `contact.json` beside it, if there is one; of another model it is
    /// passed over.
    ///
    /// # Errors
    /// [`AssetsError`] for what is no model, one that is damaged, or one of another finger, and for
    /// a damaged `contact.json`.
    pub fn read(
        bytes: &[u8],
        errors: Option<&[u8]>,
        atlas: &Atlas,
        raster: &Arc<Raster>,
    ) -> Result<Self, AssetsError> {
        let model = Arc::new(ContactModel::read(bytes)?);
        model.require_atlas(atlas.hash())?;
        let pixels = PixelSkin::new(&model, atlas, Arc::clone(raster)).map(Arc::new);
        let interface = InterfaceSkin::new(&model, atlas, Arc::clone(raster)).map(Arc::new);
        let sha256 = model_sha256(bytes);
        let errors = errors.map(|json| contact_errors(json, &sha256)).transpose()?.flatten();
        Ok(Self { model, pixels, interface, times: OnceLock::new(), errors, sha256 })
    }

    /// Refuses a contact model that was made of another description of the finger than the text of the
    /// `finger.toml` beside it. `skin` is given the name of a file of that folder and returns its bytes,
    /// if it is there. A contact model that does not know its description is accepted.
    ///
    /// # Errors
    /// [`AssetsError::Model`]; [`AssetsError::Finger`] if the text cannot be read.
    pub fn require_finger_file(
        &self,
        text: &str,
        skin: impl FnOnce(&str) -> Option<Vec<u8>>,
    ) -> Result<(), AssetsError> {
        if self.model.header().finger_file_sha256.is_empty() {
            return Ok(());
        }
        Ok(self.model.require_finger_file(&finger_file_sha256(text, skin)?)?)
    }

    /// Measures on this thread what every method takes; until then times are expected, not known.
    /// Takes a second.
    pub fn measure(&self) {
        let Self { model, pixels, interface, .. } = self;
        let time = |method: ContactMethod| {
            let chosen = Chosen { method, warning: None };
            let spacing = chosen.pixel_spacing();
            let on_pixels = |spacing| {
                pixels.as_ref().map(|skin| PixelContact::new(Arc::clone(skin), model, spacing))
            };
            let pixels = spacing.map(on_pixels);
            // Without layers there are no pixels to be timed.
            let us = match pixels {
                Some(None) => None,
                pixels => self::frame_us(model, chosen.at_vertices(), pixels.flatten()),
            };
            us.map(|us| (method, us))
        };
        self.times.get_or_init(|| Times {
            shear_us: interface.as_ref().map(|of| shear_us(of, model.vertices())),
            frame_us: ContactMethod::ALL.into_iter().filter_map(time).collect(),
        });
    }

    /// Time of a warm frame under a plate that moves by 10 um, us, by each method that this model
    /// can serve: measured, or until then expected.
    #[must_use]
    pub fn frame_us(&self) -> Vec<(ContactMethod, u64)> {
        if let Some(times) = self.times.get() {
            return times.frame_us.clone();
        }
        let serves = |method: &ContactMethod| {
            let chosen = Chosen { method: *method, warning: None };
            chosen.pixel_spacing().is_none() || self.pixels.is_some()
        };
        ContactMethod::ALL.into_iter().filter(serves).map(|of| (of, expected_us(of))).collect()
    }

    /// Time that a frame is expected to take by this method, us; none if it cannot serve.
    #[must_use]
    pub fn us_by(&self, method: ContactMethod) -> Option<u64> {
        self.frame_us().into_iter().find(|(of, _)| *of == method).map(|(_, us)| us)
    }

    /// Time that `shear_energy` adds to a frame, us: measured, or until then expected. None if the
    /// model names no layers.
    #[must_use]
    pub fn shear_us(&self) -> Option<u64> {
        match self.times.get() {
            Some(times) => times.shear_us,
            None => self.interface.as_ref().map(|_| SHEAR_EXPECTED_US),
        }
    }
}

/// SHA-256 of a contact model's file, in hexadecimal.
#[must_use]
pub fn model_sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
}

/// What `contact.json` says, if it is of the contact model whose file has this SHA-256.
///
/// # Errors
/// It cannot be read.
pub fn contact_errors(json: &[u8], sha256: &str) -> Result<Option<ContactErrors>, AssetsError> {
    let errors: ContactErrors = json::read(json).map_err(AssetsError::Errors)?;
    Ok((errors.contact_sha256 == sha256).then_some(errors))
}

/// What a frame takes on one core of the machine of the reports, us.
fn expected_us(method: ContactMethod) -> u64 {
    match method {
        ContactMethod::Springs => 20,
        ContactMethod::SmallStrain => 150,
        ContactMethod::SecondOrder => 300,
        ContactMethod::CoarsePixels => 500,
        ContactMethod::Pixels => 1000,
    }
}

/// What `shear_energy` adds there.
const SHEAR_EXPECTED_US: u64 = 500;

/// What traction takes to be felt; the time does not depend on the values.
fn shear_us(of: &Arc<InterfaceSkin>, vertices: usize) -> u64 {
    let mut energy = ShearEnergy::new(Arc::clone(of));
    let (pressure_pa, mut sed) = (vec![1e3; MAP_LEN], vec![0.0; MAP_LEN]);
    let shear_pa = vec![[100.0; 3]; vertices];
    let mut times = [0; FRAMES as usize];
    for time in &mut times {
        let start = Instant::now();
        energy.add(&pressure_pa, &shear_pa, 1.0, f32::INFINITY, &mut sed);
        *time = start.elapsed().as_micros() as u64;
    }
    times.sort_unstable();
    times[times.len() / 2]
}

/// A plate against the pad, half a millimetre and a bit deep.
fn frame_us(
    model: &Arc<ContactModel>,
    method: Method,
    mut pixels: Option<PixelContact>,
) -> Option<u64> {
    let lowest = model.lowest_mm();
    let plate = Arc::new(RoundedPlate { half_mm: [10.0, 10.0, 3.0], edge_radius_mm: 1.0 });
    let mut solver =
        Solver::new(Arc::clone(model), Settings { method, ..Settings::default() }).ok()?;
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
