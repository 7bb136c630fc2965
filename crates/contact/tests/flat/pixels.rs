//! Contact on pixels against closed forms, where vertices are too far apart to see.

use crate::plane::{MODULUS_MPA, PITCH_MM, Plane, force_n, miss, plane, plane_of};
use crate::support::ball;
use papilla_atlas::MAP_LEN;
use papilla_contact::{NetForce, Object, PixelSpacing};
use papilla_sdf::{Placement, Plate, RoundedPlate};
use std::sync::Arc;

#[test]
fn hertz_pressure_comes_out_of_a_contact_of_few_vertices() {
    let presses = [(3.0, [0.0, 0.0], 0.3), (3.0, [0.3, 0.2], 0.25)];
    let spacings = [(PixelSpacing::One, 0.04), (PixelSpacing::Two, 0.06)];
    for ((spacing, bound), (radius_mm, at, depth_mm)) in
        spacings.into_iter().flat_map(|spacing| presses.map(|press| (spacing, press)))
    {
        let scene = [ball(radius_mm, at, depth_mm)];
        let Plane { solver, pixels, raster, out } = &mut plane_of(1.0, spacing);
        solver.solve(&scene, out).unwrap();
        let mut map_pa = vec![0.0; MAP_LEN];
        raster.rasterise(&out.pressure_pa, &mut map_pa).unwrap();
        let at_vertices = miss(&map_pa, radius_mm, at, depth_mm);
        solver.solve_on_pixels(&scene, pixels, out).unwrap();
        let on_pixels = miss(pixels.map_pa(), radius_mm, at, depth_mm);
        assert!(on_pixels < bound, "{spacing:?}: {on_pixels}");
        assert!(at_vertices > 2.0 * on_pixels, "{at_vertices} {on_pixels}");
        let due = 4.0 / 3.0 * MODULUS_MPA * radius_mm.sqrt() * depth_mm.powf(1.5);
        assert!((out.force_n[2] / due - 1.0).abs() < 0.05, "{} {due}", out.force_n[2]);
    }
}

/// Means over pixels are the force, too.
#[test]
fn a_map_holds_the_force() {
    for spacing in [PixelSpacing::One, PixelSpacing::Two] {
        let Plane { solver, pixels, out, .. } = &mut plane_of(1.0, spacing);
        solver.solve_on_pixels(&[ball(3.0, [0.1, 0.0], 0.1)], pixels, out).unwrap();
        let sum_n: f64 =
            pixels.map_pa().iter().map(|p| 1e-6 * f64::from(*p) * PITCH_MM * PITCH_MM).sum();
        assert!((sum_n / out.force_n[2] - 1.0).abs() < 0.02, "{sum_n} {}", out.force_n[2]);
    }
}

/// Linear elements move the vertex that is pressed more than twice as far as skin moves.
#[test]
fn a_meshs_own_dent_leaves_no_trace() {
    for (radius_mm, at, depth_mm) in [(3.0, [0.0, 0.0], 0.3), (1.0, [0.1, 0.2], 0.15)] {
        let scene = [ball(radius_mm, at, depth_mm)];
        let [true_n, found_n] = [1.0, 2.3].map(|own| {
            let mut plane = plane_of(own, PixelSpacing::One);
            let Plane { solver, pixels, out, .. } = &mut plane;
            solver.solve_on_pixels(&scene, pixels, out).unwrap();
            assert!(out.quality.settled);
            out.force_n[2]
        });
        assert!((found_n / true_n - 1.0).abs() < 0.05, "{found_n} {true_n}");
    }
}

/// Skin inside a ridge, as deep as that is wide, is nearer to its sides than to its top.
#[test]
fn a_ridge_deeper_than_it_is_wide_presses_with_its_top() {
    let ridge = Plate { size_mm: [0.5, 3.0], edge_radius_mm: 0.1 };
    let shape = RoundedPlate::from(&ridge);
    let mut plane = plane();
    let Plane { solver, pixels, out, .. } = &mut plane;
    let mut press = |depth_mm: f64| {
        let place = Placement::turned(0.0, 0.0, 0.0, [0.35, 0.0, depth_mm - shape.half_mm[2]]);
        solver.reset();
        pixels.reset();
        let object = Object::rigid(Arc::new(shape), place);
        solver.solve_on_pixels(&[object], pixels, out).unwrap();
        force_n(out)
    };
    // A punch's force is in proportion to its depth; from nothing such frames do not quite settle.
    let [half, whole] = [0.2, 0.4].map(&mut press);
    assert!((1.5..2.5).contains(&(whole / half)), "{half} {whole}");
}

