//! Friction on an incompressible half-space, where normal and tangential forces do not mix.

use papilla_contact::{
    Arrays, Contact, ContactError, ContactModel, Gaps, Header, NetForce, Object, Settings, Solver,
};
use std::f64::consts::PI;
use std::sync::{Arc, OnceLock};

use super::gaps::depths;
use super::support::{MODULUS_MPA, SIDE, SPACING_MM, arrays, ball, small_strain, vertex};

/// E* = 4 G of an incompressible half-space.
const SHEAR_MODULUS_MPA: f64 = MODULUS_MPA / 4.0;
const RADIUS_MM: f64 = 10.0;
const DEPTH_MM: f64 = 0.06;

/// The flat skin, moved along itself as Cerruti says: `u_i = (1 / r + x_i x_k / r^3) q_k / 4 pi G`,
/// and at a vertex itself the mean over a disc of its area.
fn skin() -> (Header, Arrays) {
    let (header, mut arrays) = arrays();
    let v = SIDE * SIDE;
    let unit = 1.0 / (4.0 * PI * SHEAR_MODULUS_MPA);
    let own = unit * 1.5 * 16.0 / (3.0 * PI * (SPACING_MM * SPACING_MM / PI).sqrt());
    let mut at = 0;
    for i in 0..3 * v {
        for k in i..3 * v {
            let ((p, a), (q, b)) = ((i / 3, i % 3), (k / 3, k % 3));
            if a < 2 && b < 2 {
                let d: [f64; 2] = std::array::from_fn(|x| vertex(p)[x] - vertex(q)[x]);
                let r = d[0].hypot(d[1]);
                let same = f64::from(u8::from(a == b));
                let value =
                    if p == q { own * same } else { unit * (same / r + d[a] * d[b] / r.powi(3)) };
                arrays.compliance_mm_per_n[at] = value as f32;
            }
            at += 1;
        }
    }
    (header, arrays)
}

fn model() -> Arc<ContactModel> {
    static MODEL: OnceLock<Arc<ContactModel>> = OnceLock::new();
    let make = || {
        let (header, arrays) = skin();
        Arc::new(ContactModel::new(header, arrays).expect("a model"))
    };
    MODEL.get_or_init(make).clone()
}

fn rough(settings: Settings) -> (Solver, Contact) {
    let settings = Settings { friction: true, ..settings };
    let solver = Solver::new(model(), settings).expect("a solver");
    (solver, Contact::new(model().vertices()))
}

fn rough_ball(friction: f64, at: [f64; 2], depth_mm: f64) -> Object {
    Object { friction, ..ball(RADIUS_MM, at, depth_mm) }
}

fn size(v: [f64; 2]) -> f64 {
    v[0].hypot(v[1])
}

/// Shear over its bound at the vertices.
fn shares(out: &Contact, friction: f64) -> Vec<(u32, f64)> {
    let share = |vertex: &u32| {
        let [x, y, z] = out.shear_pa[*vertex as usize].map(f64::from);
        let bound = friction * f64::from(out.pressure_pa[*vertex as usize]);
        (*vertex, (x * x + y * y + z * z).sqrt() / bound)
    };
    out.touched().iter().map(share).collect()
}

/// Cattaneo and Mindlin: `d = 3 mu P (2 - nu) / 16 G a (1 - (1 - Q / mu P)^2/3)`, and the part that
/// sticks has the radius `c = a (1 - Q / mu P)^1/3` (Johnson, Contact Mechanics, 1985, 7.2).
#[test]
fn a_ball_moved_aside_slips_as_cattaneo_and_mindlin_say() {
    const FRICTION: f64 = 0.5;
    let (mut solver, mut out) = rough(small_strain());
    for depth in [0.02, 0.04, DEPTH_MM] {
        solver.solve(&[rough_ball(FRICTION, [0.0; 2], depth)], &mut out).expect("an answer");
    }
    let bound_n = FRICTION * out.force_n[2];
    assert!(size([out.force_n[0], out.force_n[1]]) < 1e-3 * bound_n, "{:?}", out.force_n);
    let a = (RADIUS_MM * DEPTH_MM).sqrt();
    let unit = 3.0 * bound_n * 1.5 / (16.0 * SHEAR_MODULUS_MPA * a);
    let mut checked = 0;
    for step in 1..=12 {
        let aside = 0.1 * f64::from(step) * unit;
        let ball = rough_ball(FRICTION, [aside, 0.0], DEPTH_MM);
        solver.solve(&[ball], &mut out).expect("an answer");
        let [x, y] = [out.force_n[0], out.force_n[1]];
        let left = 1.0 - x / bound_n;
        let due = 1.0 - (1.0 - aside / unit).max(0.0).powf(1.5);
        println!("{step}: Q / mu P {:.4} for {due:.4}", x / bound_n);
        assert!((x / bound_n - due).abs() < 0.012 && y.abs() < 2e-3 * bound_n, "{step}: {x} {due}");
        assert!(out.quality.settled, "{step}: {:?}", out.effort);
        let shares = shares(&out, FRICTION);
        assert!(shares.iter().all(|(_, share)| *share <= 1.0 + 1e-4), "{step}: {shares:?}");
        if left > 0.05 {
            // The area that sticks, of vertices.
            let sticks = shares.iter().filter(|(_, share)| *share < 0.999).count() as f64;
            let radius = (sticks * SPACING_MM * SPACING_MM / PI).sqrt() / a;
            let due = left.cbrt();
            println!("   c / a {radius:.3} for {due:.3}");
            assert!((radius - due).abs() < 0.03, "{step}: {radius} for {due}");
            checked += 1;
        }
    }
    assert!(checked > 6, "{checked}");
}

