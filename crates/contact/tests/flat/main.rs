//! A flat patch of an elastic half-space, where answers are known in closed form.

mod displacement;
mod friction;
mod gaps;
mod memory;
mod mirror;
mod pixels;
mod plane;
mod rubbing;
mod seams;
mod support;

use papilla_contact::{
    Arrays, ContactModel, Header, Layer, NetForce, Object, Person, Settings, Solver,
};
use proptest::prelude::*;
use support::{MODULUS_MPA, SIDE, arrays, ball, model, small_strain, solver, vertex};

/// Hertz: `F = 4/3 E* sqrt(R) d^1.5`, `a^2 = R d`, `p0 = 2 E* sqrt(d / R) / pi`, `dF/dd = 2 E* a`.
#[test]
fn a_ball_presses_as_hertz_says() {
    let (mut solver, mut out) = solver(Settings { stiffness: true, ..small_strain() });
    for (radius, depth) in [(10.0f64, 0.02f64), (10.0, 0.06), (20.0, 0.03)] {
        solver.solve(&[ball(radius, [0.0; 2], depth)], &mut out).expect("an answer");
        let a = (radius * depth).sqrt();
        let force = 4.0 / 3.0 * MODULUS_MPA * radius.sqrt() * depth.powf(1.5);
        let peak = 2.0 * MODULUS_MPA * (depth / radius).sqrt() / std::f64::consts::PI;
        let near = |found: f64, due: f64, part: f64| (found / due - 1.0).abs() < part;
        let top = out.pressure_pa.iter().copied().fold(0.0, f32::max);
        assert!(near(out.force_n[2], force, 0.04), "{} for {force} N", out.force_n[2]);
        assert!(near(f64::from(top) * 1e-6, peak, 0.06), "{top} Pa for {peak} MPa");
        let area = std::f64::consts::PI * a * a;
        assert!(near(out.area_mm2, area, 0.12), "{} for {area}", out.area_mm2);
        let stiffness = out.stiffness_n_per_mm.expect("asked for");
        assert!(near(stiffness, 2.0 * MODULUS_MPA * a, 0.08), "{stiffness}");
        assert!(out.quality.settled && out.penetration_mm < 1e-4);
    }
}

#[test]
fn force_and_torque_are_those_of_the_pressure() {
    let (mut solver, mut out) = solver(small_strain());
    solver.solve(&[ball(10.0, [0.4, -0.3], 0.06)], &mut out).expect("an answer");
    let [x, y] = [out.centre_mm[0], out.centre_mm[1]];
    assert!((x - 0.4).abs() < 5e-3 && (y + 0.3).abs() < 5e-3, "{x} {y}");
    let [fz, tx, ty] = [out.force_n[2], out.torque_n_mm[0], out.torque_n_mm[1]];
    assert!((tx - y * fz).abs() < 0.02 * fz && (ty + x * fz).abs() < 0.02 * fz, "{tx} {ty}");
}

#[test]
fn in_air_one_distance_is_asked_and_nothing_presses() {
    let (mut solver, mut out) = solver(small_strain());
    solver.solve(&[ball(10.0, [0.0; 2], 0.1)], &mut out).expect("an answer");
    assert!(!out.touched().is_empty());
    solver.solve(&[ball(10.0, [0.0; 2], -20.0)], &mut out).expect("an answer");
    assert!(out.pressure_pa.iter().all(|p| p.to_bits() == 0));
    assert_eq!((out.effort.distances, out.effort.iterations), (1, 0));
    solver.solve(&[] as &[Object; 0], &mut out).expect("an answer");
    assert_eq!(out.force_n.map(f64::to_bits), [0; 3]);
}

