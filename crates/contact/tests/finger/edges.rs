//! Answers that may be wrong are told: bodies that are in the finger at once, edges between vertices and
//! pixels, and what nothing is found to press by.

use crate::deep::{Pressed, Way, skin};
use crate::support::{Finger, Throw};
use papilla_atlas::{Atlas, Patch, Raster};
use papilla_contact::{Arrays, Method, Object, PixelSkin, PixelSpacing, Quality};
use papilla_sdf::{Cylinder, Grating, Placement, RoundedPlate, SignedDistance, Sphere, Wedge};
use std::sync::Arc;

type Shape = (Arc<dyn SignedDistance>, f64);

const WAYS: [Way; 3] = [
    Way::AtVertices(Method::SecondOrder),
    Way::OnPixels(PixelSpacing::Two),
    Way::OnPixels(PixelSpacing::One),
];

fn plate(half_mm: [f64; 3], edge_radius_mm: f64) -> Shape {
    (Arc::new(RoundedPlate { half_mm, edge_radius_mm }), half_mm[2])
}

fn size(force_n: [f64; 3]) -> f64 {
    force_n.iter().map(|f| f * f).sum::<f64>().sqrt()
}

/// A card that was out of use, or never seen, and is in the finger at once: it presses as a thick plate
/// with the same face does, or the answer says that it may not.
#[test]
fn a_card_that_is_in_the_finger_at_once_presses_as_a_plate_or_is_flagged() {
    let finger = Finger::new();
    let skin = skin(&finger);
    let trusted_mm = f64::from(finger.model.header().depth_max_mm);
    let thick = plate([10.0, 10.0, 4.0], 0.09);
    let mut random = fastrand::Rng::with_seed(81);
    let (inner, mut silent) = (finger.inner(), 0);
    let flanks = (0..finger.places_mm.len()).filter(|v| finger.normals[*v][2] < -0.2);
    let flanks: Vec<usize> = flanks.collect();
    for case in 0..24 {
        let card = plate([10.0, 10.0, [0.15, 0.15, 0.38, 0.5][case % 4]], 0.09);
        let vertex = match case {
            0..4 => finger.lowest(),
            4..12 => inner[random.usize(..inner.len())],
            _ => flanks[random.usize(..flanks.len())],
        };
        let depth_mm = trusted_mm * (0.2 + 0.7 * random.f64());
        let throw = Throw { vertex, depth_mm, tilt_deg: [0.0; 2], spin_deg: 0.0 };
        let [object, due] = [&card, &thick].map(|shape| [finger.place(shape, throw)]);
        let away = Placement { origin_mm: [1000.0, 0.0, 0.0], ..object[0].placement };
        for way in WAYS {
            let mut pressed = Pressed::new(&finger, &skin, way);
            pressed.press(&due);
            let (due_n, is_due_told) = (size(pressed.out.force_n), pressed.is_told());
            for parked in [false, true] {
                let mut pressed = Pressed::new(&finger, &skin, way);
                if parked {
                    pressed.press(&[Object { placement: away, ..object[0].clone() }]);
                }
                // It lasts while the pose does.
                for frame in 0..3 {
                    pressed.press(&object);
                    let found_n = size(pressed.out.force_n);
                    let is_right = (found_n / due_n - 1.0).abs() < 0.1;
                    silent += usize::from(!pressed.is_told());
                    assert!(
                        is_right || is_due_told || pressed.is_told(),
                        "{case}, {way:?}, parked {parked}, frame {frame}: {found_n} N, {due_n} N \
                         due, {throw:?}, {} mm thick",
                        2.0 * card.1
                    );
                }
            }
        }
    }
    println!("{silent} of {} answers are not flagged", 24 * 3 * 2 * 3);
    assert!(silent > 0);
}