/// Moved far, every point slips: |Q| = mu P, in the direction of the way, wherever it turns.
#[test]
fn full_slip_pulls_with_the_coefficient() {
    let (mut solver, mut out) = rough(small_strain());
    for friction in [0.2, 1.0] {
        solver.reset();
        let (mut at, mut angle) = ([0.0; 2], 0.0f64);
        for step in 0..60 {
            solver.solve(&[rough_ball(friction, at, DEPTH_MM)], &mut out).expect("an answer");
            let [x, y, z] = out.force_n;
            if step % 20 > 15 {
                let share = size([x, y]) / (friction * z);
                let along = (x * angle.cos() + y * angle.sin()) / size([x, y]);
                assert!((0.985..1.01).contains(&share), "{step}: {share}");
                assert!(along > 0.995, "{step}: {along}");
            }
            angle = f64::from(step / 20) * 2.0;
            at = [at[0] + 0.03 * angle.cos(), at[1] + 0.03 * angle.sin()];
        }
    }
}

/// Without friction no bit differs, whether it may come or not, and after it has been there.
#[test]
fn without_a_coefficient_nothing_changes() {
    let (mut able, mut out) = rough(small_strain());
    let mut plain = Solver::new(model(), small_strain()).expect("a solver");
    let mut of_plain = Contact::new(model().vertices());
    for step in 0..20 {
        let object = [rough_ball(0.0, [0.03 * f64::from(step), 0.0], 0.05)];
        able.solve(&object, &mut out).expect("an answer");
        plain.solve(&object, &mut of_plain).expect("an answer");
        assert!(out.shear_pa.iter().all(|s| s.map(f32::to_bits) == [0; 3]));
        let shear_pa = std::mem::take(&mut out.shear_pa);
        assert_eq!(out, of_plain, "step {step}");
        out.shear_pa = shear_pa;
    }
    let refused = plain.solve(&[rough_ball(0.1, [0.0; 2], 0.05)], &mut of_plain);
    assert!(refused.expect_err("made without").to_string().contains("friction"));
    for friction in [-0.1, f64::NAN, f64::INFINITY] {
        let refused = able.solve(&[rough_ball(friction, [0.0; 2], 0.05)], &mut out);
        assert!(refused.expect_err("no coefficient").to_string().contains("friction"));
    }
}

/// To and fro between the same places takes work, which a ball that sticks gives back.
#[test]
fn a_path_to_and_fro_dissipates() {
    let work = |friction: f64, far: f64| {
        let (mut solver, mut out) = rough(small_strain());
        let (mut work, mut last): (f64, Option<(f64, f64)>) = (0.0, None);
        // A quarter to get there, then two rounds that close.
        for step in 0..=180 {
            let x = far * (2.0 * PI * f64::from(step) / 80.0).sin();
            let ball = rough_ball(friction, [x, 0.0], DEPTH_MM);
            solver.solve(&[ball], &mut out).expect("an answer");
            if let Some((at, force)) = last.filter(|_| step > 20) {
                work += 0.5 * (force + out.force_n[0]) * (x - at);
            }
            last = Some((x, out.force_n[0]));
        }
        (work, out.force_n[2])
    };
    let (slides, press_n) = work(0.3, 0.4);
    // Two rounds of 1.6 mm, less what the skin gives way at each turn.
    let most = 0.3 * press_n * 2.0 * 4.0 * 0.4;
    assert!(slides > 0.5 * most && slides < most, "{slides} of {most}");
    let (sticks, _) = work(10.0, 0.01);
    assert!(sticks.abs() < 1e-3 * slides, "{sticks} of {slides}");
}