/// Lengths times w, moduli times s: pressure times s, force times s w^2, torque times s w^3.
#[test]
fn a_scaled_finger_answers_scaled() {
    let (mut own, mut out) = solver(Settings { stiffness: true, ..small_strain() });
    own.solve(&[ball(8.0, [0.2, 0.1], 0.08)], &mut out).expect("an answer");
    let person = Person { width: 1.3, stiffness: 0.7 };
    let (mut other, mut scaled) = solver(Settings { person, stiffness: true, ..small_strain() });
    let larger = ball(8.0 * 1.3, [0.2 * 1.3, 0.1 * 1.3], 0.08 * 1.3);
    other.solve(&[larger], &mut scaled).expect("an answer");
    let same = |a: f64, b: f64| (a - b).abs() <= 1e-3 * b.abs();
    assert!(same(scaled.force_n[2], 0.7 * 1.69 * out.force_n[2]));
    assert!(same(scaled.torque_n_mm[0], 0.7 * 1.3f64.powi(3) * out.torque_n_mm[0]));
    assert!(same(scaled.area_mm2, 1.69 * out.area_mm2));
    assert!(same(scaled.centre_mm[0], 1.3 * out.centre_mm[0]));
    let stiffness = [&scaled, &out].map(|o| o.stiffness_n_per_mm.expect("asked for"));
    assert!(same(stiffness[0], 0.7 * 1.3 * stiffness[1]));
    for (a, b) in scaled.pressure_pa.iter().zip(&out.pressure_pa) {
        assert!((a - 0.7 * b).abs() <= 1e-3 * 0.7 * b + 1.0, "{a} {b}");
    }
}

fn up(force_n: f64) -> NetForce {
    NetForce { direction: [0.0, 0.0, 1.0], force_n }
}

/// A force that changes a little is met near where the last one was.
#[test]
fn a_net_force_is_followed_in_few_frames() {
    let (mut solver, mut out) = solver(small_strain());
    let mut most = 0;
    for step in 0..60 {
        let force = 0.006 + 1e-4 * f64::from(step);
        let objects = [ball(10.0, [5e-3 * f64::from(step), 0.0], -0.5)];
        solver.solve_for_force(&objects, up(force), &mut out).expect("a travel");
        assert!((out.force_n[2] / force - 1.0).abs() < 3e-3, "{}", out.force_n[2]);
        if step > 1 {
            most = most.max(out.effort.iterations);
        }
    }
    assert!(most <= 20, "{most} iterations");
}

/// Whether an object starts in air or too deep, it travels to where Hertz has the force.
#[test]
fn a_net_force_is_met() {
    for start in [-3.0, -0.01, 0.04, 0.15] {
        let (mut solver, mut out) = solver(small_strain());
        let force = 0.006;
        let travel = solver
            .solve_for_force(&[ball(10.0, [0.0; 2], start)], up(force), &mut out)
            .expect("a travel");
        assert!((out.force_n[2] / force - 1.0).abs() < 3e-3, "{}", out.force_n[2]);
        let due = (0.75 * force / (MODULUS_MPA * 10f64.sqrt())).powf(2.0 / 3.0);
        assert!(((start + travel) / due - 1.0).abs() < 0.05, "{start}: {travel} for {due}");
    }
    let (mut solver, mut out) = solver(small_strain());
    let away = NetForce { direction: [0.0, 0.0, -1.0], force_n: 1.0 };
    let error = solver.solve_for_force(&[ball(1.0, [0.0; 2], -1.0)], away, &mut out);
    assert!(error.is_err());
}

/// A soft object and the skin share the depth; a very stiff one is rigid.
#[test]
fn a_soft_object_gives_way() {
    let force = |stiffness_mpa_per_mm: f64| {
        let (mut solver, mut out) = solver(small_strain());
        let object = Object { stiffness_mpa_per_mm, ..ball(10.0, [0.0; 2], 0.08) };
        solver.solve(&[object], &mut out).expect("an answer");
        out.force_n[2]
    };
    let [soft, stiff, rigid] = [0.1, 1e4, f64::INFINITY].map(force);
    assert!(soft < 0.7 * rigid && soft > 0.2 * rigid, "{soft} {rigid}");
    assert!((stiff / rigid - 1.0).abs() < 1e-2, "{stiff} {rigid}");
}

