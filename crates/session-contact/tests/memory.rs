//! What a finger takes at most, counted by the allocator: the figure that `papilla-server check`,
//! `--help` and the pages name.
//!
//! A test binary of its own, since an allocator serves a whole process.

// An allocator is unsafe by its nature; this one hands everything to the system's.
#![allow(unsafe_code)]
#![allow(clippy::unwrap_used)]

use std::{
    alloc::{GlobalAlloc, Layout, System},
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
};

use bytes::BytesMut;
use papilla_contact::{ContactModel, InterfaceSkin, PixelSkin};
use papilla_proto::{
    HEADER_LEN, Hello, MAP_LEN, SampleType,
    atlas::{Atlas, Patch, Raster},
    contact::{AnnouncedObject, ContactMethod, Input, Pose, SampleLayout},
    sdf::{AnnouncedShape, Sphere},
};
use papilla_session_contact::{FINGER_BYTES_MAX, Frame, Hand, Skin};

struct Counting;

static LIVE: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every method hands its arguments on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        LIVE.fetch_add(layout.size(), Ordering::Relaxed);
        // SAFETY: as the caller promised.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        LIVE.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as the caller promised.
        unsafe { System.dealloc(place, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn live() -> usize {
    LIVE.load(Ordering::Relaxed)
}

/// A ball that covers all of the pad.
fn ball(friction: Option<f64>) -> AnnouncedObject {
    let shape = AnnouncedShape::Sphere(Sphere { radius_mm: 200.0 });
    AnnouncedObject { shape, stiffness_mpa_per_mm: None, friction }
}

/// The dearest hellos of each kind.
fn hellos() -> Vec<(&'static str, Hello)> {
    let of = |method, friction, members: Hello| Hello {
        input: Some(Input::Objects),
        objects: Some(vec![ball(friction)]),
        method: Some(method),
        stiffness: Some(true),
        pressure: Some(SampleLayout::Map),
        ..members
    };
    let rough = || Hello {
        shear: Some(true),
        effects: vec!["shear_energy".to_owned()],
        ..Hello::default()
    };
    let gaps = Hello {
        objects: None,
        input: Some(Input::Gaps),
        input_layout: Some(SampleLayout::Vertices),
        friction: Some(0.5),
        velocity: Some(true),
        ..of(ContactMethod::SecondOrder, None, rough())
    };
    vec![
        ("springs", of(ContactMethod::Springs, None, Hello::default())),
        ("second order", of(ContactMethod::SecondOrder, None, Hello::default())),
        ("friction", of(ContactMethod::SecondOrder, Some(0.5), rough())),
        ("friction, small strain", of(ContactMethod::SmallStrain, Some(0.5), rough())),
        ("gaps", gaps),
        ("pixels", of(ContactMethod::Pixels, None, Hello::default())),
        ("coarse pixels", of(ContactMethod::CoarsePixels, None, Hello::default())),
    ]
}

#[test]
fn no_finger_takes_more_than_is_said() {
    let models = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models");
    let atlas = std::fs::read_to_string(format!("{models}/atlas.json")).unwrap();
    let atlas = Atlas::from_json(&atlas).unwrap();
    let raster = Arc::new(Raster::new(&atlas, Patch::Skin));
    let model = std::fs::read(format!("{models}/finger.contact")).unwrap();
    let model = Arc::new(ContactModel::read(&model).unwrap());
    let pixels = PixelSkin::new(&model, &atlas, Arc::clone(&raster)).map(Arc::new);
    let interface = InterfaceSkin::new(&model, &atlas, Arc::clone(&raster)).map(Arc::new);
    let skin = Skin {
        atlas: &atlas,
        raster: &raster,
        model: Some(&model),
        pixels: pixels.as_ref(),
        interface: interface.as_ref(),
        errors: None,
        model_sha256: None,
    };
    let lowest = model.lowest_mm().map(|v| v as f32);
    let vertices = model.vertices();
    let mut greatest = 0;
    for (name, hello) in hellos() {
        // What all fingers share is made by the first.
        for is_first in [true, false] {
            let before = live();
            let hand = Hand::of(&hello, skin).unwrap();
            let mut finger = hand.fingers()[0].lock().unwrap();
            let mut map_pa = vec![0.0; MAP_LEN];
            let mut bytes = BytesMut::zeroed(HEADER_LEN);
            for step in 1..=6u64 {
                let depth = 0.4 * step as f32;
                let payload: Vec<u8> = if hello.objects.is_some() {
                    let at = [lowest[0] + 0.02 * step as f32, lowest[1], lowest[2] + depth - 200.0];
                    Pose { origin_mm: at, ..Pose::default() }.encode().to_vec()
                } else {
                    let depths = std::iter::repeat_n(depth, vertices);
                    let moves = (0..vertices).flat_map(|_| [2.0, 0.0, 0.0]);
                    depths.chain(moves).flat_map(f32::to_le_bytes).collect()
                };
                let (sample_type, time_us) = (SampleType::F32, 11_111 * step);
                let frame = Frame { payload: &payload, sample_type, scale: 1.0, time_us };
                finger.take(frame, Some(&mut map_pa)).unwrap();
                bytes.truncate(HEADER_LEN);
                finger.write(&mut bytes);
            }
            let aside = 4 * map_pa.capacity() + bytes.capacity();
            let taken = live() - before - aside;
            if !is_first {
                println!("{name}: {:.1} MiB", taken as f64 / f64::from(1 << 20));
                greatest = greatest.max(taken);
            }
        }
    }
    assert!(greatest <= FINGER_BYTES_MAX, "a finger takes {greatest} bytes");
    assert!(2 * greatest > FINGER_BYTES_MAX, "{greatest} bytes are far from what is said");
}