/// A dot between four vertices touches none of them.
#[test]
fn a_dot_between_vertices_is_felt() {
    let mut plane = plane();
    let at = [0.35, 0.35];
    let scene = [ball(0.5, at, 0.1)];
    let Plane { solver, pixels, out, .. } = &mut plane;
    solver.solve(&scene, out).unwrap();
    assert!(out.force_n[2] == 0.0, "vertices see nothing");
    solver.solve_on_pixels(&scene, pixels, out).unwrap();
    let due = 4.0 / 3.0 * MODULUS_MPA * 0.5f64.sqrt() * 0.1f64.powf(1.5);
    assert!((out.force_n[2] / due - 1.0).abs() < 0.15, "{} {due}", out.force_n[2]);
    assert!(miss(pixels.map_pa(), 0.5, at, 0.1) < 0.2);
}

#[test]
fn air_and_no_object_press_nothing() {
    let mut plane = plane();
    let Plane { solver, pixels, out, .. } = &mut plane;
    solver.solve_on_pixels(&[ball(3.0, [0.0, 0.0], 0.3)], pixels, out).unwrap();
    solver.solve_on_pixels(&[ball(3.0, [0.0, 0.0], -0.1)], pixels, out).unwrap();
    assert!(pixels.map_pa().iter().all(|p| *p == 0.0) && force_n(out) == 0.0);
    // Nor does a dot that has left, whatever the dent that it had made.
    solver.solve_on_pixels(&[ball(0.5, [0.35, 0.35], 0.2)], pixels, out).unwrap();
    assert!(force_n(out) > 0.0);
    solver.solve_on_pixels(&[ball(0.5, [0.35, 0.35], -0.02)], pixels, out).unwrap();
    assert!(pixels.map_pa().iter().all(|p| *p == 0.0) && force_n(out) == 0.0);
    let none: [Object; 0] = [];
    solver.solve_on_pixels(&none, pixels, out).unwrap();
    assert!(force_n(out) == 0.0);
    // Far away one distance is asked, as at vertices.
    solver.solve_on_pixels(&[ball(3.0, [0.0, 0.0], -20.0)], pixels, out).unwrap();
    assert_eq!((out.effort.distances, out.effort.iterations), (1, 0));
}

/// Half of the ball presses where the skin goes on and the map does not: no rim of pressure.
#[test]
fn the_skins_edge_is_no_edge_of_a_punch() {
    let mut plane = plane();
    let scene = [ball(6.0, [4.9, 0.0], 0.3)];
    let Plane { solver, pixels, out, .. } = &mut plane;
    solver.solve(&scene, out).unwrap();
    let (peak_pa, force) = (out.pressure_pa.iter().copied().fold(0.0, f32::max), force_n(out));
    solver.solve_on_pixels(&scene, pixels, out).unwrap();
    assert!((force_n(out) / force - 1.0).abs() < 0.05, "{} {force}", force_n(out));
    assert!(pixels.peak_pa() < 1.3 * peak_pa, "{} {peak_pa}", pixels.peak_pa());
}

/// A frame that moved a little takes less than one from nothing, and finds the same.
#[test]
fn a_warm_frame_finds_what_a_cold_one_does_with_less() {
    let mut plane = plane();
    let Plane { solver, pixels, out, .. } = &mut plane;
    solver.solve_on_pixels(&[ball(3.0, [0.0, 0.0], 0.29)], pixels, out).unwrap();
    let scene = [ball(3.0, [0.02, 0.0], 0.3)];
    solver.solve_on_pixels(&scene, pixels, out).unwrap();
    let (warm, warm_n) = (out.effort, force_n(out));
    solver.reset();
    pixels.reset();
    solver.solve_on_pixels(&scene, pixels, out).unwrap();
    assert!((warm_n / force_n(out) - 1.0).abs() < 0.01, "{warm_n} {}", force_n(out));
    assert!(2 * warm.products < out.effort.products, "{warm:?} {:?}", out.effort);
}

