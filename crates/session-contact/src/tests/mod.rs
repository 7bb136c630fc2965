use bytes::BytesMut;
use papilla_contact::{Arrays, Header, InterfaceSkin, Layer};
use papilla_proto::{
    FrameHeader, FrameKind, SampleType,
    atlas::{Patch, PatchVertices},
    contact::{
        AnnouncedFinger, AnnouncedObject, ContactErrors, ContactMethod, MethodError, MethodErrors,
        POSE_LEN, Pose, ROW, Spread, Touch,
    },
    flags,
    sdf::{AnnouncedShape, Mesh, Sphere},
};
use papilla_session_state::{Reader, Writer};

use super::*;

mod frames;
mod hellos;
mod presses;
mod rough;
mod traction;

const SIDE: usize = 19;

/// A plane finger, 0.1 mm a pixel, skin looking down, on a half-space.
struct Plane {
    atlas: Atlas,
    raster: Arc<Raster>,
    model: Arc<ContactModel>,
    pixels: Arc<PixelSkin>,
    interface: Arc<InterfaceSkin>,
}

impl Plane {
    fn new() -> Self {
        let at = |i: usize| [i % SIDE, i / SIDE].map(|k| 10.0 * k as f32 + 20.0);
        let uv_px: Vec<[f32; 2]> = (0..SIDE * SIDE).map(at).collect();
        let mut triangles = Vec::new();
        for y in 0..SIDE - 1 {
            for x in 0..SIDE - 1 {
                let (a, s) = ((y * SIDE + x) as u32, SIDE as u32);
                triangles.extend([[a, a + s, a + 1], [a + 1, a + s, a + s + 1]]);
            }
        }
        let positions_mm: Vec<[f32; 3]> =
            uv_px.iter().map(|[u, v]| [0.1 * (v - 110.0), -0.1 * (u - 110.0), 0.0]).collect();
        let patch = PatchVertices { positions_mm: positions_mm.clone(), uv_px };
        let atlas = Atlas::new(0.1, triangles.clone(), patch.clone(), patch).expect("an atlas");
        let header = Header {
            vertices: SIDE * SIDE,
            triangles: triangles.len(),
            share_max: 1.0,
            layers: [0.2, 98.8]
                .map(|thickness_mm| Layer { young_mpa: 0.15, poisson: 0.49, thickness_mm })
                .to_vec(),
            atlas_hash: atlas.hash().to_owned(),
            ..Header::current()
        };
        let arrays = Arrays::half_space(
            positions_mm.into_flattened(),
            (0..SIDE * SIDE).flat_map(|_| [0.0, 0.0, -1.0]).collect(),
            vec![1.0; SIDE * SIDE],
            triangles.into_flattened(),
            0.2,
        );
        let model = Arc::new(ContactModel::new(header, arrays).expect("a model"));
        let raster = Arc::new(Raster::new(&atlas, Patch::Skin));
        let pixels = PixelSkin::new(&model, &atlas, Arc::clone(&raster)).expect("layers");
        let interface = InterfaceSkin::new(&model, &atlas, Arc::clone(&raster)).expect("layers");
        Self { atlas, raster, model, pixels: Arc::new(pixels), interface: Arc::new(interface) }
    }

    fn hand(&self, hello: &Hello) -> Result<Hand, Problem> {
        let Self { atlas, raster, model, pixels, interface } = self;
        let (model, pixels, interface) = (Some(model), Some(pixels), Some(interface));
        Hand::of(
            hello,
            Skin { atlas, raster, model, pixels, interface, errors: None, model_sha256: None },
        )
    }
}

fn ball(radius_mm: f64) -> AnnouncedObject {
    let shape = AnnouncedShape::Sphere(Sphere { radius_mm });
    AnnouncedObject { shape, stiffness_mpa_per_mm: None, friction: None }
}

fn objects() -> Hello {
    Hello { input: Some(Input::Objects), objects: Some(vec![ball(20.0)]), ..Hello::default() }
}

fn rough(friction: f64) -> Hello {
    Hello {
        objects: Some(vec![AnnouncedObject { friction: Some(friction), ..ball(20.0) }]),
        shear: Some(true),
        ..objects()
    }
}

fn pose(depth_mm: f32) -> [u8; POSE_LEN] {
    Pose { origin_mm: [0.0, 0.0, depth_mm - 20.0], ..Pose::default() }.encode()
}

/// Gives what a hand's first finger remembers to another's.
fn carry(from: &Hand, to: &Hand) {
    let mut state = Writer::default();
    from.fingers()[0].lock().expect("no panic").save(&mut state);
    let state = state.finish();
    let mut reader = Reader::new(&state);
    to.fingers()[0].lock().expect("no panic").restore(&mut reader).expect("its state");
    reader.end().expect("nothing more");
}

fn frame(payload: &[u8], time_us: u64) -> Frame<'_> {
    Frame { payload, sample_type: SampleType::F32, scale: 1.0, time_us }
}

fn touch(hand: &Hand, finger: usize, payload: &[u8]) -> Result<(Touch, Taken), Problem> {
    let mut finger = hand.fingers()[finger].lock().expect("no panic");
    let mut map_pa = vec![0.0; MAP_LEN];
    let taken = finger.take(frame(payload, 0), Some(&mut map_pa))?;
    let mut bytes = BytesMut::zeroed(HEADER_LEN);
    finger.write(&mut bytes);
    assert_eq!(bytes.len(), HEADER_LEN + hand.sections_len());
    let peak = map_pa.iter().copied().fold(0.0, f32::max);
    assert!(peak <= 1.0001 * taken.peak_pa, "{peak} {taken:?}");
    Ok((Touch::decode(&bytes[HEADER_LEN..]).expect("it lies there"), taken))
}
