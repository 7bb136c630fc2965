//! Poses in place of maps: what is sent and asked for.

use std::f32::consts::TAU;

use clap::ValueEnum;
use papilla_proto::{
    Hello, SampleType,
    atlas::{Atlas, Patch},
    contact::{AnnouncedFinger, AnnouncedObject, ContactMethod, Input, Pose, SampleLayout},
    effects::RuntimeEffect,
    sdf::{AnnouncedShape, Sphere},
};

use super::{LoadError, content::Encoded, content::get};

const RADIUS_MM: f32 = 10.0;
/// How deep the ball goes, mm: up and down around this by that, in so many frames.
const DEPTH_MM: f32 = 0.5;
const SWING_MM: f32 = 0.3;
const FRAMES: usize = 64;

/// What answers carry, beside what pushes back.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Contact {
    /// Nothing: no network is asked.
    Touch,
    /// The summary of SED.
    Summary,
    /// SED at the atlas' vertices.
    Vertices,
}

impl Contact {
    /// Puts into a hello what it takes.
    pub(super) fn ask(self, fingers: u8, method: Option<ContactMethod>, hello: &mut Hello) {
        hello.method = method;
        let shape = AnnouncedShape::Sphere(Sphere { radius_mm: f64::from(RADIUS_MM) });
        // Poses are f32; --sample-type is that of the answers.
        hello.answer_sample_type = Some(hello.sample_type);
        hello.sample_type = SampleType::F32;
        hello.input = Some(Input::Objects);
        let object = AnnouncedObject { shape, stiffness_mpa_per_mm: None, friction: None };
        hello.objects = Some(vec![object]);
        hello.fingers = Some(vec![AnnouncedFinger::default(); fingers.into()]);
        hello.map = Some(self == Self::Vertices);
        hello.answer_layout = (self == Self::Vertices).then_some(SampleLayout::Vertices);
        if self == Self::Summary {
            hello.effects = vec![RuntimeEffect::Summary.to_string()];
        }
    }
}

/// A ball under the pad that goes down and up, and the hash of the atlas.
pub(super) async fn poses(server: &str) -> Result<(Encoded, String), LoadError> {
    let atlas: Atlas = get(server, "/v1/atlas").await?;
    let positions = &atlas.patch(Patch::Skin).positions_mm;
    let lowest = positions.iter().copied().min_by(|a, b| a[2].total_cmp(&b[2]));
    let [x, y, z] = lowest.unwrap_or_default();
    let payloads = (0..FRAMES).map(|frame| {
        let depth_mm = DEPTH_MM + SWING_MM * (TAU * frame as f32 / FRAMES as f32).sin();
        let pose = Pose { origin_mm: [x, y, z - RADIUS_MM + depth_mm], ..Pose::default() };
        pose.encode().to_vec()
    });
    let payloads: Vec<_> = payloads.collect();
    let encoded = Encoded { sample_type: SampleType::F32, scale: 1.0, payloads };
    Ok((encoded, atlas.hash().to_owned()))
}
