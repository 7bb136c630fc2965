//! Contact on pixels at a plane that the skin cannot leave.

use crate::plane::{END_MM, MODULUS_MPA, Plane, force_n, half_plane, miss, plane_of};
use crate::support::ball;
use papilla_atlas::MAP_SIDE_PX;
use papilla_contact::PixelSpacing;

/// A frame settles to a hundredth of the force; some go on from there.
const FRAMES: usize = 8;
const SPACINGS: [PixelSpacing; 2] = [PixelSpacing::One, PixelSpacing::Two];

/// A ball on the plane presses its half as Hertz says, up to the map's last row.
#[test]
fn half_a_ball_on_the_plane_presses_as_half_of_hertz() {
    for (spacing, bound) in SPACINGS.into_iter().zip([0.04, 0.08]) {
        let Plane { solver, pixels, out, .. } = &mut half_plane(spacing);
        let (radius_mm, at, depth_mm) = (3.0, [END_MM, 0.0], 0.3);
        let scene = [ball(radius_mm, at, depth_mm)];
        (0..FRAMES).for_each(|_| solver.solve_on_pixels(&scene, pixels, out).unwrap());
        assert!(out.quality.settled);
        let miss = miss(pixels.map_pa(), radius_mm, at, depth_mm);
        assert!(miss < bound, "{spacing:?}: {miss}");
        let due = 2.0 / 3.0 * MODULUS_MPA * radius_mm.sqrt() * depth_mm.powf(1.5);
        assert!((out.force_n[2] / due - 1.0).abs() < 0.05, "{} {due}", out.force_n[2]);
    }
}

/// A ball near the plane presses as one of two that face each other across it.
#[test]
fn a_ball_near_the_plane_presses_as_one_of_a_pair() {
    for (spacing, away_mm) in [(SPACINGS[0], 0.3), (SPACINGS[0], 0.6), (SPACINGS[1], 0.6)] {
        let mut half = half_plane(spacing);
        let mut whole = plane_of(1.0, spacing);
        let one = [ball(3.0, [END_MM - away_mm, 0.0], 0.1)];
        let pair = [-away_mm, away_mm].map(|x| ball(3.0, [x, 0.0], 0.1));
        for (plane, scene) in [(&mut half, &one[..]), (&mut whole, &pair[..])] {
            let Plane { solver, pixels, out, .. } = plane;
            solver.solve_on_pixels(scene, pixels, out).unwrap();
        }
        let [found, due] = [2.0 * half.out.force_n[2], whole.out.force_n[2]];
        assert!((found / due - 1.0).abs() < 0.01, "{spacing:?} {away_mm}: {found} {due}");
        // The whole's middle is row 112, the half's end row 210.
        let rows = |map: &[f32], end: usize| map[..end * MAP_SIDE_PX].to_vec();
        let due = rows(whole.pixels.map_pa(), MAP_SIDE_PX / 2);
        let found = rows(half.pixels.map_pa(), 210);
        let found = &found[found.len() - due.len()..];
        let norm = |values: &mut dyn Iterator<Item = f32>| values.map(|v| v * v).sum::<f32>();
        let off = norm(&mut found.iter().zip(&due).map(|(a, b)| a - b));
        let miss = (off / norm(&mut due.iter().copied())).sqrt();
        assert!(miss < 0.02, "{spacing:?} {away_mm}: {miss}");
    }
}

/// What leaves over the plane presses less and less, without a leap.
#[test]
fn a_ball_leaves_over_the_plane_without_a_leap() {
    let Plane { solver, pixels, out, .. } = &mut half_plane(PixelSpacing::Two);
    let mut last = f64::NAN;
    for step in 0..24 {
        let scene = [ball(3.0, [END_MM - 0.6 + 0.1 * f64::from(step), 0.0], 0.3)];
        solver.solve_on_pixels(&scene, pixels, out).unwrap();
        let now = force_n(out);
        let most = if step == 0 { now } else { last };
        assert!(now <= 1.01 * most, "step {step}: {now} after {last}");
        assert!(step == 0 || last - now < 0.006, "step {step}: {now} after {last}");
        last = now;
    }
    assert!(last < 1e-3, "{last}");
}
