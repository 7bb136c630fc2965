//! A frame on pixels, and a search for a net force, end within their budget of work.

use crate::support::{Finger, Throw, atlas};
use papilla_atlas::{Patch, Raster};
use papilla_contact::{
    Contact, NetForce, Object, PixelContact, PixelSkin, PixelSpacing, Settings, Solver, WORK_MAX,
};
use papilla_sdf::{AnyOf, Placed, Placement, SignedDistance, Sphere};
use std::sync::Arc;

fn skin(finger: &Finger) -> Arc<PixelSkin> {
    let atlas = atlas();
    let raster = Arc::new(Raster::new(&atlas, Patch::Skin));
    Arc::new(PixelSkin::new(&finger.model, &atlas, raster).expect("layers"))
}

fn pressed(finger: &Finger, skin: &Arc<PixelSkin>) -> (Solver, PixelContact, Contact) {
    let solver = Solver::new(finger.model.clone(), Settings::default()).expect("a solver");
    let pixels = PixelContact::new(Arc::clone(skin), &finger.model, PixelSpacing::One);
    (solver, pixels, Contact::new(finger.model.vertices()))
}

/// Sixteen unions of 64 balls through each other, as a hello may announce them.
fn balls(finger: &Finger) -> Vec<Object> {
    let ball = |i: usize| {
        let [x, y] = [i % 8, i / 8].map(|k| 0.8 * k as f64 - 2.8);
        let mut placement = Placement::turned(0.0, 0.0, 0.0, [0.0; 3]);
        placement.origin_mm = [x, y, 0.0];
        Placed { part: Arc::new(Sphere { radius_mm: 0.5 }), placement }
    };
    let union = AnyOf::new((0..64).map(ball).collect());
    assert!(16.0 * union.cost() <= 512.0, "{}", union.cost());
    let shape: (Arc<dyn SignedDistance>, f64) = (Arc::new(union), 0.5);
    let throw = |i: u8| Throw {
        vertex: finger.lowest(),
        depth_mm: 0.8 + 0.02 * f64::from(i),
        tilt_deg: [f64::from(i) - 8.0, 0.5 * f64::from(i)],
        spin_deg: 7.0 * f64::from(i),
    };
    (0..16).map(|i| finger.place(&shape, throw(i))).collect()
}

#[test]
fn a_frame_of_costly_shapes_on_pixels_keeps_its_budget() {
    let finger = Finger::new();
    let (skin, objects) = (skin(&finger), balls(&finger));
    let of_two = [0, 1].map(|_| {
        let (mut solver, mut pixels, mut out) = pressed(&finger, &skin);
        solver.solve_on_pixels(&objects, &mut pixels, &mut out).expect("an answer");
        // What it is in when the budget is used is ended.
        assert!(out.effort.work >= WORK_MAX, "never at its budget: {:?}", out.effort);
        assert!(out.effort.work < 2 * WORK_MAX, "{:?}", out.effort);
        assert!(!out.quality.settled, "{:?}", out.quality);
        assert!(pixels.map_pa().iter().all(|p| p.is_finite() && *p >= 0.0));
        (out, pixels.map_pa().to_vec())
    });
    let [a, b] = &of_two;
    assert!(a == b, "another answer the second time");
}

/// A wide contact holds the compliance between all vertices that may touch: what is read for it counts,
/// beside distances and products.
#[test]
fn a_first_frame_counts_what_it_reads() {
    let finger = Finger::new();
    let wide: (Arc<dyn SignedDistance>, f64) = (Arc::new(Sphere { radius_mm: 40.0 }), 40.0);
    let vertex = finger.lowest();
    let throw = Throw { vertex, depth_mm: 0.02, tilt_deg: [0.0; 2], spin_deg: 0.0 };
    let mut solver = Solver::new(finger.model.clone(), Settings::default()).expect("a solver");
    let mut out = Contact::new(finger.model.vertices());
    let object = [finger.place(&wide, throw)];
    let [first, next] = [0, 1].map(|_| {
        solver.solve(&object, &mut out).expect("an answer");
        out.effort
    });
    let held = u64::from(first.candidates);
    let told = format!("{first:?} {next:?}");
    assert!(held > 50 && first.work > next.work, "{told}");
    // Nine components of each pair, in a row and in a column.
    let read = 9 * held * (held + 1);
    let distances = 25 * u64::from(first.distances);
    assert!(first.work >= read + distances, "{told}");
    // Products are too few to make up for it.
    assert!(read > u64::from(first.products) * held.pow(2), "{told}");
}

/// Beside the finger and deep in it, and among costly shapes, where each frame tried has nearly all of it.
#[test]
fn a_search_for_a_net_force_has_one_budget() {
    let finger = Finger::new();
    let skin = skin(&finger);
    let ball = |origin_mm| {
        let mut placement = Placement::turned(0.0, 0.0, 0.0, [0.0; 3]);
        placement.origin_mm = origin_mm;
        vec![Object::rigid(Arc::new(Sphere { radius_mm: 10.0 }), placement)]
    };
    let scenes = [
        (ball([11.25, 0.0, 0.0]), 1.0),
        (ball([0.0, 0.0, -16.0]), 1e30),
        (balls(&finger), 0.5),
        (balls(&finger), 2.0),
    ];
    for (objects, force_n) in scenes {
        let (mut solver, mut pixels, mut out) = pressed(&finger, &skin);
        let net = NetForce { direction: [0.0, 0.0, 1.0], force_n };
        let found = solver.solve_for_force_on_pixels(&objects, net, &mut pixels, &mut out);
        let told = format!("{force_n} N: {found:?} {:?} {:?}", out.effort, out.quality);
        assert!(out.effort.work < 2 * WORK_MAX, "{told}");
        // What it has by then is told, and that it is not the force that was wanted.
        assert!(out.effort.work < WORK_MAX || (found.is_ok() && !out.quality.settled), "{told}");
    }
}