/// Nothing creeps: a ball at rest holds for as long as it rests.
#[test]
fn what_sticks_is_held() {
    let (mut solver, mut out) = rough(small_strain());
    let mut first = None;
    for step in 0..3000 {
        let ball = rough_ball(0.8, [0.01 * f64::from(step.min(3)), 0.0], DEPTH_MM);
        solver.solve(&[ball], &mut out).expect("an answer");
        if step == 10 {
            first = Some(out.force_n);
        }
    }
    let first = first.expect("a force");
    assert!(first[0] > 0.05 * first[2], "{first:?}");
    assert!((out.force_n[0] / first[0] - 1.0).abs() < 1e-3, "{:?} from {first:?}", out.force_n);
}

/// A ball that turns about the normal twists the skin; away and back it starts anew.
#[test]
fn a_turn_twists_and_air_forgets() {
    use papilla_sdf::Placement;
    let (mut solver, mut out) = rough(small_strain());
    let turned = |yaw_deg: f64, depth_mm: f64| {
        let ball = rough_ball(0.6, [0.0; 2], depth_mm);
        let placement = Placement::turned(0.0, 0.0, yaw_deg, ball.placement.origin_mm);
        Object { placement, ..ball }
    };
    for yaw in 0..4 {
        solver.solve(&[turned(f64::from(yaw), DEPTH_MM)], &mut out).expect("an answer");
    }
    let twist = out.torque_n_mm[2];
    assert!(twist > 0.02 * out.force_n[2], "{twist}");
    assert!(size([out.force_n[0], out.force_n[1]]) < 1e-2 * out.force_n[2], "{:?}", out.force_n);
    solver.solve(&[turned(20.0, -1.0)], &mut out).expect("an answer");
    assert!(out.force_n.iter().all(|f| *f == 0.0) && solver.memory().anchors.is_empty());
    solver.solve(&[turned(50.0, DEPTH_MM)], &mut out).expect("an answer");
    assert!(out.torque_n_mm[2].abs() < 1e-3 * twist, "{}", out.torque_n_mm[2]);
}

#[test]
fn friction_goes_where_the_memory_goes() {
    let settings = Settings { friction: true, ..small_strain() };
    let (mut stays, mut out) = rough(small_strain());
    let mut of_moved = Contact::new(model().vertices());
    let (mut pulls, mut nets) = (0, 0);
    for frame in 0..40 {
        let mut moved = Solver::new(model(), settings).expect("a solver");
        assert!(moved.recall(&stays.memory()));
        let step = f64::from(frame);
        let depth_mm = if frame % 9 == 8 { -3.0 } else { 0.05 + 0.02 * (1.7 * step).sin() };
        let at = [0.2 * (0.4 * step).sin(), 0.2 * (0.3 * step).cos()];
        let things = [rough_ball(0.4, at, depth_mm)];
        if frame % 5 == 4 {
            let net = NetForce { direction: [0.0, 0.0, 1.0], force_n: 0.01 };
            let due = stays.solve_for_force(&things, net, &mut out).expect("a travel");
            let found = moved.solve_for_force(&things, net, &mut of_moved).expect("a travel");
            assert_eq!(due.to_bits(), found.to_bits());
            nets += 1;
        } else {
            stays.solve(&things, &mut out).expect("an answer");
            moved.solve(&things, &mut of_moved).expect("an answer");
        }
        assert_eq!(out, of_moved, "frame {frame}");
        assert_eq!(stays.memory(), moved.memory(), "frame {frame}");
        pulls += u32::from(size([out.force_n[0], out.force_n[1]]) > 0.1 * out.force_n[2]);
    }
    assert!(pulls > 20 && nets == 8, "{pulls} {nets}");
    let mut plain = Solver::new(model(), small_strain()).expect("a solver");
    let memory = stays.memory();
    assert!(!memory.anchors.is_empty() && !plain.recall(&memory));
    let twice = papilla_contact::Memory {
        anchors: memory.anchors.iter().chain(&memory.anchors).copied().collect(),
        ..memory
    };
    assert!(!stays.recall(&twice) && stays.memory().anchors.is_empty());
}

