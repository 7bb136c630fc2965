//! Random objects in random places under the shipped finger, solved on pixels: what must hold for any
//! frame.

#[path = "../../../crates/contact/examples/poses/mod.rs"]
mod thrown;

use std::sync::Arc;

use papilla_contact::{
    Contact, Object, PixelContact, PixelSpacing, Quality, Settings, Solver, WORK_MAX,
};
use papilla_proto::{
    atlas::{Atlas, MAP_SIDE_PX, Patch, Raster},
    sdf::{Placement, RoundedPlate},
};

use crate::shipped::{folder, text};
use thrown::{DEPTH_MM, Pad, shapes};

/// Below this depth of a pixel, of places that are linear between vertices, contact is not missed, and
/// above this distance there is none, mm.
const CLEAR_MM: f64 = 0.05;
/// Linearisations at vertices, 16 steps of 3 and 25, twice if a frame starts anew; rounds on pixels.
const ITERATIONS_MAX: u32 = 2 * (16 * 3 + 25 + 12);

/// No missed contact, no pressure in air, no tension, bounded work, whatever comes.
fn throw_at(poses: usize, spacing: PixelSpacing) {
    let (pad, shapes) = (Pad::of(&folder("models")).unwrap(), shapes());
    let mut solver = Solver::new(Arc::clone(&pad.model), Settings::default()).unwrap();
    let mut pixels = PixelContact::new(Arc::clone(&pad.skin), &pad.model, spacing);
    let mut out = Contact::new(pad.model.vertices());
    let mut random = fastrand::Rng::with_seed(20);
    let (mut touching, mut unsettled, mut outside) = (0, 0, 0);
    // By shape, alone and no deeper than `DEPTH_MM`: poses, and those that did not settle.
    let mut by_shape = vec![[0; 2]; shapes.len()];
    let (mut objects, mut which) = (Vec::new(), 0);
    for pose in 0..poses {
        if pose == 0 || random.u8(..3) == 0 {
            objects.clear();
            for _ in 0..1 + usize::from(random.u8(..8) == 0) {
                which = random.usize(..shapes.len());
                objects.push(pad.throw(&mut random, &shapes[which]));
            }
        } else {
            objects[0].placement.origin_mm[2] += 0.1 * (random.f64() - 0.5);
        }
        let placed: Vec<Placement> = objects.iter().map(|o| o.placement).collect();
        solver.solve_on_pixels(&objects, &mut pixels, &mut out).unwrap();
        let told = format!("pose {pose} of {placed:?}, {:?} {:?}", out.quality, out.effort);
        assert!(pixels.map_pa().iter().all(|p| p.is_finite() && *p >= 0.0), "{told}");
        assert!(out.pressure_pa.iter().all(|p| p.is_finite() && *p >= 0.0), "{told}");
        let numbers = [&out.force_n[..], &out.torque_n_mm, &out.centre_mm].concat();
        assert!(numbers.iter().all(|v| v.is_finite()), "{told}");
        assert!(out.effort.iterations <= ITERATIONS_MAX, "{told}");
        let pressed = pixels.peak_pa() > 0.0;
        let clearances = objects.iter().map(|object| pad.clearance_mm(object));
        let nearest_mm = clearances.fold(f64::INFINITY, f64::min);
        assert!(pressed || nearest_mm > -CLEAR_MM, "missed by {nearest_mm} mm, {told}");
        // A held body presses from the side from which it came, wherever it is by now.
        let is_held = out.quality.is_held;
        assert!(
            !pressed || nearest_mm < CLEAR_MM || is_held,
            "pressure across {nearest_mm} mm, {told}"
        );
        touching += usize::from(pressed);
        unsettled += usize::from(pressed && !out.quality.settled);
        outside += usize::from(pressed && out.quality.out_of_range);
        if objects.len() == 1 && pressed && nearest_mm > -DEPTH_MM {
            by_shape[which][0] += 1;
            by_shape[which][1] += usize::from(!out.quality.settled);
        }
    }
    println!("{spacing:?}: {touching} of {poses} touch, {unsettled} unsettled, {outside} outside");
    println!("of each shape, and unsettled: {by_shape:?}");
    assert!(3 * touching > poses && 3 * unsettled < touching, "{touching} {unsettled}");
}

