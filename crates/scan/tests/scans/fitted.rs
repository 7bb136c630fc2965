//! Known fingers are found again.

use crate::surfaces::{FINE, NOTHING, fit_of, rings, scanned, skin, where_it_is};
use papilla_fingertip::geometry::fingertip::FingertipShape;
use papilla_fingertip::geometry::fingertip::LayerMap;
use papilla_fingertip::geometry::fingertip::offset::at_uv;
use papilla_fingertip::mesh::fingertip::{Density, Order};
use papilla_fingertip::scene::finger::Thickness;
use papilla_fingertip::scene::{Finger, Geometry, Motion, Pose, Scene};
use papilla_fingertip::simulation::Simulation;
use papilla_scan::fit::{Inside, Where, fit};
use papilla_scan::{Surface, picture};

/// Force at the end of a press of a coarse mesh, N.
fn force_n(shape: &FingertipShape) -> f64 {
    let scene = Scene {
        geometry: Geometry::Fingertip {
            density: Density::Coarse,
            order: Order::Linear,
            shape: shape.clone(),
            finger: None,
        },
        motion: Motion::to_depth(0.6, 1, Pose::default()),
        ..Scene::usual()
    };
    let mut force = 0.0;
    Simulation::new(&scene)
        .unwrap()
        .run(&mut |_, record, _| force = record.force_n[2].abs())
        .unwrap();
    force
}

fn assert_near(found: f64, truth: f64, tolerance: f64, what: &str) {
    assert!((found - truth).abs() < tolerance, "{what}: {found} for {truth}");
}

/// The dimensions of the skin.
fn assert_found(found: &FingertipShape, truth: &FingertipShape, tolerance_mm: f64) {
    assert_near(found.length_mm, truth.length_mm, 0.3, "length");
    assert_near(found.width_mm, truth.width_mm, tolerance_mm, "width");
    assert_near(found.height_mm, truth.height_mm, tolerance_mm, "height");
    assert_near(found.cap_length_mm, truth.cap_length_mm, 3.0 * tolerance_mm, "cap length");
    assert_near(found.cap_exponent, truth.cap_exponent, 0.05, "cap exponent");
    assert_near(found.crease_depth_mm, truth.crease_depth_mm, 3.0 * tolerance_mm, "crease");
}

#[test]
fn a_scan_of_the_default_finger_gives_its_dimensions_and_its_force() {
    let truth = FingertipShape::default();
    let fitted = fit_of(&scanned(skin(&truth, FINE))).unwrap();
    let found = &fitted.finger.shape;
    assert_found(found, &truth, 0.05);
    assert!(fitted.template_rms_mm < 0.02, "{}", fitted.template_rms_mm);
    assert!(fitted.skin.rms_mm < 0.01, "{}", fitted.skin.rms_mm);
    let (force, due) = (force_n(found), force_n(&truth));
    assert_near(force / due, 1.0, 0.01, "force");
}

#[test]
fn the_nail_is_found_where_nobody_said_where_it_is() {
    let truth = FingertipShape::default();
    let surface = scanned(skin(&truth, [40, 48]));
    let at = Where { nail: None, ..where_it_is() };
    let found = fit(&surface, &at, &NOTHING).unwrap().finger.shape;
    assert_found(&found, &truth, 0.1);
    assert!(found.crease_depth_mm > 1.0, "the crease is on the pad's side");
    // A round finger without a crease looks the same from both sides.
    let round = FingertipShape { crease_depth_mm: 0.0, height_mm: truth.width_mm, ..truth };
    let e = fit(&scanned(skin(&round, [40, 48])), &at, &NOTHING).err().unwrap().to_string();
    assert!(e.contains("--nail x,y,z"), "{e}");
}

