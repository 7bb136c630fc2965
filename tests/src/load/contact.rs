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
/// How deep the ball goes, mm: down and up around this by that.
const DEPTH_MM: f32 = 0.5;
const SWING_MM: f32 = 0.3;
/// Time of one way down and up, s: the same touch at every rate. At most the ball moves by 4.7 mm/s,
/// which is 52 um from frame to frame at 90 Hz and 5 um at 1 kHz.
const CYCLE_S: f64 = 0.4;
/// Frames of a cycle, at any rate.
const FRAMES: [usize; 2] = [16, 4096];

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
pub(super) async fn poses(server: &str, rate_hz: f64) -> Result<(Encoded, String), LoadError> {
    let atlas: Atlas = get(server, "/v1/atlas").await?;
    let positions = &atlas.patch(Patch::Skin).positions_mm;
    let lowest = positions.iter().copied().min_by(|a, b| a[2].total_cmp(&b[2]));
    let [x, y, z] = lowest.unwrap_or_default();
    let frames = ((CYCLE_S * rate_hz).round() as usize).clamp(FRAMES[0], FRAMES[1]);
    let payloads = (0..frames).map(|frame| {
        let depth_mm = DEPTH_MM + SWING_MM * (TAU * frame as f32 / frames as f32).sin();
        let pose = Pose { origin_mm: [x, y, z - RADIUS_MM + depth_mm], ..Pose::default() };
        pose.encode().to_vec()
    });
    let payloads: Vec<_> = payloads.collect();
    let encoded = Encoded { sample_type: SampleType::F32, scale: 1.0, payloads };
    Ok((encoded, atlas.hash().to_owned()))
}