/// An edge along the finger's plane of symmetry has no force across it, or the answer says so.
#[test]
fn an_edge_in_the_plane_of_symmetry_pushes_nothing_aside_silently() {
    let finger = Finger::new();
    let skin = skin(&finger);
    let lowest = finger.places_mm[finger.lowest()];
    let (mut told, mut all) = (0, 0);
    for edge_radius_mm in [0.001, 0.05, 0.1, 0.2, 0.5] {
        let cube: Arc<dyn SignedDistance> =
            Arc::new(RoundedPlate { half_mm: [4.0; 3], edge_radius_mm });
        for (way, depth_mm) in WAYS.into_iter().flat_map(|w| [0.3, 0.6, 0.9].map(|d| (w, d))) {
            let turn = Placement::turned(45.0, 0.0, 0.0, [0.0; 3]);
            let top = cube.reach_mm([0.0, 0.5f64.sqrt(), 0.5f64.sqrt()]);
            let at = |y: f64| {
                let origin_mm = [lowest[0], y, lowest[2] + depth_mm - top];
                [Object::rigid(cube.clone(), Placement { origin_mm, ..turn })]
            };
            for from in [0.0, -0.4, 0.4] {
                let mut pressed = Pressed::new(&finger, &skin, way);
                for step in 0..=20 {
                    let part = 1.0 - f64::from(step) / 20.0;
                    pressed.press(&at(from * part));
                    if from == 0.0 {
                        break;
                    }
                }
                let [_, y, z] = pressed.out.force_n;
                all += 1;
                told += usize::from(pressed.is_told());
                assert!(
                    pressed.is_told() || y.abs() < 0.31 * z + 1e-3,
                    "{way:?}, edge {edge_radius_mm}, {depth_mm} mm, from {from}: {y} across {z} N"
                );
            }
        }
    }
    println!("{told} of {all} are flagged");
    assert!(told > 0);
}

/// A blade, and the edge of a block, that pass over the finger's plane of symmetry: on pixels their force
/// goes along the skin's normal, is none across the plane when they are in it, and has no jumps.
#[test]
fn on_pixels_a_sharp_edge_pushes_along_the_skin() {
    let finger = Finger::new();
    let skin = skin(&finger);
    let lowest = finger.places_mm[finger.lowest()];
    let block = RoundedPlate { half_mm: [4.0; 3], edge_radius_mm: 0.02 };
    let shapes: [(Arc<dyn SignedDistance>, f64); 2] =
        [(Arc::new(Wedge::default()), 0.0), (Arc::new(block), 45.0)];
    for (shape, turned_deg) in shapes {
        let turn = Placement::turned(turned_deg, 0.0, 0.0, [0.0; 3]);
        let top = shape.reach_mm([0, 1, 2].map(|i| turn.rotation[2][i]));
        for (way, depth_mm) in WAYS[1..].iter().flat_map(|w| [0.4, 0.9].map(|d| (*w, d))) {
            let mut pressed = Pressed::new(&finger, &skin, way);
            let mut last: Option<[f64; 3]> = None;
            for step in -15..=10 {
                let y = 0.02 * f64::from(step);
                let origin_mm = [lowest[0], y, lowest[2] + depth_mm - top];
                pressed.press(&[Object::rigid(shape.clone(), Placement { origin_mm, ..turn })]);
                let force_n = pressed.out.force_n;
                let told = format!("{way:?}, {depth_mm} mm, {y}: {force_n:?}, before {last:?}");
                assert!(!pressed.out.quality.is_aside, "{told}");
                assert!(step != 0 || force_n[1].abs() < 0.05 * force_n[2], "{told}");
                assert!(force_n[1].abs() < 0.15 * force_n[2], "{told}");
                // The first frames come from nothing.
                if let (Some(last), true) = (last, step > -10) {
                    let by = size([0, 1, 2].map(|i| force_n[i] - last[i]));
                    assert!(by < 0.15 * size(force_n), "jumps: {told}");
                }
                last = Some(force_n);
            }
        }
    }
}