#[test]
fn a_small_and_a_wide_finger_are_found() {
    let usual = FingertipShape::default();
    let child = FingertipShape {
        length_mm: 17.0,
        width_mm: 12.0,
        height_mm: 9.5,
        cap_length_mm: 8.0,
        crease_depth_mm: 1.5,
        ..usual.clone()
    };
    let thumb = FingertipShape {
        length_mm: 31.0,
        width_mm: 22.5,
        height_mm: 13.0,
        cap_length_mm: 13.0,
        cap_exponent: 2.4,
        crease_depth_mm: 2.0,
        ..usual
    };
    for truth in [child, thumb] {
        let fitted = fit_of(&scanned(skin(&truth, FINE))).unwrap();
        assert_found(&fitted.finger.shape, &truth, 0.1);
        // What cannot be seen follows in proportion.
        let wide = fitted.finger.shape.width_mm / 17.44;
        assert_near(fitted.finger.shape.bone_base_mm[0], 10.0 * wide, 1e-9, "bone");
        assert!(fitted.done.iter().any(|d| d.contains("in proportion")));
    }
}

#[test]
fn a_finger_that_grows_up_to_the_knuckle_has_its_thickest_section_near_the_tip() {
    // As the fingers of hand models do: a tube without a crease, a fifth wider at its far end.
    let tube = FingertipShape {
        length_mm: 42.0,
        width_mm: 14.0,
        height_mm: 12.0,
        cap_length_mm: 7.0,
        crease_depth_mm: 0.0,
        ..FingertipShape::default()
    };
    let surface = rings(FINE, |uv| {
        let [x, y, z] = tube.template_skin(at_uv(uv));
        let wider = 1.0 + 0.22 * ((x - 7.0) / 35.0).max(0.0);
        [x, wider * y, wider * z - 0.06 * x]
    });
    let fitted = fit_of(&scanned(surface)).unwrap();
    let found = &fitted.finger.shape;
    assert!(found.cap_length_mm <= 0.85 * found.width_mm + 1e-9, "{}", found.cap_length_mm);
    assert!(fitted.skin.rms_mm < 0.05, "{}", fitted.skin.rms_mm);
    assert!(fitted.done.iter().any(|d| d.contains("grows thicker")), "{:?}", fitted.done);
}

/// A finger that the template alone is not: bent to the side and downward, with a swelling.
fn bent([u, v]: [f64; 2]) -> [f64; 3] {
    let shape = FingertipShape::default();
    let [x, y, z] = shape.skin(at_uv([u, v]));
    let away = (x - 12.0).powi(2) + (y - 8.0).powi(2) + z * z;
    let swelling = 1.0 + 0.08 * (-away / 18.0).exp();
    [x, swelling * y + 0.004 * x * x, z - 0.002 * x * x]
}

#[test]
fn the_skin_of_a_bent_finger_lies_on_its_surface() {
    let surface = scanned(rings(FINE, bent));
    let fitted = fit_of(&surface).unwrap();
    assert!(fitted.template_rms_mm > 0.05, "{}", fitted.template_rms_mm);
    assert!(fitted.finger.shape.offset.is_some());
    assert!(fitted.skin.rms_mm < 0.03, "{}", fitted.skin.rms_mm);
    // The finger's own skin, asked for itself.
    let shape = &fitted.finger.shape;
    let mut worst = 0.0_f64;
    for i in 0..18 {
        for j in 0..24 {
            let uv = [f64::from(j) / 24.0, f64::from(i) / 10.0];
            worst = worst.max(fitted.surface.gap_mm(shape.skin(at_uv(uv))).abs());
        }
    }
    assert!(worst < 0.15, "{worst}");
    assert!(fitted.scaled_jacobian_min > 0.05);
    assert!(picture::draw(&fitted).unwrap().len() > 10_000);
    // The parameter of a point of such a skin is its own.
    for uv in [[0.1, 0.4], [0.45, 1.2], [0.9, 0.9]] {
        let p = shape.skin(at_uv(uv));
        let q = shape.on_skin(p);
        assert!((0..3).all(|i| (p[i] - q[i]).abs() < 1e-6), "{p:?} {q:?}");
    }
}

#[test]
fn the_same_surface_gives_the_same_bits() {
    let surface = scanned(rings([30, 40], bent));
    let (one, two) = (fit_of(&surface).unwrap(), fit_of(&surface).unwrap());
    assert_eq!(one.finger, two.finger);
    assert_eq!(one.finger.to_toml(), two.finger.to_toml());
    assert_eq!(picture::draw(&one).unwrap(), picture::draw(&two).unwrap());
}

