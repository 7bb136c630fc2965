//! How far the whole skin moves.

use crate::plane::{MODULUS_MPA, Plane, plane};
use crate::support::{ball, small_strain, solver, vertex};
use papilla_contact::{Displacement, Object};

/// Under a ball of radius R the skin of a half-space moves by `d - r^2 / 2R` in contact (Hertz), and by
/// `F / (pi E* r)` far from it.
#[test]
fn skin_moves_as_hertz_says_in_contact_and_as_under_a_point_far_away() {
    let (radius_mm, depth_mm) = (10.0, 0.06);
    let (mut solver, mut out) = solver(small_strain());
    let mut displacement = Displacement::new(&solver);
    let mut moved_mm = vec![[0.0; 3]; out.pressure_pa.len()];
    solver.solve(&[ball(radius_mm, [0.0; 2], depth_mm)], &mut out).expect("an answer");
    displacement.fill(&solver, None, &out, &mut moved_mm);
    let (mut inside, mut outside) = (0, 0);
    for (i, moved) in moved_mm.iter().enumerate() {
        let [x, y] = vertex(i);
        let r = x.hypot(y);
        assert!(moved[0] == 0.0 && moved[1] == 0.0, "the patch moves along z alone: {moved:?}");
        let z = f64::from(moved[2]);
        if out.pressure_pa[i] > 0.0 {
            let due = depth_mm - r * r / (2.0 * radius_mm);
            assert!((z - due).abs() < 1e-3, "{z} for {due} at {r} mm");
            inside += 1;
        } else if r > 1.2 {
            let due = out.force_n[2] / (std::f64::consts::PI * MODULUS_MPA * r);
            assert!((z / due - 1.0).abs() < 0.15, "{z} for {due} at {r} mm");
            outside += 1;
        }
    }
    assert!(inside > 20 && outside > 20, "{inside} {outside}");
    solver.solve(&[] as &[Object; 0], &mut out).expect("an answer");
    displacement.fill(&solver, None, &out, &mut moved_mm);
    assert!(moved_mm.as_flattened().iter().all(|u| *u == 0.0), "nothing touches, nothing moves");
}

/// Between what pixels move and what vertices move there is no step, and skin stays out of the ball.
#[test]
fn pixels_and_vertices_move_one_skin() {
    let (radius_mm, depth_mm) = (3.0, 0.3);
    let Plane { solver, pixels, out, .. } = &mut plane();
    solver.solve_on_pixels(&[ball(radius_mm, [0.0; 2], depth_mm)], pixels, out).unwrap();
    let mut displacement = Displacement::new(solver);
    let mut moved_mm = vec![[0.0; 3]; out.pressure_pa.len()];
    displacement.fill(solver, Some(pixels), out, &mut moved_mm);
    let most = moved_mm.iter().map(|u| f64::from(u[2])).fold(0.0, f64::max);
    assert!((most / depth_mm - 1.0).abs() < 0.06, "{most} mm under a ball {depth_mm} mm deep");
    let side = moved_mm.len().isqrt();
    let at = |row: usize, column: usize| f64::from(moved_mm[row * side + column][2]);
    let middle = side / 2;
    // Outwards along a row of the grid the dent gets shallower, and nowhere by a jump.
    for column in middle..side - 2 {
        let [a, b] = [at(middle, column), at(middle, column + 1)];
        assert!(b <= a + 0.02 * most && a - b < 0.5 * most, "{a} to {b} at {column}");
    }
}