/// Where ridges of a fine grating lie between the vertices, methods at vertices press far too little: that is
/// told, and nothing of the kind is told of a plate.
#[test]
fn what_lies_between_vertices_is_told() {
    let read = |name: &str| {
        std::fs::read(format!("{}/../../models/{name}", env!("CARGO_MANIFEST_DIR")))
            .expect("a file")
    };
    let finger = Finger::of(Arrays::read(&read("finger.contact")).expect("a model"));
    let atlas = String::from_utf8(read("atlas.json")).expect("text");
    let atlas = Atlas::from_json(&atlas).expect("an atlas");
    let raster = Arc::new(Raster::new(&atlas, Patch::Skin));
    let skin = Arc::new(PixelSkin::new(&finger.model, &atlas, raster).expect("layers"));
    let fine = |ridge_mm: f64| -> Shape {
        let groove_mm = 0.9 - ridge_mm;
        let of = Grating { ridges: 12, ridge_mm, groove_mm, height_mm: 1.5, ..Grating::default() };
        (Arc::new(Grating { edge_radius_mm: 0.02, ..of }), 0.0)
    };
    let plate = plate([10.0, 10.0, 3.0], 1.0);
    let (mut weak, mut all) = (0, 0);
    for (shape, is_fine) in [(&fine(0.3), true), (&plate, false)] {
        for (spin_deg, depth_mm) in
            [0.0, 20.0, 40.0, 70.0, 90.0].into_iter().flat_map(|spin| [(spin, 0.4), (spin, 0.7)])
        {
            let throw = Throw { vertex: finger.lowest(), depth_mm, tilt_deg: [3.0, 0.0], spin_deg };
            let object = [finger.place(shape, throw)];
            let [rough, exact] = [WAYS[0], WAYS[2]].map(|way| {
                let mut pressed = Pressed::new(&finger, &skin, way);
                pressed.press(&object);
                pressed
            });
            let [rough_n, exact_n] = [&rough, &exact].map(|pressed| size(pressed.out.force_n));
            let told = format!("{throw:?}: {rough_n} N, {exact_n} N, {:?}", rough.out.quality);
            assert!(rough_n > 0.6 * exact_n || rough.is_told(), "silent: {told}");
            assert!(is_fine || !rough.is_told(), "a plate: {told}");
            weak += usize::from(is_fine && rough_n < 0.6 * exact_n);
            all += usize::from(is_fine && rough.is_told());
        }
    }
    println!("{weak} of 10 press too little, {all} are flagged");
    assert!(weak > 0);
}

/// What is blunt is not taken for an edge or for something missed, in the air, at its first touch and
/// after it.
#[test]
fn blunt_bodies_are_neither_aside_nor_missed() {
    let finger = Finger::new();
    let skin = skin(&finger);
    let shapes: [Shape; 7] = [
        plate([10.0, 10.0, 3.0], 1.0),
        plate([4.0, 4.0, 4.0], 0.5),
        plate([0.5, 6.0, 4.0], 0.3),
        (Arc::new(Sphere { radius_mm: 2.0 }), 2.0),
        (Arc::new(Sphere { radius_mm: 6.0 }), 6.0),
        (Arc::new(Cylinder { radius_mm: 1.0, length_mm: 20.0, end_radius_mm: 0.5 }), 1.0),
        (Arc::new(Cylinder { radius_mm: 3.0, length_mm: 20.0, end_radius_mm: 1.0 }), 3.0),
    ];
    let inner = finger.inner();
    let mut random = fastrand::Rng::with_seed(82);
    let mut counts = [[0; 3]; 3];
    for case in 0..140 {
        let throw = Throw {
            vertex: inner[random.usize(..inner.len())],
            depth_mm: 0.0,
            tilt_deg: [0, 1].map(|_| 40.0 * random.f64() - 20.0),
            spin_deg: 360.0 * random.f64(),
        };
        for (way, count) in WAYS.into_iter().zip(&mut counts) {
            let mut pressed = Pressed::new(&finger, &skin, way);
            for depth_mm in [-0.4, -0.1, 0.05, 0.2, 0.5, 0.8] {
                let throw = Throw { depth_mm, ..throw };
                pressed.press(&[finger.place(&shapes[case % shapes.len()], throw)]);
                let Quality { is_aside, is_missed, .. } = pressed.out.quality;
                count[0] += 1;
                count[1] += usize::from(is_aside);
                count[2] += usize::from(is_missed);
            }
        }
    }
    println!("frames, aside, missed: {counts:?}");
    for [all, aside, missed] in counts {
        assert!(50 * aside < all && 200 * missed < all, "{counts:?}");
    }
}