/// Hats are as large at a frame's start as they were at the end of the last one.
#[test]
fn a_frame_that_stands_still_takes_one_round_and_stays() {
    let mut plane = plane();
    let scene = [ball(3.0, [0.0, 0.0], 0.3)];
    let Plane { solver, pixels, out, .. } = &mut plane;
    for _ in 0..3 {
        solver.solve_on_pixels(&scene, pixels, out).unwrap();
    }
    let before = pixels.map_pa().to_vec();
    solver.solve_on_pixels(&scene, pixels, out).unwrap();
    let (mut off, mut size) = (0.0, 0.0);
    for (now, last) in pixels.map_pa().iter().zip(&before) {
        off += f64::from(now - last).powi(2);
        size += f64::from(*last).powi(2);
    }
    assert!((off / size).sqrt() < 1e-2, "{}", (off / size).sqrt());
    // A linearisation or two at vertices find that nothing moves, then one round.
    assert!(out.effort.iterations <= 3, "{:?}", out.effort);
}

#[test]
fn what_gives_way_presses_less() {
    let mut plane = plane();
    let Plane { solver, pixels, out, .. } = &mut plane;
    let mut force = |stiffness_mpa_per_mm: f64| {
        let object = Object { stiffness_mpa_per_mm, ..ball(3.0, [0.0, 0.0], 0.3) };
        solver.reset();
        pixels.reset();
        // One frame settles to a hundredth of the force, on its own way; some go on from there.
        for _ in 0..20 {
            solver.solve_on_pixels(std::slice::from_ref(&object), pixels, out).unwrap();
        }
        force_n(out)
    };
    let [soft, hard, rigid] = [0.1, 1e4, f64::INFINITY].map(&mut force);
    assert!((hard / rigid - 1.0).abs() < 2e-3, "{hard} {rigid}");
    // A bed of springs alone under a ball: F = s pi R d^2. In series, less than either.
    let bed = 0.1 * std::f64::consts::PI * 3.0 * 0.3f64.powi(2);
    assert!(soft < bed && soft < rigid && soft > 0.3 * bed, "{soft} {bed} {rigid}");
}

/// The next frame has the same bits in place of and beside the one that remembers.
#[test]
fn a_memory_goes_on_as_the_contact_that_it_is_of() {
    let [mut here, mut there] = [plane(), plane()];
    let scene = |step: u32| [ball(3.0, [0.01 * f64::from(step), 0.0], 0.3)];
    for step in 0..3 {
        here.solver.solve_on_pixels(&scene(step), &mut here.pixels, &mut here.out).unwrap();
    }
    assert!(there.solver.recall(&here.solver.memory()));
    assert!(there.pixels.recall(&here.pixels.memory()));
    for Plane { solver, pixels, out, .. } in [&mut here, &mut there] {
        solver.solve_on_pixels(&scene(3), pixels, out).unwrap();
    }
    assert!(here.pixels.map_pa() == there.pixels.map_pa() && here.out == there.out);

    let mut foreign = here.pixels.memory();
    foreign.vertices[0] = 1 << 20;
    assert!(!there.pixels.recall(&foreign));
    there.solver.reset();
    let nothing = plane().pixels.memory();
    assert!(nothing.pixels.is_empty() && there.pixels.recall(&nothing));
}

/// Vertices see a ball, and nothing of a dot between four of them: the force is met under both.
#[test]
fn a_net_force_is_met_on_pixels() {
    for (radius_mm, at, force_n) in [(3.0, [0.0, 0.0], 0.05), (0.5, [0.35, 0.35], 0.005)] {
        let mut plane = plane();
        let Plane { solver, pixels, out, .. } = &mut plane;
        let net = NetForce { direction: [0.0, 0.0, 1.0], force_n };
        let scene = [ball(radius_mm, at, -0.02)];
        let travel = solver.solve_for_force_on_pixels(&scene, net, pixels, out).unwrap();
        assert!((out.force_n[2] / force_n - 1.0).abs() <= 0.01, "{:?}", out.force_n);
        // Hertz: F = 4/3 E* sqrt(R) d^1.5.
        let hertz = 4.0 / 3.0 * MODULUS_MPA * f64::sqrt(radius_mm);
        let due = 0.02 + (force_n / hertz).powf(2.0 / 3.0);
        assert!((travel / due - 1.0).abs() < 0.1, "{travel} {due}");
        let cold = out.effort;
        solver.solve_for_force_on_pixels(&scene, net, pixels, out).unwrap();
        assert!(2 * out.effort.products < cold.products, "{:?} {cold:?}", out.effort);
    }
}
