//! What no finger can be made of is named with its place; what is mended is said.

use crate::surfaces::{FINE, NOTHING, fit_of, moved, rings, scanned, skin, turned, where_it_is};
use papilla_fingertip::geometry::fingertip::FingertipShape;
use papilla_fingertip::geometry::fingertip::offset::at_uv;
use papilla_fingertip::scene::Finger;
use papilla_scan::clean::clean;
use papilla_scan::fit::{Inside, Where, fit};
use papilla_scan::{ScanError, Surface};

const SIZE: [u32; 2] = [40, 48];

fn finger() -> Surface {
    scanned(skin(&FingertipShape::default(), SIZE))
}

/// Two surfaces in one.
fn with(mut surface: Surface, other: &Surface) -> Surface {
    let first = surface.vertices_mm.len() as u32;
    surface.vertices_mm.extend(&other.vertices_mm);
    surface.triangles.extend(other.triangles.iter().map(|t| t.map(|c| c + first)));
    surface
}

fn shifted(mut surface: Surface, by: [f64; 3]) -> Surface {
    surface.vertices_mm.iter_mut().for_each(|p| *p = std::array::from_fn(|i| p[i] + by[i]));
    surface
}

fn scaled(mut surface: Surface, by: f64) -> Surface {
    surface.vertices_mm.iter_mut().for_each(|p| *p = p.map(|v| by * v));
    surface
}

/// Without the triangles that have a corner near a place of the finger's frame.
fn pierced(mut surface: Surface, at: [f64; 3], radius_mm: f64) -> Surface {
    let at = moved(at);
    let away = |p: [f64; 3]| (0..3).map(|i| (p[i] - at[i]).powi(2)).sum::<f64>().sqrt();
    let corners = surface.vertices_mm.clone();
    surface.triangles.retain(|t| t.iter().all(|&c| away(corners[c as usize]) > radius_mm));
    surface
}

#[test]
fn two_fingers_are_told_apart_and_a_crumb_is_dropped() {
    let two = with(finger(), &shifted(finger(), [0.0, 40.0, 0.0]));
    let e = fit_of(&two).err().unwrap();
    assert!(matches!(e, ScanError::Pieces { count: 2, .. }), "{e}");
    assert!(e.to_string().contains("two fingers"), "{e}");
    let crumb = shifted(scaled(finger(), 0.03), moved([5.0, 30.0, 0.0]));
    let cleaned = clean(&with(finger(), &crumb), turned([1.0, 0.0, 0.0])).unwrap();
    assert!(cleaned.done.iter().any(|d| d.contains("dropped 1 small pieces")));
    assert_eq!(cleaned.surface.triangles.len(), finger().triangles.len());
    assert_eq!(cleaned.cut.len(), SIZE[1] as usize, "the cut end stays open");
}

#[test]
fn a_small_hole_is_closed_and_a_large_one_is_named() {
    let shape = FingertipShape::default();
    let place = shape.skin(at_uv([0.25, 1.2]));
    let cleaned = clean(&pierced(finger(), place, 0.5), turned([1.0, 0.0, 0.0])).unwrap();
    assert!(cleaned.done.iter().any(|d| d.contains("closed a hole of")), "{:?}", cleaned.done);
    let e = fit_of(&pierced(finger(), place, 4.0)).err().unwrap();
    let ScanError::Hole { at_mm, .. } = &e else { panic!("{e}") };
    let due = moved(place);
    assert!((0..3).all(|i| (at_mm[i] - due[i]).abs() < 2.0), "{at_mm:?} for {due:?}");
}

#[test]
fn triangles_that_are_turned_inward_are_turned_outward() {
    let mut mixed = finger();
    mixed.triangles.iter_mut().step_by(3).for_each(|t| t.swap(0, 1));
    let (one, two) = (fit_of(&finger()).unwrap(), fit_of(&mixed).unwrap());
    assert!((one.finger.shape.width_mm - two.finger.shape.width_mm).abs() < 1e-6);
    assert!(two.done.iter().any(|d| d.starts_with("turned")), "{:?}", two.done);
    let mut inward = finger();
    inward.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    assert!(fit_of(&inward).unwrap().done.iter().any(|d| d.starts_with("turned")));
}

#[test]
fn a_whole_hand_is_no_fingertip() {
    // A palm behind the finger, as wide as one is.
    let shape = FingertipShape::default();
    let hand = rings(SIZE, |[u, v]| {
        let [x, y, z] = shape.skin(at_uv([u, v]));
        let wide = 1.0 + 9.0 * (v - 1.4).max(0.0);
        [x + 60.0 * (v - 1.0).max(0.0), wide * y, z]
    });
    let e = fit_of(&scanned(hand)).err().unwrap();
    assert!(matches!(e, ScanError::Hand { .. }), "{e}");
    assert!(e.to_string().contains("a whole hand"), "{e}");
}