/// Bodies in the finger by which nothing is found to press: in its back, and between vertices or pixels.
#[test]
fn no_body_in_the_finger_is_taken_for_air() {
    let finger = Finger::new();
    let skin = skin(&finger);
    let lowest = finger.places_mm[finger.lowest()];
    // One that runs away is refused.
    let is_silent = |pressed: &Pressed| {
        let quality = pressed.out.quality;
        let is_air = size(pressed.out.force_n) == 0.0 && !quality.is_held && !quality.is_missed;
        assert!(!quality.is_missed || quality.out_of_range, "{quality:?}");
        is_air && !pressed.is_told()
    };
    let ball: Shape = (Arc::new(Sphere { radius_mm: 5.0 }), 5.0);
    for (shape, top) in [ball, plate([30.0, 30.0, 3.0], 1.0)] {
        for way in WAYS {
            let mut pressed = Pressed::new(&finger, &skin, way);
            for step in -4..12 {
                // From above, onto the back and into it.
                let depth_mm = 0.25 * f64::from(step);
                let turn = Placement::turned(180.0, 0.0, 0.0, [0.0; 3]);
                let origin_mm = [lowest[0], lowest[1], -lowest[2] - depth_mm + top];
                pressed.press(&[Object::rigid(shape.clone(), Placement { origin_mm, ..turn })]);
                let told = format!("{way:?}, {depth_mm} mm: {:?}", pressed.out.quality);
                assert!(depth_mm < 1.0 || !is_silent(&pressed), "air: {told}");
                assert!(depth_mm > 0.0 || is_silent(&pressed), "not air: {told}");
            }
        }
    }
    let [turn, plain] = [45.0, 0.0].map(|tilt| Placement::turned(tilt, 0.0, 0.0, [0.0; 3]));
    let cube: Arc<dyn SignedDistance> =
        Arc::new(RoundedPlate { half_mm: [4.0; 3], edge_radius_mm: 0.001 });
    let wire: Arc<dyn SignedDistance> =
        Arc::new(Cylinder { radius_mm: 0.05, length_mm: 20.0, end_radius_mm: 0.04 });
    let needle: Arc<dyn SignedDistance> =
        Arc::new(RoundedPlate { half_mm: [0.05, 0.05, 8.0], edge_radius_mm: 0.04 });
    for (shape, turn) in [(cube, turn), (wire, plain), (needle, plain)] {
        let up = [0, 1, 2].map(|i| turn.rotation[2][i]);
        let top = shape.reach_mm(up);
        for (way, depth_mm) in WAYS.into_iter().flat_map(|w| [0.4, 0.9].map(|d| (w, d))) {
            for step in 0..16 {
                let [x, y] = [0.045, 0.06].map(|by| by * f64::from(step));
                let origin_mm = [lowest[0] + x, lowest[1] + y, lowest[2] + depth_mm - top];
                let mut pressed = Pressed::new(&finger, &skin, way);
                pressed.press(&[Object::rigid(shape.clone(), Placement { origin_mm, ..turn })]);
                let told = format!("{way:?}, {depth_mm} mm, {x}: {:?}", pressed.out.quality);
                assert!(!is_silent(&pressed), "air: {told}, {up:?}");
            }
        }
    }
}
