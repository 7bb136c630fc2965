//! Contact of a session's fingers: what a hello announces, frame by frame.
//!
//! A [`Hand`] is made from a hello, and says which form frames must have. Each of its fingers is a
//! [`Finger`] with a solver of its own: [`Finger::take`] reads a frame and finds the pressure,
//! [`Finger::write`] appends force, torque and the like to the answer. All memory is taken at the
//! hello, and what the hello did not name costs nothing.
//!
//! ```
//! use papilla_proto::{ErrorCode, Hello, contact::Input};
//! use papilla_session_contact::{Hand, Skin};
//! # use papilla_proto::atlas::{Atlas, Patch, PatchVertices, Raster};
//! # let uv_px = vec![[20.0, 20.0], [200.0, 20.0], [200.0, 200.0], [20.0, 200.0]];
//! # let positions_mm = uv_px.iter().map(|[u, v]| [0.1 * v, -0.1 * u, 0.0]).collect();
//! # let patch = PatchVertices { positions_mm, uv_px };
//! # let atlas = Atlas::new(0.1, vec![[0, 2, 1], [0, 3, 2]], patch.clone(), patch)?;
//!
//! // A service without a contact model takes pressure alone.
//! let raster = std::sync::Arc::new(Raster::new(&atlas, Patch::Skin));
//! let skin = Skin { atlas: &atlas, raster: &raster, model: None, pixels: None, interface: None,
//!     errors: None, model_sha256: None };
//! let hello = Hello::default();
//! assert_eq!(Hand::of(&hello, skin)?.fingers().len(), 1);
//! let objects = Hello { input: Some(Input::Objects), ..hello };
//! let refused = Hand::of(&objects, skin).map(|_| ()).unwrap_err();
//! assert_eq!(refused.code, ErrorCode::BadContact);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod announced;
mod assets;
mod felt;
mod finger;
mod frame;
mod gaps;
mod method;
mod solver;
mod warm_start;

#[cfg(test)]
mod tests;

use std::sync::{Arc, Mutex};

use papilla_contact::{ContactModel, InterfaceSkin, PixelSkin};
use papilla_proto::{
    ERROR_ESTIMATE_LEN, ErrorCode, HEADER_LEN, Hello, MAP_LEN, Problem, Warning,
    atlas::{Atlas, Raster},
    contact::{ContactErrors, ContactMethod, Input, SampleLayout, TOUCH_LEN},
    effects::{Section, SectionName},
};

pub use announced::of_finger;
pub use assets::{AssetsError, ContactAssets, contact_errors, model_sha256};
pub use felt::Felt;
pub use finger::{Finger, Frame, Taken};
pub use frame::FrameForm;

use self::method::Chosen;

/// Most bytes of one finger, pressed all over, by the dearest method; its objects aside. Held by
/// `tests/memory.rs`.
pub const FINGER_BYTES_MAX: usize = 20 << 20;

/// The skin that things press on.
#[derive(Clone, Copy)]
pub struct Skin<'a> {
    /// Both surfaces of the finger.
    pub atlas: &'a Atlas,
    /// Pixels of the skin.
    pub raster: &'a Arc<Raster>,
    /// What is known of the finger; none if the service has no contact model.
    pub model: Option<&'a Arc<ContactModel>>,
    /// What contact on pixels has to know of it; none if the model names no layers.
    pub pixels: Option<&'a Arc<PixelSkin>>,
    /// What traction along the skin needs to be felt; none likewise.
    pub interface: Option<&'a Arc<InterfaceSkin>>,
    /// What methods err with that model; none if nobody measured it.
    pub errors: Option<&'a ContactErrors>,
    /// SHA-256 of that model's file, if it is from one.
    pub model_sha256: Option<&'a str>,
}

/// The fingers of one session.
pub struct Hand {
    form: FrameForm,
    /// Of each finger; none where frames are pressure.
    methods: Vec<Option<ContactMethod>>,
    fingers: Vec<Arc<Mutex<Finger>>>,
    sections: Vec<Section>,
    warnings: Vec<Warning>,
}

/// A refusal of what was announced or sent.
fn unusable(field: impl Into<String>, message: impl Into<String>) -> Problem {
    Problem::new(ErrorCode::BadContact, message).at(field)
}

impl Hand {
    /// The fingers that a hello announces.
    ///
    /// Takes some milliseconds, and up to [`FINGER_BYTES_MAX`] a finger once it is pressed all over.
    ///
    /// # Errors
    /// A member is unusable or missing; the problem names it.
    pub fn of(hello: &Hello, skin: Skin<'_>) -> Result<Self, Problem> {
        Self::of_until(hello, skin, &|| true)
    }

    /// The same for as long as `go_on` says so, which is asked now and then: shapes of many triangles
    /// may take some tenths of a second.
    ///
    /// # Errors
    /// As [`Self::of`], and once `go_on` said no.
    pub fn of_until(
        hello: &Hello,
        skin: Skin<'_>,
        go_on: &dyn Fn() -> bool,
    ) -> Result<Self, Problem> {
        Self::of_each(hello, skin, &[], go_on)
    }