/// The rim of a wide plate far beside the pad: the forces of a first frame have a long way to go.
#[test]
fn a_plate_beside_the_map_settles_within_its_budget() {
    let pad = Pad::of(&folder("models")).unwrap();
    let plate = RoundedPlate { half_mm: [20.0, 20.0, 3.0], edge_radius_mm: 1.0 };
    let Placement { rotation, .. } = Placement::turned(0.0, 45.0, 0.0, [0.0; 3]);
    let (lowest, top) = (pad.model.lowest_mm(), [14.0, -16.0, 0.5]);
    let origin_mm = [0, 1, 2].map(|i| lowest[i] + top[i] - rotation[i][2] * plate.half_mm[2]);
    let object = Object::rigid(Arc::new(plate), Placement { rotation, origin_mm });
    let mut solver = Solver::new(Arc::clone(&pad.model), Settings::default()).unwrap();
    let mut out = Contact::new(pad.model.vertices());
    let mut pixels = PixelContact::new(Arc::clone(&pad.skin), &pad.model, PixelSpacing::One);
    solver.solve_on_pixels(&[object], &mut pixels, &mut out).unwrap();
    let told = format!("{:?} {:?}", out.quality, out.effort);
    println!("{told}");
    // It goes through the finger from the side of the nail, and the answer says so.
    let Quality { settled, is_aside, is_missed, .. } = out.quality;
    assert!((settled || is_aside) && is_missed && pixels.peak_pa() > 0.0, "{told}");
    assert!(out.effort.work < WORK_MAX / 4 * 3, "{told}");
}

/// A plate that reaches beyond the map: pixels go over into the vertices' pressure without a line.
/// Toward the hand, where they have no pressure to go over into, none stands before the last rows:
/// there a tilted plate and its image are a ridge, which vertices do not see and FE does.
#[test]
fn no_line_shows_where_the_map_ends() {
    let pad = Pad::of(&folder("models")).unwrap();
    let atlas = Atlas::from_json(&text(&folder("models").join("atlas.json"))).unwrap();
    let raster = Raster::new(&atlas, Patch::Skin);
    let (_, plate, half_mm) = &shapes()[0];
    let mut solver = Solver::new(Arc::clone(&pad.model), Settings::default()).unwrap();
    let mut out = Contact::new(pad.model.vertices());
    // Pixels near the edge, how the skin there is tilted, and the rows that are looked at. The first
    // plate and its image are a ridge in the map's last rows; the others' own rim is at row 180.
    for (row, column, tilt, rows) in
        [(150, 112, [-15.0, 0.0], 204), (112, 150, [0.0, -35.0], 165), (112, 62, [0.0, 45.0], 165)]
    {
        let depth_mm = 1.5;
        let at = raster.position_mm(&atlas, row, column).unwrap().map(f64::from);
        let Placement { rotation, .. } = Placement::turned(tilt[0], tilt[1], 0.0, [0.0; 3]);
        let origin_mm = [0, 1, 2].map(|i| at[i] + rotation[i][2] * (depth_mm - half_mm));
        let object = Object::rigid(plate.clone(), Placement { rotation, origin_mm });
        solver.solve(&[object.clone()][..], &mut out).unwrap();
        let peak_pa = out.pressure_pa.iter().copied().fold(0.0, f32::max);
        let mut pixels = PixelContact::new(Arc::clone(&pad.skin), &pad.model, PixelSpacing::One);
        solver.solve_on_pixels(&[object], &mut pixels, &mut out).unwrap();
        let looked_at = &pixels.map_pa()[..rows * MAP_SIDE_PX];
        let found_pa = looked_at.iter().copied().fold(0.0, f32::max);
        let told = format!("{row} {column}: {found_pa} Pa for {peak_pa}");
        println!("{told}");
        assert!(found_pa < 1.15 * peak_pa, "{told}");
    }
}

#[test]
fn any_pose_is_answered_on_pixels() {
    throw_at(150, PixelSpacing::One);
    throw_at(150, PixelSpacing::Two);
}

#[test]
#[ignore = "long: ./test --all"]
fn ten_thousand_poses_are_answered_on_pixels() {
    throw_at(10_000, PixelSpacing::One);
}

#[test]
#[ignore = "long: ./test --all"]
fn ten_thousand_poses_are_answered_on_coarse_pixels() {
    throw_at(10_000, PixelSpacing::Two);
}
