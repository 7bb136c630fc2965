//! Friction on pixels: vertices find where skin sticks and slips, pixels how hard it is pressed.

use crate::plane::{Plane, SHEAR_MODULUS_MPA, rough_plane};
use crate::support::ball;
use papilla_contact::{Contact, NetForce, Object, PixelContact, Solver};

const RADIUS_MM: f64 = 10.0;
const DEPTH_MM: f64 = 0.3;

fn rough(friction: f64, at: [f64; 2], depth_mm: f64) -> Object {
    Object { friction, ..ball(RADIUS_MM, at, depth_mm) }
}

fn size(v: [f64; 2]) -> f64 {
    v[0].hypot(v[1])
}

/// Traction at vertices is within the cone of the pixels' mean pressure.
fn assert_within_cone(out: &Contact, friction: f64) {
    for vertex in out.touched() {
        let q = out.shear_pa[*vertex as usize].iter().map(|q| q * q).sum::<f32>().sqrt();
        let bound = friction as f32 * out.pressure_pa[*vertex as usize];
        assert!(q <= bound * (1.0 + 1e-4), "{q} beyond {bound}");
    }
}

/// Cattaneo and Mindlin: `d = 3 mu P (2 - nu) / 16 G a (1 - (1 - Q / mu P)^2/3)` (Johnson, Contact
/// Mechanics, 1985, 7.2). The contact is five vertices wide.
#[test]
fn a_ball_moved_aside_is_pulled_as_cattaneo_and_mindlin_say() {
    const FRICTION: f64 = 0.5;
    let Plane { solver, pixels, out, .. } = &mut rough_plane();
    for depth in [0.1, 0.2, DEPTH_MM] {
        solver.solve_on_pixels(&[rough(FRICTION, [0.0; 2], depth)], pixels, out).expect("found");
    }
    let bound_n = FRICTION * out.force_n[2];
    assert!(size([out.force_n[0], out.force_n[1]]) < 1e-3 * bound_n, "{:?}", out.force_n);
    let a = (RADIUS_MM * DEPTH_MM).sqrt();
    let unit = 3.0 * bound_n * 1.5 / (16.0 * SHEAR_MODULUS_MPA * a);
    for step in 1..=12 {
        let aside = 0.1 * f64::from(step) * unit;
        let ball = rough(FRICTION, [aside, 0.0], DEPTH_MM);
        solver.solve_on_pixels(&[ball], pixels, out).expect("found");
        let [x, y] = [out.force_n[0], out.force_n[1]];
        let due = 1.0 - (1.0 - aside / unit).max(0.0).powf(1.5);
        println!("{step}: Q / mu P {:.4} for {due:.4}", x / bound_n);
        assert!((x / bound_n - due).abs() < 0.03 && y.abs() < 2e-3 * bound_n, "{step}: {x} {due}");
        assert!(out.quality.settled, "{step}: {:?}", out.effort);
        assert_within_cone(out, FRICTION);
    }
}

/// Moved far, every point slips: |Q| = mu P of the pixels' normal force, wherever the way turns.
#[test]
fn full_slip_pulls_with_the_coefficient() {
    let Plane { solver, pixels, out, .. } = &mut rough_plane();
    for friction in [0.2, 1.0] {
        solver.reset();
        pixels.reset();
        let (mut at, mut angle) = ([0.0; 2], 0.0f64);
        for step in 0..45 {
            let ball = rough(friction, at, DEPTH_MM);
            solver.solve_on_pixels(&[ball], pixels, out).expect("found");
            let [x, y, z] = out.force_n;
            if step % 15 > 12 {
                let share = size([x, y]) / (friction * z);
                let along = (x * angle.cos() + y * angle.sin()) / size([x, y]);
                // Slopes of the ball's own normal force count here too: .3 % of it.
                assert!((0.98..1.025).contains(&share), "{friction}, {step}: {share}");
                assert!(along > 0.99, "{friction}, {step}: {along}");
                assert_within_cone(out, friction);
            }
            angle = f64::from(step / 15) * 2.0;
            at = [at[0] + 0.1 * angle.cos(), at[1] + 0.1 * angle.sin()];
        }
    }
}

/// With a coefficient of 0 no bit differs from a thing that never had one, also after a rough frame.
#[test]
fn without_a_coefficient_nothing_changes() {
    let [mut was_rough, mut plain] = [(); 2].map(|()| rough_plane());
    let pull = rough(0.5, [0.3, 0.0], DEPTH_MM);
    for _ in 0..2 {
        let Plane { solver, pixels, out, .. } = &mut was_rough;
        solver.solve_on_pixels(std::slice::from_ref(&pull), pixels, out).expect("found");
        solver.reset();
        pixels.reset();
    }
    for step in 0..6 {
        let things = [rough(0.0, [0.05 * f64::from(step), 0.0], DEPTH_MM)];
        for Plane { solver, pixels, out, .. } in [&mut was_rough, &mut plain] {
            solver.solve_on_pixels(&things, pixels, out).expect("found");
        }
        assert_eq!(was_rough.out, plain.out, "{step}");
        assert_eq!(was_rough.pixels.map_pa(), plain.pixels.map_pa(), "{step}");
        assert!(plain.out.shear_pa.iter().flatten().all(|q| *q == 0.0));
    }
}