    /// The same with a skin for each finger by its number; those without one of `skins` have the
    /// skin `first`.
    ///
    /// # Errors
    /// As [`Self::of_until`], and fingers whose answers would be laid out differently.
    pub fn of_each(
        hello: &Hello,
        first: Skin<'_>,
        skins: &[Skin<'_>],
        go_on: &dyn Fn() -> bool,
    ) -> Result<Self, Problem> {
        let input = hello.input.unwrap_or_default();
        announced::check_members(hello, input)?;
        let skin_of = |number: usize| skins.get(number).copied().unwrap_or(first);
        let choose = |number: usize| {
            let chosen = Chosen::of(hello, input, skin_of(number));
            chosen.map_err(|problem| announced::of_finger(hello, number, problem))
        };
        choose(0)?;
        let persons = announced::persons(hello)?;
        let (objects, mut warnings) = announced::objects(hello, input, go_on)?;
        let laid_out = |skin: Skin<'_>| {
            let vertices = skin.atlas.vertex_count();
            let form = FrameForm::of(hello, objects.len(), persons.len(), vertices);
            (form, sections(hello, input, vertices))
        };
        let (form, sections) = laid_out(skin_of(0));
        let (mut fingers, mut methods) = (Vec::new(), Vec::new());
        for (number, person) in persons.iter().enumerate() {
            let skin = skin_of(number);
            let of_finger = |problem| announced::of_finger(hello, number, problem);
            let (its_form, its_sections) = laid_out(skin);
            if its_form.size() != form.size() || its_sections != sections {
                return Err(announced::other_vertices(hello, number, [skin_of(0), skin]));
            }
            let chosen = choose(number)?;
            let model = model_of(input, skin).map_err(of_finger)?;
            if let Some(warning) = chosen.iter().find_map(|chosen| chosen.warning.as_ref())
                && !warnings.contains(warning)
            {
                warnings.push(warning.clone());
            }
            methods.push(chosen.as_ref().map(|chosen| chosen.method));
            let solved = chosen.as_ref().zip(model);
            let finger = Finger::new(hello, its_form, skin, solved, objects.clone(), *person);
            fingers.push(Arc::new(Mutex::new(finger.map_err(of_finger)?)));
        }
        warnings.extend(announced::traction_without_sed(hello, skin_of(0)));
        Ok(Self { form, methods, fingers, sections, warnings })
    }

    /// How pressure is found of the first finger; none where frames are pressure.
    #[must_use]
    pub fn method(&self) -> Option<ContactMethod> {
        self.method_of(0)
    }

    /// How pressure is found of a finger by its number; none where frames are pressure.
    #[must_use]
    pub fn method_of(&self, number: usize) -> Option<ContactMethod> {
        self.methods.get(number).copied().flatten()
    }

    /// What of the hello is met, but perhaps not as it was meant.
    #[must_use]
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// Which frames the session takes.
    #[must_use]
    pub fn form(&self) -> FrameForm {
        self.form
    }

    /// The fingers, by their numbers.
    #[must_use]
    pub fn fingers(&self) -> &[Arc<Mutex<Finger>>] {
        &self.fingers
    }

    /// What comes first in the payload of an answer: what [`Finger::write`] puts there, then, if the
    /// hello asks for it, an [`ErrorEstimate`](papilla_proto::ErrorEstimate), which whoever renders
    /// appends.
    #[must_use]
    pub fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// Bytes of these sections, a multiple of 16.
    #[must_use]
    pub fn sections_len(&self) -> usize {
        self.sections
            .last()
            .map_or(0, |s| (s.offset + s.bytes) as usize - HEADER_LEN)
            .next_multiple_of(16)
    }
}

/// The contact model of a skin; none where frames are pressure.
fn model_of(input: Input, skin: Skin<'_>) -> Result<Option<&Arc<ContactModel>>, Problem> {
    if input == Input::Pressure {
        return Ok(None);
    }
    let Some(model) = skin.model else {
        let message = "this service has no contact model, since its folder of models has no \
                       finger.contact; put one there, start it with --contact FILE, or send \
                       pressure";
        return Err(unusable("input", message));
    };
    model.require_atlas(skin.atlas.hash()).map_err(|e| unusable("input", e.to_string()))?;
    Ok(Some(model))
}

fn sections(hello: &Hello, input: Input, vertices: usize) -> Vec<Section> {
    let samples = |layout: SampleLayout| match layout {
        SampleLayout::Map => MAP_LEN,
        SampleLayout::Vertices => vertices,
    };
    let touch = (input != Input::Pressure).then_some(TOUCH_LEN);
    let pressure = hello.pressure.map(|layout| 4 * samples(layout));
    let mut offset = HEADER_LEN;
    let mut sections = Vec::new();
    let shear = (hello.shear == Some(true)).then_some(12 * vertices);
    let displacement = (hello.displacement == Some(true)).then_some(12 * vertices);
    let all = [
        (SectionName::Touch, touch),
        (SectionName::Pressure, pressure),
        (SectionName::Shear, shear),
        (SectionName::Displacement, displacement),
        (
            SectionName::ErrorEstimate,
            (hello.error_estimate == Some(true)).then_some(ERROR_ESTIMATE_LEN),
        ),
    ];
    for (name, bytes) in all {
        let Some(bytes) = bytes else { continue };
        sections.push(Section { name, offset: offset as u32, bytes: bytes as u32 });
        offset = (offset + bytes).next_multiple_of(16);
    }
    sections
}
