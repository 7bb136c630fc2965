//! Random objects in random places on a curved finger: what must hold for any frame.
//!
//! The finger is made here, unless `PAPILLA_CONTACT_MODEL` names a file of `fe-datagen contact`.

mod budget;
mod deep;
mod edges;
mod pieces;
mod support;

use papilla_contact::{Arrays, Contact, Gaps, Header, Object, Quality, Settings, Solver};
use support::{Finger, Throw, arrays, shapes};

const POSES: usize = 10_000;
/// Plate, balls, punch and box.
const WIDE: [usize; 5] = [0, 1, 2, 5, 9];
/// Plate and balls.
const ROUND: [usize; 3] = [0, 1, 2];
/// Linearisations of a frame: 16 steps of 3 and 25, twice if it starts anew.
const ITERATIONS_MAX: u32 = 2 * (16 * 3 + 25);

fn throw(random: &mut fastrand::Rng, finger: &Finger) -> Throw {
    let deep = random.u8(..10) == 0;
    let most = f64::from(finger.model.header().depth_max_mm) * if deep { 3.0 } else { 1.0 };
    Throw {
        vertex: random.usize(..finger.places_mm.len()),
        depth_mm: -1.0 + (most + 1.0) * random.f64(),
        tilt_deg: [0, 1].map(|_| 60.0 * random.f64() - 30.0),
        spin_deg: 360.0 * random.f64() - 180.0,
    }
}

#[test]
fn any_pose_of_any_shape_is_answered() {
    let (finger, shapes) = (Finger::new(), shapes());
    let settings = Settings { stiffness: true, ..Settings::default() };
    let mut solver = Solver::new(finger.model.clone(), settings).expect("a solver");
    let mut out = Contact::new(finger.model.vertices());
    let mut random = fastrand::Rng::with_seed(20);
    let mut now = throw(&mut random, &finger);
    let mut shape = 0;
    let (mut touching, mut unsettled, mut outside) = (0, 0, 0);
    let (mut wide, mut wide_unsettled, mut deep, mut deep_told) = (0, 0, 0, 0);
    let (mut round, mut round_aside) = (0, 0);
    for pose in 0..POSES {
        if random.u8(..3) == 0 {
            now = throw(&mut random, &finger);
            shape = random.usize(..shapes.len());
        } else {
            now.depth_mm += 0.1 * (random.f64() - 0.5);
            now.spin_deg += random.f64() - 0.5;
        }
        let mut objects = vec![finger.place(&shapes[shape], now)];
        if random.u8(..8) == 0 {
            let more = throw(&mut random, &finger);
            objects.push(finger.place(&shapes[random.usize(..shapes.len())], more));
        }
        solver.solve(&objects, &mut out).expect("an answer");
        let told = format!("pose {pose}, shape {shape}: {:?} {:?}", out.quality, out.effort);
        let wrong = out.pressure_pa.iter().find(|p| !(p.is_finite() && **p >= 0.0));
        assert_eq!(wrong, None, "{told}");
        let numbers = [&out.force_n[..], &out.torque_n_mm, &out.centre_mm].concat();
        assert!(numbers.iter().all(|f| f.is_finite()), "{told}");
        assert!(out.stiffness_n_per_mm.is_none_or(|s| s.is_finite() && s >= 0.0), "{told}");
        assert!(out.effort.iterations <= ITERATIONS_MAX, "{told}");
        let nearest = finger.clearance_mm(&objects);
        let pressed = !out.touched().is_empty();
        assert!(pressed || nearest > -1e-3, "missed by {nearest} mm, {told}");
        // What is thinner than vertices are apart can lie in the finger and at none of them.
        let is_held = out.quality.is_held;
        assert!(!pressed || nearest < 0.0 || is_held, "pressure across {nearest} mm, {told}");
        let judged = out.quality.settled && !out.quality.out_of_range;
        assert!(!judged || out.penetration_mm < 5e-3, "{} mm left, {told}", out.penetration_mm);
        touching += usize::from(pressed);
        unsettled += usize::from(!out.quality.settled);
        outside += usize::from(out.quality.out_of_range);
        // Alone, no narrower than vertices are apart, and within what the models know.
        if WIDE.contains(&shape) && objects.len() == 1 && pressed {
            let is_deep = nearest < -f64::from(finger.model.header().depth_max_mm);
            *if is_deep { &mut deep } else { &mut wide } += 1;
            let Quality { settled, is_aside, .. } = out.quality;
            // Edges, and what reaches beyond where the skin ends, push it aside.
            wide_unsettled += usize::from(!is_deep && !settled && !is_aside);
            round += usize::from(!is_deep && ROUND.contains(&shape));
            round_aside += usize::from(!is_deep && ROUND.contains(&shape) && is_aside);
            deep_told += usize::from(is_deep && !judged);
        }
    }
    println!("{touching} of {POSES} touch, {unsettled} unsettled, {outside} out of range");
    println!("wide: {wide_unsettled} of {wide} unsettled; deep: {deep_told} of {deep} flagged");
    println!("plate and balls: {round_aside} of {round} aside");
    assert!(touching > POSES / 3 && unsettled < touching / 2, "{touching} {unsettled}");
    assert!(4 * wide_unsettled < wide, "{wide_unsettled} of {wide}");
    assert!(12 * round_aside < round, "{round_aside} of {round}");
    assert!(deep > 50 && deep_told == deep, "{deep_told} of {deep}");
}

