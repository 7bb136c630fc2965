//! A finger that is a plane of an elastic half-space, and frames for it.

use papilla_contact::{Arrays, Header, Layer};
use papilla_proto::{
    FrameHeader, FrameKind, SampleType,
    atlas::{Atlas, PatchVertices},
    contact::{Pose, ROW},
};
use papilla_server::Config;
use serde_json::{Value, json};

use super::{Service, hello, model_folder_on, write};

const SIDE: usize = 19;
/// E / (1 - nu^2), MPa.
pub(crate) const MODULUS_MPA: f32 = 0.2;
/// Radius of the ball that presses, mm.
pub(crate) const RADIUS_MM: f32 = 20.0;

/// Vertices every 10 px from 20 to 200 both ways, 1 mm apart; the middle at the origin.
pub(crate) fn atlas() -> Atlas {
    atlas_of(0.1)
}

/// The same with so many mm a pixel.
pub(crate) fn atlas_of(mm_per_px: f32) -> Atlas {
    let patch = |z: f32| {
        let at = |i: usize| [i % SIDE, i / SIDE].map(|k| 10.0 * k as f32 + 20.0);
        let uv_px: Vec<[f32; 2]> = (0..SIDE * SIDE).map(at).collect();
        let place = |&[u, v]: &[f32; 2]| [mm_per_px * (v - 110.0), -mm_per_px * (u - 110.0), z];
        PatchVertices { positions_mm: uv_px.iter().map(place).collect(), uv_px }
    };
    let mut triangles = Vec::new();
    for y in 0..SIDE - 1 {
        for x in 0..SIDE - 1 {
            let (a, s) = ((y * SIDE + x) as u32, SIDE as u32);
            triangles.extend([[a, a + s, a + 1], [a + 1, a + s, a + s + 1]]);
        }
    }
    Atlas::new(mm_per_px, triangles, patch(0.0), patch(0.5)).unwrap()
}

/// A service of this finger, with its contact model.
pub(crate) async fn service() -> Service {
    service_with(|_| ()).await
}

/// The same, with changes to the configuration.
pub(crate) async fn service_with(change: impl FnOnce(&mut Config)) -> Service {
    let folder = model_folder_on(&atlas());
    write(folder.path(), "finger.contact", &model());
    Service::on(folder, change).await.unwrap()
}

/// The contact model's file; its skin is deep, of two layers that are alike.
pub(crate) fn model() -> Vec<u8> {
    model_on(&atlas(), MODULUS_MPA)
}

/// The same on another atlas of as many vertices, with another E / (1 - nu^2).
pub(crate) fn model_on(atlas: &Atlas, modulus_mpa: f32) -> Vec<u8> {
    let young_mpa = 0.75 * f64::from(modulus_mpa);
    let layer = |thickness_mm| Layer { young_mpa, poisson: 0.5 - 1e-6, thickness_mm };
    file(atlas, modulus_mpa, vec![layer(0.2), layer(98.8)], Header::current())
}

/// One of a finger with this hash of dimensions and tissues.
pub(crate) fn model_of_finger(atlas: &Atlas, finger_sha256: &str) -> Vec<u8> {
    let header = Header { finger_sha256: finger_sha256.to_owned(), ..Header::current() };
    file(atlas, MODULUS_MPA, Vec::new(), header)
}

/// One that was made of the description with this hash.
pub(crate) fn model_described(atlas: &Atlas, finger_file_sha256: &str) -> Vec<u8> {
    let header = Header { finger_file_sha256: finger_file_sha256.to_owned(), ..Header::current() };
    file(atlas, MODULUS_MPA, Vec::new(), header)
}

/// [`model`] with other layers.
pub(crate) fn model_of(layers: Vec<Layer>) -> Vec<u8> {
    file(&atlas(), MODULUS_MPA, layers, Header::current())
}

fn file(atlas: &Atlas, modulus_mpa: f32, layers: Vec<Layer>, header: Header) -> Vec<u8> {
    let skin = atlas.patch(papilla_proto::atlas::Patch::Skin);
    let vertices = skin.positions_mm.len();
    let header = Header {
        vertices,
        triangles: atlas.triangles().len(),
        share_max: 1.0,
        layers,
        atlas_hash: atlas.hash().to_owned(),
        ..header
    };
    let arrays = Arrays::half_space(
        skin.positions_mm.as_flattened().to_vec(),
        (0..vertices).flat_map(|_| [0.0, 0.0, -1.0]).collect(),
        vec![1.0; vertices],
        atlas.triangles().as_flattened().to_vec(),
        modulus_mpa.into(),
    );
    arrays.to_bytes(&header).unwrap()
}

/// A hello for one ball, with more members.
pub(crate) fn ball_hello(members: &Value) -> Value {
    let mut hello = hello(&json!({
        "version": 3, "input": "objects",
        "objects": [{"shape": {"shape": "sphere", "radius_mm": RADIUS_MM}}],
    }));
    for (name, value) in members.as_object().unwrap() {
        hello[name] = value.clone();
    }
    hello
}

/// A frame of rows for a finger.
pub(crate) fn rows(sequence: u32, finger: u8, rows: &[Pose]) -> Vec<u8> {
    let header =
        FrameHeader::pressure(sequence, 1000 * u64::from(sequence), 0, SampleType::F32, 1.0);
    let header = header.of_finger(FrameKind::Objects, finger, [ROW as u16, rows.len() as u16]);
    let rows = rows.iter().flat_map(|row| row.encode());
    header.encode().iter().copied().chain(rows).collect()
}

/// The ball so deep in the skin.
pub(crate) fn deep(depth_mm: f32) -> Pose {
    Pose { origin_mm: [0.0, 0.0, depth_mm - RADIUS_MM], ..Pose::default() }
}

/// Hertz, N.
pub(crate) fn hertz_n(depth_mm: f32) -> f32 {
    4.0 / 3.0 * MODULUS_MPA * RADIUS_MM.sqrt() * depth_mm.powf(1.5)
}