/// A session that is saved and taken up elsewhere goes on to the bit.
#[test]
fn friction_goes_where_the_memory_goes() {
    let mut stays = rough_plane();
    let mut pulled = 0;
    for frame in 0..12 {
        let mut moved = rough_plane();
        assert!(moved.solver.recall(&stays.solver.memory()));
        assert!(moved.pixels.recall(&stays.pixels.memory()));
        let step = f64::from(frame);
        let depth_mm = if frame == 8 { -3.0 } else { 0.25 + 0.05 * (1.7 * step).sin() };
        let things = [rough(0.4, [0.2 * (0.4 * step).sin(), 0.2 * (0.3 * step).cos()], depth_mm)];
        if frame % 4 == 3 {
            let net = NetForce { direction: [0.0, 0.0, 1.0], force_n: 0.05 };
            let solve = |Plane { solver, pixels, out, .. }: &mut Plane| {
                solver.solve_for_force_on_pixels(&things, net, pixels, out).expect("a travel")
            };
            let [due, found] = [&mut stays, &mut moved].map(solve);
            assert_eq!(due.to_bits(), found.to_bits());
            assert!((stays.out.force_n[2] / 0.05 - 1.0).abs() < 0.02, "{:?}", stays.out.force_n);
        } else {
            for Plane { solver, pixels, out, .. } in [&mut stays, &mut moved] {
                solver.solve_on_pixels(&things, pixels, out).expect("found");
            }
        }
        assert_eq!(stays.out, moved.out, "frame {frame}");
        assert_eq!(stays.solver.memory(), moved.solver.memory(), "frame {frame}");
        let [x, y, z] = stays.out.force_n;
        pulled += u32::from(size([x, y]) > 0.1 * z);
    }
    assert!(pulled > 5, "{pulled}");
}

/// Nothing creeps: a ball at rest is held as firmly after many frames as after one.
#[test]
fn what_sticks_is_held() {
    let Plane { solver, pixels, out, .. } = &mut rough_plane();
    let mut hold = |solver: &mut Solver, pixels: &mut PixelContact, frames: u32| {
        for frame in 0..frames {
            let at = [0.05 * f64::from(frame.min(3)), 0.0];
            solver.solve_on_pixels(&[rough(0.8, at, DEPTH_MM)], pixels, out).expect("found");
        }
        out.force_n
    };
    let first = hold(solver, pixels, 6);
    solver.reset();
    pixels.reset();
    let last = hold(solver, pixels, 120);
    assert!(first[0] > 0.05 * first[2], "{first:?}");
    assert!((last[0] / first[0] - 1.0).abs() < 5e-3, "{last:?} from {first:?}");
}

/// Random moves of two balls, one of them smooth at times, in and out.
#[test]
fn any_move_is_answered() {
    let Plane { solver, pixels, out, .. } = &mut rough_plane();
    let mut random = fastrand::Rng::with_seed(31);
    let mut places = [[0.0, 0.0, 0.2], [2.0, 1.0, 0.1]];
    let (mut touching, mut unsettled, mut pulled) = (0, 0, 0);
    for step in 0..120 {
        for place in &mut places {
            let far = if random.u8(..12) == 0 { 1.0 } else { 0.05 };
            for (i, value) in place.iter_mut().enumerate() {
                let (most, [low, high]) =
                    if i == 2 { (0.3, [-0.3, 0.4]) } else { (2.0, [-3.0, 3.0]) };
                *value = (*value + most * far * (2.0 * random.f64() - 1.0)).clamp(low, high);
            }
        }
        let friction = [if step % 40 < 30 { 0.8 } else { 0.0 }, 0.5];
        let objects = [0, 1].map(|i| {
            let [x, y, depth_mm] = places[i];
            Object { friction: friction[i], ..ball([3.0, 1.0][i], [x, y], depth_mm) }
        });
        solver.solve_on_pixels(&objects, pixels, out).expect("found");
        let numbers = [&out.force_n[..], &out.torque_n_mm, &out.centre_mm].concat();
        assert!(numbers.iter().all(|v| v.is_finite()), "{step}");
        assert!(pixels.map_pa().iter().all(|p| p.is_finite() && *p >= 0.0), "{step}");
        assert_within_cone(out, 0.8);
        touching += usize::from(!out.touched().is_empty());
        unsettled += usize::from(!out.quality.settled);
        pulled += usize::from(out.shear_pa.iter().flatten().any(|q| *q != 0.0));
    }
    println!("{touching} touch, {pulled} pulled, {unsettled} unsettled");
    assert!(pulled > 70 && unsettled < touching / 10, "{touching} {pulled} {unsettled}");
}