/// Steps of a micrometre, down and aside: no more changes than a depth that grows by as much of
/// itself would change, times ten.
#[test]
fn a_continuous_path_is_answered_continuously() {
    let (finger, shapes) = (Finger::new(), shapes());
    let lowest = |i: &usize, j: &usize| finger.places_mm[*i][2].total_cmp(&finger.places_mm[*j][2]);
    let vertex = (0..finger.places_mm.len()).min_by(lowest).expect("a vertex");
    for shape in [0, 1, 3] {
        let mut solver = Solver::new(finger.model.clone(), Settings::default()).expect("a solver");
        let mut out = Contact::new(finger.model.vertices());
        let start = Throw { vertex, depth_mm: 0.5, tilt_deg: [4.0, 7.0], spin_deg: 20.0 };
        let mut object = finger.place(&shapes[shape], start);
        let (mut last, mut most): (Option<Vec<f32>>, f32) = (None, 0.0);
        for step in 0..400 {
            let way = if step < 200 { 2 } else { 0 };
            object.placement.origin_mm[way] += 1e-3;
            solver.solve(std::slice::from_ref(&object), &mut out).expect("an answer");
            let square = |v: &[f32]| v.iter().map(|p| p * p).sum::<f32>().sqrt();
            if let Some(last) = &last {
                let change: Vec<f32> =
                    out.pressure_pa.iter().zip(last).map(|(a, b)| a - b).collect();
                most = most.max(square(&change) / square(&out.pressure_pa));
            }
            last = Some(out.pressure_pa.clone());
        }
        println!("shape {shape}: at most {:.3} % of the map a micrometre", 100.0 * most);
        assert!(most < 10.0 * 1e-3 / 0.5, "shape {shape}: {most}");
    }
}

/// Gaps at the vertices tell less than an object: curvature and what lies between them.
#[test]
fn gaps_press_nearly_as_the_object_does() {
    let (finger, shapes) = (Finger::new(), shapes());
    let vertex = finger.places_mm.len() / 2;
    for (shape, most) in [(0, 0.06), (2, 0.06), (1, 0.12)] {
        let start = Throw { vertex, depth_mm: 1.0, tilt_deg: [2.0, 3.0], spin_deg: 0.0 };
        let object: Object = finger.place(&shapes[shape], start);
        let depth =
            |p: &[f64; 3]| -object.placement.distance(object.shape.as_ref(), *p).gap_mm as f32;
        let depth_mm: Vec<f32> = finger.places_mm.iter().map(depth).collect();
        let force = |gaps: bool| {
            let mut solver =
                Solver::new(finger.model.clone(), Settings::default()).expect("a solver");
            let mut out = Contact::new(finger.model.vertices());
            let gap = Gaps::rigid(&depth_mm);
            let result = if gaps {
                solver.solve(gap, &mut out)
            } else {
                solver.solve(std::slice::from_ref(&object), &mut out)
            };
            result.expect("an answer");
            out.force_n.iter().map(|f| f * f).sum::<f64>().sqrt()
        };
        let (found, due) = (force(true), force(false));
        println!("shape {shape}: {found:.4} N by gaps, {due:.4} N by the object");
        assert!((found / due - 1.0).abs() < most, "shape {shape}: {found} N for {due} N");
    }
}

/// Pressure and force through a file, in which compliance is rounded to steps and the second order to
/// f16: they change by a tenth of the method's own 2 % at most, at 95 of 100 poses.
#[test]
fn a_file_changes_no_answer_by_a_tenth_of_its_error() {
    const POSES: usize = 300;
    let (header, exact) = arrays();
    // A model from a file of finer steps is rounded to those that are usual.
    let header = Header { compliance_step_mm_per_n: 0.0, ..header };
    let bytes = exact.to_bytes(&header).expect("bytes");
    let fingers = [(header, exact), Arrays::read(&bytes).expect("arrays")].map(Finger::of);
    let solver = |f: &Finger| Solver::new(f.model.clone(), Settings::default()).expect("a solver");
    let (mut solvers, shapes) = (fingers.each_ref().map(solver), shapes());
    let mut outs = fingers.each_ref().map(|f| Contact::new(f.model.vertices()));
    let mut random = fastrand::Rng::with_seed(5);
    let (mut pressures, mut forces, mut lost) = (Vec::new(), Vec::new(), 0);
    while pressures.len() < POSES {
        let shape = WIDE[random.usize(..WIDE.len())];
        let object = fingers[0].place(&shapes[shape], throw(&mut random, &fingers[0]));
        let mut judge = |which: usize| {
            let (solver, out) = (&mut solvers[which], &mut outs[which]);
            solver.reset();
            let found = solver.solve(std::slice::from_ref(&object), out);
            let touches = out.touched().len() > 3;
            found.is_ok() && out.quality.settled && !out.quality.out_of_range && touches
        };
        if !judge(0) {
            continue;
        }
        if !judge(1) {
            lost += 1;
            continue;
        }
        let [a, b] = outs.each_ref().map(|o| &o.pressure_pa);
        let miss: f32 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
        pressures.push(f64::from((miss / a.iter().map(|p| p * p).sum::<f32>()).sqrt()));
        let [a, b] = outs.each_ref().map(|o| o.force_n.iter().map(|f| f * f).sum::<f64>().sqrt());
        forces.push((b / a - 1.0).abs());
    }
    println!("{} bytes; {lost} poses are no longer judged", bytes.len());
    for (what, mut changes) in [("pressure", pressures), ("force", forces)] {
        changes.sort_by(f64::total_cmp);
        let [median, most, worst] = [POSES / 2, POSES * 95 / 100, POSES - 1].map(|i| changes[i]);
        println!("{what} changes by {median:.1e}, 95 %: {most:.1e}, at most {worst:.1e}");
        assert!(most < 2e-3, "{what} changes by {most}");
    }
    assert!(50 * lost <= POSES, "{lost} poses are no longer judged");
}