/// Ten thousand random moves of two balls, small and large, in and out.
#[test]
fn any_move_is_answered() {
    let (mut solver, mut out) = rough(small_strain());
    let mut random = fastrand::Rng::with_seed(23);
    let (mut touching, mut unsettled) = (0, 0);
    let mut places = [[0.0, 0.0, 0.05], [0.6, 0.3, -0.1]];
    for step in 0..10_000 {
        for place in &mut places {
            let far = if random.u8(..12) == 0 { 1.0 } else { 0.02 };
            for (i, value) in place.iter_mut().enumerate() {
                let most = if i == 2 { 0.12 } else { 0.8 };
                let moved = *value + most * far * (2.0 * random.f64() - 1.0);
                *value =
                    moved.clamp(if i == 2 { -0.2 } else { -0.9 }, if i == 2 { 0.2 } else { 0.9 });
            }
        }
        let [a, b] = places;
        let friction = [1.5 * random.f64(), 0.5];
        let objects =
            [(1.0, a, friction[0]), (0.6, b, friction[1])].map(|(radius, at, friction)| Object {
                friction,
                ..ball(radius, [at[0], at[1]], at[2])
            });
        solver.solve(&objects, &mut out).expect("an answer");
        let told = format!("step {step}: {:?} {:?}", out.quality, out.effort);
        let numbers = [&out.force_n[..], &out.torque_n_mm, &out.centre_mm].concat();
        assert!(numbers.iter().all(|v| v.is_finite()), "{told}");
        assert!(out.effort.products < 4000, "{told}");
        let most = friction[0].max(friction[1]);
        for (vertex, shear) in out.shear_pa.iter().enumerate() {
            let size = shear.iter().map(|s| s * s).sum::<f32>().sqrt();
            let bound = most as f32 * out.pressure_pa[vertex];
            assert!(size <= bound * (1.0 + 1e-4), "{size} beyond {bound}, {told}");
        }
        touching += usize::from(!out.touched().is_empty());
        unsettled += usize::from(!out.quality.settled);
    }
    println!("{touching} touch, {unsettled} unsettled");
    assert!(touching > 4000 && unsettled < touching / 50, "{touching} {unsettled}");
}

/// A ball that rests on the skin as gaps, and moves on as gaps and motion, pulls as the object does.
#[test]
fn gaps_that_move_pull_as_the_object_does() {
    const FRICTION: f64 = 0.5;
    let (mut by_object, mut due) = rough(small_strain());
    let (mut by_gaps, mut out) = rough(small_strain());
    let mut at = [0.0; 2];
    for step in 0..24 {
        // Straight in, aside, and back another way.
        let way = match step {
            0..3 => [0.0, 0.0],
            3..12 => [2e-3, 0.0],
            _ => [-1e-3, 2e-3],
        };
        at = [at[0] + way[0], at[1] + way[1]];
        let ball = rough_ball(FRICTION, at, DEPTH_MM);
        let (depth_mm, moved) = (depths(&ball), [way[0] as f32, way[1] as f32, 0.0]);
        let moved_mm = vec![moved; SIDE * SIDE];
        let gaps = Gaps { friction: FRICTION, moved_mm: &moved_mm, ..Gaps::rigid(&depth_mm) };
        by_object.solve(&[ball], &mut due).expect("an answer");
        by_gaps.solve(gaps, &mut out).expect("an answer");
        let miss = size([0, 1].map(|i| out.force_n[i] - due.force_n[i]));
        assert!(
            miss < 0.02 * FRICTION * due.force_n[2],
            "{step}: {:?} {:?}",
            out.force_n,
            due.force_n
        );
    }
    assert!(size([due.force_n[0], due.force_n[1]]) > 0.2 * FRICTION * due.force_n[2]);
    // What rests goes on pulling, and what has no friction does not.
    let depth_mm = depths(&rough_ball(FRICTION, at, DEPTH_MM));
    let before = out.force_n;
    by_gaps
        .solve(Gaps { friction: FRICTION, ..Gaps::rigid(&depth_mm) }, &mut out)
        .expect("an answer");
    assert!((out.force_n[1] / before[1] - 1.0).abs() < 0.01, "{before:?} {:?}", out.force_n);
    by_gaps.solve(Gaps::rigid(&depth_mm), &mut out).expect("an answer");
    assert!(size([out.force_n[0], out.force_n[1]]) < 1e-4 * out.force_n[2], "{:?}", out.force_n);
}

#[test]
fn what_is_no_motion_is_named() {
    let (mut solver, mut out) = rough(small_strain());
    let depth_mm = depths(&rough_ball(0.5, [0.0; 2], DEPTH_MM));
    let mut moved_mm = vec![[0.0; 3]; SIDE * SIDE];
    moved_mm[3] = [0.0, f32::INFINITY, 0.0];
    let gaps = Gaps { friction: 0.5, moved_mm: &moved_mm, ..Gaps::rigid(&depth_mm) };
    let error = solver.solve(gaps, &mut out).expect_err("refused").to_string();
    assert!(error.contains("moved_mm[3]"), "{error}");
    let few = Gaps { moved_mm: &moved_mm[..5], ..gaps };
    let error = solver.solve(few, &mut out).expect_err("refused");
    assert_eq!(error, ContactError::Gaps { found: 5, expected: SIDE * SIDE });
    let sticky = Gaps { friction: 11.0, moved_mm: &[], ..gaps };
    let error = solver.solve(sticky, &mut out).expect_err("refused").to_string();
    assert!(error.contains("friction"), "{error}");
}