/// Two parts of a millimetre in steps of a micrometre: force rises by what its stiffness says.
#[test]
fn force_is_continuous_along_a_path() {
    let (mut solver, mut out) = solver(Settings { stiffness: true, ..small_strain() });
    let mut last: Option<(f64, Vec<f32>)> = None;
    for step in 0..200 {
        let depth = 0.02 + 1e-3 * f64::from(step) * 0.5;
        solver.solve(&[ball(10.0, [0.3, 0.0], depth)], &mut out).expect("an answer");
        if let Some((force, pressure)) = &last {
            let rise = out.force_n[2] - force;
            let due = 0.5e-3 * out.stiffness_n_per_mm.expect("asked for");
            assert!(rise > 0.7 * due && rise < 1.3 * due, "{step}: {rise} for {due}");
            let most = out.pressure_pa.iter().copied().fold(0.0, f32::max);
            for (a, b) in out.pressure_pa.iter().zip(pressure) {
                assert!((a - b).abs() < 0.08 * most, "{step}: {b} to {a} of {most}");
            }
        }
        last = Some((out.force_n[2], out.pressure_pa.clone()));
    }
}

#[test]
fn a_warm_frame_ends_where_a_cold_one_does() {
    let (mut warm, mut out) = solver(small_strain());
    let (mut cold, mut anew) = solver(small_strain());
    for step in 0..40 {
        let at = [0.02 * f64::from(step) - 0.4, 0.01 * f64::from(step % 7)];
        let object = ball(6.0, at, 0.05 + 0.01 * f64::from(step % 5));
        warm.solve(std::slice::from_ref(&object), &mut out).expect("an answer");
        cold.reset();
        cold.solve(&[object], &mut anew).expect("an answer");
        let miss: f32 =
            out.pressure_pa.iter().zip(&anew.pressure_pa).map(|(a, b)| (a - b).powi(2)).sum();
        let size: f32 = anew.pressure_pa.iter().map(|p| p * p).sum();
        assert!(miss <= 1e-4 * size, "{step}: {miss} of {size}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(60) })]
    /// Frames that jump, also deep: no tension, no NaN, bounded work, and what does not fit is said.
    #[test]
    fn any_frame_is_answered(
        frames in prop::collection::vec(
            (0.3f64..40.0, -2.5f64..2.5, -2.5f64..2.5, -1.0f64..3.0, 0usize..2), 1..5),
    ) {
        let (mut solver, mut out) = solver(small_strain());
        for (radius, x, y, depth, more) in frames {
            let mut objects = vec![ball(radius, [x, y], depth)];
            objects.extend((0..more).map(|_| ball(1.0, [-x, y], 0.3 * depth)));
            solver.solve(&objects, &mut out).expect("an answer");
            prop_assert!(out.pressure_pa.iter().all(|p| p.is_finite() && *p >= 0.0));
            prop_assert!(out.force_n.iter().all(|f| f.is_finite()));
            prop_assert!(out.effort.iterations <= 16 * 3 + 25);
            let judged = out.quality.settled && !out.quality.out_of_range;
            prop_assert!(!judged || out.penetration_mm < 2e-3, "{} mm left", out.penetration_mm);
            let clearance = |o: &Object, i: usize| {
                let [x, y] = vertex(i);
                o.placement.clearance_mm(o.shape.as_ref(), [x, y, 0.0])
            };
            let nearest = objects
                .iter()
                .flat_map(|o| (0..SIDE * SIDE).map(move |i| clearance(o, i)))
                .fold(f64::INFINITY, f64::min);
            let pressed = out.pressure_pa.iter().any(|p| *p > 0.0);
            prop_assert!(pressed || nearest > -1e-3, "missed by {nearest}");
            prop_assert!(!pressed || nearest < 1e-4, "pressure across {nearest}");
        }
    }
}

#[test]
fn what_cannot_be_placed_is_named() {
    let (mut solver, mut out) = solver(small_strain());
    let place = |change: &dyn Fn(&mut Object)| {
        let mut object = ball(5.0, [0.0; 2], 0.1);
        change(&mut object);
        object
    };
    let cases = [
        (place(&|o| o.placement.origin_mm[1] = f64::NAN), "origin_mm"),
        (place(&|o| o.placement.origin_mm[1] = 1e9), "origin_mm"),
        (place(&|o| o.placement.rotation[0][0] = 1.1), "rotation"),
        (place(&|o| o.placement.rotation[2][2] = -1.0), "rotation"),
        (place(&|o| o.placement.rotation[2][2] = f64::NAN), "rotation"),
        (place(&|o| o.stiffness_mpa_per_mm = 0.0), "stiffness"),
    ];
    for (object, word) in cases {
        let error = solver.solve(&[object], &mut out).expect_err("refused").to_string();
        assert!(error.contains(word), "{error} should name {word}");
    }
    let person = Person { width: f64::NAN, ..Person::default() };
    assert!(Solver::new(model(), Settings { person, ..small_strain() }).is_err());
}

#[test]
fn a_file_comes_back_and_a_damaged_one_is_refused() {
    let (header, arrays) = arrays();
    let bytes = arrays.to_bytes(&header).expect("bytes");
    let read = ContactModel::read(&bytes).expect("a model");
    assert_eq!((&read.header().atlas_hash, read.vertices()), (&header.atlas_hash, SIDE * SIDE));
    // Rounded once, it is written as it was read.
    let (again, rounded) = Arrays::read(&bytes).expect("arrays");
    assert_eq!(rounded.to_bytes(&again).expect("bytes"), bytes);
    let step = again.compliance_step_mm_per_n;
    assert!(step > 0.0);
    for (a, b) in rounded.compliance_mm_per_n.iter().zip(&arrays.compliance_mm_per_n) {
        assert!((a - b).abs() <= 0.501 * step, "{a} {b}");
    }
    assert!(read.require_atlas("flat").is_ok() && read.require_atlas("other").is_err());
    for cut in [0, 10, 60, bytes.len() - 4] {
        assert!(ContactModel::read(&bytes[..cut]).is_err(), "cut at {cut}");
    }
    let longer = [&bytes[..], &[0; 4]].concat();
    assert!(ContactModel::read(&longer).is_err());
    let end = bytes.windows(2).position(|b| b == b"}\n").expect("a header") + 2;
    let with_header = |from: &str, to: &str| {
        let header = String::from_utf8_lossy(&bytes[..end]).replace(from, to);
        ContactModel::read(&[header.as_bytes(), &bytes[end..]].concat()).map(drop).unwrap_err()
    };
    // Of another version the members are not looked at, and a short file asks for no memory.
    let older = with_header("\"format\":4", "\"format\":2,\"compliance_unit\":1").to_string();
    assert!(older.contains("format 2") && older.contains("fe-datagen contact"), "{older}");
    let vast = with_header("\"vertices\":441", "\"vertices\":8192").to_string();
    assert!(vast.contains("too short"), "{vast}");
    let flipped: Vec<u8> =
        bytes.iter().enumerate().map(|(i, b)| if i == end + 900 { b ^ 16 } else { *b }).collect();
    assert!(ContactModel::read(&flipped).is_err());
    let layer = Layer { young_mpa: 0.1, poisson: 0.5, thickness_mm: 1.0 };
    let stiff = Header { layers: vec![layer], ..header.clone() };
    let error = ContactModel::new(stiff, arrays.clone()).expect_err("refused").to_string();
    assert!(error.contains("layers.poisson[0]"), "{error}");
    let mut bad = arrays;
    bad.compliance_mm_per_n[3] = f32::NAN;
    let error = ContactModel::new(header, bad).expect_err("refused").to_string();
    assert!(error.contains("compliance_mm_per_n[3]"), "{error}");
}