#[test]
fn a_nail_is_taken_from_its_surface() {
    let truth = FingertipShape::default();
    // A plate 9 mm wide that begins 1 mm before the tip; an open patch above the skin.
    let plate = |[u, v]: [f64; 2]| {
        let y = 9.0 * (u - 0.5);
        let x = 14.0 * v - 1.0;
        [x, y, truth.on_skin([x.max(3.0), y, 6.0])[2] + 0.4]
    };
    let count = 8;
    let mut nail = Surface { vertices_mm: vec![], triangles: vec![] };
    for i in 0..=count {
        let at = |k: u32| f64::from(k) / f64::from(count);
        nail.vertices_mm.extend((0..=count).map(|j| plate([at(j), at(i)])));
    }
    for n in (0..count * (count + 1)).filter(|n| n % (count + 1) < count) {
        nail.triangles.extend([[n, n + 1, n + count + 1], [n + 1, n + count + 2, n + count + 1]]);
    }
    let nail = scanned(nail);
    let inside = Inside { nail: Some(&nail), ..NOTHING };
    let fitted = fit(&scanned(skin(&truth, FINE)), &where_it_is(), &inside).unwrap();
    let found = &fitted.finger.shape;
    assert_near(found.nail_mm[0], 9.0, 0.1, "width");
    assert_near(found.nail_mm[1], 12.9, 0.2, "length");
    assert_near(found.nail_tip_mm, 0.1, 1e-9, "free edge");
    assert!(fitted.done.iter().any(|d| d.contains("the nail was taken")), "{:?}", fitted.done);
    // Of another finger, 20 mm away.
    let mut away = nail.clone();
    away.vertices_mm.iter_mut().for_each(|p| p[1] += 20.0);
    let inside = Inside { nail: Some(&away), ..NOTHING };
    let e = fit(&scanned(skin(&truth, FINE)), &where_it_is(), &inside).err().unwrap();
    assert!(e.to_string().contains("the nail's surface is not on the back"), "{e}");
}

#[test]
fn a_map_of_the_dermis_is_taken_as_it_is() {
    let row = |i: u32| (0..24).map(|j| 0.8 + 0.01 * f64::from(i) + 0.001 * f64::from(j)).collect();
    let map = LayerMap::new((0..17).map(row).collect()).unwrap();
    let inside = Inside {
        dermis: Some(Thickness::Map(map.clone())),
        epidermis: Some(Thickness::Number(0.3)),
        ..NOTHING
    };
    let fitted =
        fit(&scanned(skin(&FingertipShape::default(), FINE)), &where_it_is(), &inside).unwrap();
    let shape = &fitted.finger.shape;
    assert_eq!((shape.epidermis_mm, shape.dermis_map.as_deref()), (0.3, Some(&map)));
    let text = fitted.finger.to_toml();
    let read = Finger::parse(std::path::Path::new("finger.toml"), text).unwrap();
    assert_eq!(read.shape.dermis_map.as_deref(), Some(&map));
}

#[test]
fn a_bone_is_fitted_to_its_surface() {
    let truth = FingertipShape {
        bone_tuft_mm: [6.5, 3.4],
        bone_base_mm: [9.0, 6.0],
        bone_offset_mm: 1.4,
        ..FingertipShape::default()
    };
    let bone = scanned(rings([40, 40], |uv| truth.bone(at_uv(uv))));
    let inside = Inside { bone: Some(&bone), ..NOTHING };
    let fitted = fit(&scanned(skin(&truth, FINE)), &where_it_is(), &inside).unwrap();
    let found = &fitted.finger.shape;
    assert_near(found.bone_offset_mm, 1.4, 0.1, "offset");
    for k in 0..2 {
        assert_near(found.bone_tuft_mm[k], truth.bone_tuft_mm[k], 0.25, "tuft");
        assert_near(found.bone_base_mm[k], truth.bone_base_mm[k], 0.25, "base");
    }
}