#[test]
fn triangles_without_area_are_no_surface() {
    let mut lines = finger();
    lines.triangles.iter_mut().for_each(|t| t[2] = t[1]);
    let e = fit_of(&lines).err().unwrap();
    assert!(matches!(e, ScanError::Flat { .. }), "{e}");
}

#[test]
fn a_tip_and_an_axis_that_are_elsewhere_are_named() {
    let refused = |at: &Where| fit(&finger(), at, &NOTHING).err().unwrap();
    let e = refused(&Where { tip_mm: moved([-20.0, 0.0, 0.0]), ..where_it_is() });
    assert!(matches!(e, ScanError::Tip { away_mm, .. } if (away_mm - 20.0).abs() < 0.5), "{e}");
    let e = refused(&Where { axis: turned([-1.0, 0.0, 0.0]), ..where_it_is() });
    assert!(e.to_string().contains("points out of the finger"), "{e}");
    let e = refused(&Where { axis: [0.0; 3], ..where_it_is() });
    assert!(e.to_string().contains("has no direction"), "{e}");
    let e = refused(&Where { length_mm: Some(40.0), ..where_it_is() });
    assert!(matches!(e, ScanError::Short { .. }), "{e}");
}

#[test]
fn a_ball_is_no_finger() {
    let ball = rings(SIZE, |[u, v]| {
        let (y, z) = (std::f64::consts::TAU * u).sin_cos();
        let (round, x) = (0.45 * std::f64::consts::PI * v).sin_cos();
        [9.0 - 9.0 * x, 9.0 * round * y, -9.0 * round * z]
    });
    // It is fitted, or refused with a reason; never a finger with a folded mesh.
    match fit_of(&scanned(ball)) {
        Ok(fitted) => assert!(fitted.scaled_jacobian_min > 0.03),
        Err(e) => assert!(!e.to_string().is_empty()),
    }
    // A cone is blunter or sharper than any fingertip.
    let cone = rings(SIZE, |[u, v]| {
        let (y, z) = (std::f64::consts::TAU * u).sin_cos();
        [20.0 * v, 10.0 * v * y, -10.0 * v * z]
    });
    let e = fit_of(&scanned(cone)).err().unwrap();
    assert!(
        matches!(e, ScanError::Misfit { .. } | ScanError::Mesh(_) | ScanError::Finger(_)),
        "{e}"
    );
}

#[test]
fn a_bone_outside_of_the_skin_is_named() {
    let shape = FingertipShape::default();
    let bone = scanned(rings(SIZE, |uv| {
        let [x, y, z] = shape.bone(at_uv(uv));
        [x, y + 6.0, z]
    }));
    let e = fit(&finger(), &where_it_is(), &Inside { bone: Some(&bone), ..NOTHING });
    let e = e.err().unwrap();
    assert!(matches!(e, ScanError::BoneOutside { out_mm, .. } if out_mm > 1.0), "{e}");
    let mut numbers = Finger::usual();
    numbers.shape.bone_base_mm = [19.0, 6.5];
    let e = fit(&finger(), &where_it_is(), &Inside { numbers: Some(&numbers), ..NOTHING });
    let e = e.err().unwrap().to_string();
    assert!(e.contains("the bone is only") && e.contains("below the skin at x ="), "{e}");
}

#[test]
fn layers_thicker_than_the_pulp_are_named() {
    let mut numbers = Finger::usual();
    numbers.shape.dermis_mm = 3.0;
    numbers.shape.epidermis_mm = 1.5;
    numbers.shape.bone_offset_mm = 0.5;
    let e = fit(&finger(), &where_it_is(), &Inside { numbers: Some(&numbers), ..NOTHING });
    let e = e.err().unwrap().to_string();
    assert!(e.contains("4.50 mm thick") && e.contains("they may take"), "{e}");
}

#[test]
fn a_skin_that_folds_is_refused_by_place() {
    // A deep narrow furrow beside the nail.
    let shape = FingertipShape::default();
    let folded = rings(FINE, |[u, v]| {
        let p = shape.skin(at_uv([u, v]));
        let n = shape.skin_normal_at(at_uv([u, v]));
        let deep = 4.5 * (-((u - 0.38) / 0.035).powi(2) - ((v - 0.9) / 0.12).powi(2)).exp();
        std::array::from_fn(|i| p[i] - deep * n[i])
    });
    let e = fit_of(&scanned(folded)).err().unwrap().to_string();
    assert!(e.contains("folds at the") || e.contains("the bone is only"), "{e}");
    assert!(e.contains("mm"), "{e}");
}
