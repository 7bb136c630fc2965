use super::shapes::{Shape, cylinder_sector, octahedron, spherical_cap, tongue};
use super::*;
use crate::{Atlas, MAP_SIDE_PX, Patch, Raster};
use proptest::prelude::*;
use std::f64::consts::{PI, TAU};

#[test]
fn a_developable_surface_keeps_its_angles() {
    let shape = cylinder_sector();
    for method in Method::ALL {
        let flat = shape.flatten(method).unwrap();
        let d = flat.distortion;
        // The facets bend over their edges only, so they unroll exactly. The spectral map
        // sits at an eigenvalue of zero, where only half the digits are to be had.
        let tolerance = if method == Method::SpectralConformal { 1e-5 } else { 1e-9 };
        assert!(d.angle_error_rad.max < tolerance, "{method:?}: {:?}", d.angle_error_rad);
        assert!(d.area_log_ratio.max < tolerance, "{method:?}: {:?}", d.area_log_ratio);
        assert_eq!(d.flipped, 0);
    }
    let flat = shape.flatten(Method::AngleBased).unwrap();
    let corner = |i: usize| flat.uv[i];
    let length = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    assert!((length(corner(0), corner(12 * 19)) - 20.0).abs() < 1e-7, "length along the axis");
}

#[test]
fn flat_angles_fit_together() {
    let shape = spherical_cap(12, 1.3);
    let disc = Disc::new(&shape.positions, &shape.triangles).unwrap();
    let angles = angles::corner_angles(&shape.positions, &disc.triangles).unwrap();
    let flat = abf::flat_angles(&disc, &angles).unwrap();
    let mut turn = vec![0.0; disc.vertex_count];
    let mut wheel = vec![1.0; disc.vertex_count];
    for (corners, a) in disc.triangles.iter().zip(&flat.angles) {
        assert!((a.iter().sum::<f64>() - PI).abs() < 1e-10);
        for k in 0..3 {
            turn[corners[k]] += a[k];
            wheel[corners[k]] *= a[(k + 1) % 3].sin() / a[(k + 2) % 3].sin();
        }
    }
    for vertex in (0..disc.vertex_count).filter(|&v| disc.interior[v].is_some()) {
        assert!((turn[vertex] - TAU).abs() < 1e-10);
        assert!((wheel[vertex] - 1.0).abs() < 1e-10);
    }
    // Reconstruction realises just these angles.
    let uv = conformal::pinned(&disc, &shape.positions, &flat.angles).unwrap();
    let d = distortion::measure(&shape.positions, &disc, &flat.angles, &uv);
    assert!(d.angle_error_rad.max < 1e-8, "{:?}", d.angle_error_rad);
}

/// Sum of squared relative angle changes against the targets that ABF minimises.
fn abf_energy(shape: &Shape, uv: &[[f64; 2]]) -> f64 {
    let disc = Disc::new(&shape.positions, &shape.triangles).unwrap();
    let surface = angles::corner_angles(&shape.positions, &disc.triangles).unwrap();
    let plane: Vec<[f64; 3]> = uv.iter().map(|p| [p[0], p[1], 0.0]).collect();
    let plane = angles::corner_angles(&plane, &disc.triangles).unwrap();
    let mut sum = vec![0.0; disc.vertex_count];
    for (corners, a) in disc.triangles.iter().zip(&surface) {
        (0..3).for_each(|k| sum[corners[k]] += a[k]);
    }
    let mut energy = 0.0;
    for (corners, (a, b)) in disc.triangles.iter().zip(plane.iter().zip(&surface)) {
        for k in 0..3 {
            let full = disc.interior[corners[k]].map_or(1.0, |_| TAU / sum[corners[k]]);
            energy += (a[k] / (b[k] * full) - 1.0).powi(2);
        }
    }
    energy
}

#[test]
fn angle_based_flattening_is_a_minimum() {
    let shape = spherical_cap(8, 1.2);
    let flat = shape.flatten(Method::AngleBased).unwrap();
    let least = abf_energy(&shape, &flat.uv);
    for method in [Method::LeastSquaresConformal, Method::SpectralConformal] {
        let other = abf_energy(&shape, &shape.flatten(method).unwrap().uv);
        assert!(least < other, "{method:?}: {other} against {least}");
    }
    // Every plane layout obeys the constraints, so no nearby layout may do better. The
    // first-order change is zero: the energy grows with the square of the shift.
    for (vertex, axis) in [(0, 0), (20, 1), (40, 0), (41, 1), (44, 0), (80, 1)] {
        for shift in [-1e-4, 1e-4] {
            let mut uv = flat.uv.clone();
            uv[vertex][axis] += shift;
            let excess = abf_energy(&shape, &uv) - least;
            assert!(excess > 0.0 && excess < 1e-4, "vertex {vertex}: {excess:e}");
        }
    }
}

#[test]
fn a_hemisphere_like_cap_flattens_without_a_fold() {
    for half_angle in [0.5, 1.0, 1.5] {
        let shape = spherical_cap(16, half_angle);
        for method in Method::ALL {
            let flat = shape.flatten(method).unwrap();
            assert_eq!(flat.distortion.flipped, 0, "{method:?} at {half_angle}");
        }
        let flat = shape.flatten(Method::AngleBased).unwrap();
        assert!(flat.convergence.unwrap().residual_rad < 1e-10);
        assert!(flat.distortion.angle_error_rad.mean < 0.12 * half_angle);
    }
}

#[test]
fn a_symmetric_surface_stays_symmetric() {
    let (n, shape) = (10, tongue(10, 0.0));
    let flat = shape.flatten(Method::AngleBased).unwrap();
    // Turn the middle line upright, then compare left with right.
    let (low, high) = (flat.uv[n / 2], flat.uv[2 * n * (n + 1) + n / 2]);
    let length = (high[0] - low[0]).hypot(high[1] - low[1]);
    let along = [(high[0] - low[0]) / length, (high[1] - low[1]) / length];
    let upright = |p: [f64; 2]| {
        let q = [p[0] - low[0], p[1] - low[1]];
        [q[0] * along[0] + q[1] * along[1], q[0] * along[1] - q[1] * along[0]]
    };
    for row in 0..=2 * n {
        for column in 0..=n {
            let a = upright(flat.uv[row * (n + 1) + column]);
            let b = upright(flat.uv[row * (n + 1) + n - column]);
            assert!((a[0] - b[0]).abs() < 1e-8 && (a[1] + b[1]).abs() < 1e-8, "{a:?} {b:?}");
        }
    }
}

#[test]
fn what_is_not_a_disc_is_refused() {
    let closed = octahedron();
    assert_eq!(
        closed.flatten(Method::AngleBased).unwrap_err(),
        FlattenError::NotADisc { boundaries: 0, euler: 2 }
    );
    // An open tube: two rims.
    let mut tube = Shape::grid(3, 6, |s, t| [t, (2.0 * PI * s).sin(), (2.0 * PI * s).cos()]);
    for corner in tube.triangles.as_flattened_mut() {
        *corner = *corner / 7 * 6 + *corner % 7 % 6;
    }
    let mut kept = 0..28usize;
    tube.positions.retain(|_| kept.next().is_some_and(|i| i % 7 != 6));
    assert_eq!(
        tube.flatten(Method::AngleBased).unwrap_err(),
        FlattenError::NotADisc { boundaries: 2, euler: 0 }
    );
    // A disc and, apart from it, a closed surface: Euler characteristic 3.
    let mut two = cylinder_sector();
    let first = two.positions.len() as u32;
    two.positions.extend(octahedron().positions);
    two.triangles.extend(octahedron().triangles.iter().map(|t| t.map(|v| v + first)));
    assert!(matches!(two.flatten(Method::AngleBased), Err(FlattenError::NotADisc { .. })));
}

#[test]
fn broken_meshes_are_refused_with_the_place() {
    let refused = |change: fn(&mut Shape)| {
        let mut shape = Shape::grid(4, 4, |s, t| [t, -s, 0.3 * s * t]);
        change(&mut shape);
        shape.flatten(Method::AngleBased).unwrap_err()
    };
    assert_eq!(refused(|s| s.triangles.clear()), FlattenError::Empty);
    assert_eq!(
        refused(|s| s.triangles[3][1] = 25),
        FlattenError::Index { triangle: 3, vertex: 25, count: 25 }
    );
    assert_eq!(refused(|s| s.positions[7][2] = f64::NAN), FlattenError::NotFinite { vertex: 7 });
    assert_eq!(refused(|s| s.positions.push([9.0; 3])), FlattenError::UnusedVertex { vertex: 25 });
    assert!(matches!(
        refused(|s| s.positions[6] = s.positions[7]),
        FlattenError::Degenerate { angle_rad, .. } if angle_rad < 1e-4
    ));
    assert!(matches!(
        refused(|s| s.triangles[0].swap(1, 2)),
        FlattenError::NonManifoldEdge { triangle: 1, .. }
    ));
    assert!(matches!(
        refused(|s| s.triangles.push(s.triangles[4])),
        FlattenError::NonManifoldEdge { triangle: 32, .. }
    ));
    // Two triangles that touch in vertex 0 only.
    let bow = Shape {
        positions: vec![
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [-1.0, 0.0, 0.0],
            [-1.0, -1.0, 0.0],
        ],
        triangles: vec![[0, 1, 2], [0, 3, 4]],
    };
    assert_eq!(
        bow.flatten(Method::AngleBased).unwrap_err(),
        FlattenError::NonManifoldVertex { vertex: 0 }
    );
}

#[test]
fn running_out_of_iterations_is_an_error() {
    let shape = spherical_cap(12, 1.5);
    let disc = Disc::new(&shape.positions, &shape.triangles).unwrap();
    let angles = angles::corner_angles(&shape.positions, &disc.triangles).unwrap();
    let due = abf::flat_angles(&disc, &angles).unwrap().convergence.iterations;
    assert!((3..20).contains(&due), "{due}");
    match abf::flat_angles_within(&disc, &angles, due - 1) {
        Err(FlattenError::NotConverged { iterations, residual_rad }) => {
            assert!(iterations == due - 1 && residual_rad > 1e-11);
        }
        other => panic!("{:?}", other.map(|flat| flat.convergence)),
    }
}

fn finger_atlas() -> (Atlas, AtlasReport) {
    let (skin, interface) = (tongue(12, 0.0), tongue(12, 0.2));
    build_atlas(&skin.positions, &interface.positions, &skin.triangles).unwrap()
}

#[test]
fn the_atlas_is_oriented_scaled_and_centred() {
    let (atlas, report) = finger_atlas();
    let (columns, tip, base) = (13, 6, 24 * 13 + 6);
    for patch in Patch::ALL {
        let vertices = atlas.patch(patch);
        assert!(vertices.uv_px[tip][1] < vertices.uv_px[base][1], "the tip points up");
        // Column 0 has y > 0, which is on the left when one looks at the pad from outside.
        let row = 20 * columns;
        assert!(vertices.positions_mm[row][1] > 0.0);
        assert!(vertices.uv_px[row][0] < vertices.uv_px[row + 12][0]);
        // The middle line is upright, in the middle column.
        for row in 0..25 {
            let u = vertices.uv_px[row * columns + 6][0];
            assert!((u - 112.0).abs() < 1e-3, "row {row} of the {patch} at u = {u}");
        }
        let area_px: f64 = atlas
            .triangles()
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| vertices.uv_px[v as usize].map(f64::from));
                0.5 * ((b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1]))
            })
            .sum();
        let area_mm2 = area_px * report.mm_per_px.powi(2);
        let due = if patch == Patch::Skin { &report.skin } else { &report.interface };
        assert!((area_mm2 / due.area_mm2 - 1.0).abs() < 1e-4, "area is kept");
        assert!((due.pixels as f64 / area_px - 1.0).abs() < 0.02, "the mask has that area");
    }
    let all = Patch::ALL.iter().flat_map(|&p| atlas.patch(p).uv_px.iter());
    let (mut least, mut greatest) = ([224.0_f32; 2], [0.0_f32; 2]);
    for p in all {
        for axis in 0..2 {
            least[axis] = least[axis].min(p[axis]);
            greatest[axis] = greatest[axis].max(p[axis]);
        }
    }
    for axis in 0..2 {
        assert!(least[axis] > 3.99 && greatest[axis] < 220.01, "{least:?} {greatest:?}");
        assert!((least[axis] + greatest[axis] - 224.0).abs() < 1e-2, "centred");
    }
    assert!(report.patch_offset_rms_px < 6.0, "{}", report.patch_offset_rms_px);
}

#[test]
fn the_masks_of_a_symmetric_finger_are_mirror_images() {
    let (atlas, _) = finger_atlas();
    for patch in Patch::ALL {
        let raster = Raster::new(&atlas, patch);
        let mask = raster.mask();
        let unlike = (0..mask.len()).filter(|&index| {
            let (row, column) = (index / MAP_SIDE_PX, index % MAP_SIDE_PX);
            mask[index] != mask[row * MAP_SIDE_PX + MAP_SIDE_PX - 1 - column]
        });
        assert_eq!(unlike.count(), 0, "{patch}");
    }
}

#[test]
fn building_twice_gives_the_same_bytes() {
    let (one, two) = (finger_atlas().0, finger_atlas().0);
    assert_eq!(one.to_json().unwrap(), two.to_json().unwrap());
}

#[test]
fn inward_triangles_are_turned_round() {
    let (skin, interface) = (tongue(12, 0.0), tongue(12, 0.2));
    let inward: Vec<[u32; 3]> = skin.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    let (atlas, _) = build_atlas(&skin.positions, &interface.positions, &inward).unwrap();
    assert_eq!(atlas.triangles(), skin.triangles);
    let (due, _) = finger_atlas();
    for (a, b) in atlas.patch(Patch::Skin).uv_px.iter().zip(&due.patch(Patch::Skin).uv_px) {
        assert!((a[0] - b[0]).abs() < 1e-3 && (a[1] - b[1]).abs() < 1e-3, "{a:?} {b:?}");
    }
}

#[test]
fn patches_that_do_not_correspond_are_refused() {
    let (skin, interface) = (tongue(6, 0.0), tongue(7, 0.2));
    let refused = build_atlas(&skin.positions, &interface.positions, &skin.triangles);
    assert!(matches!(refused, Err(BuildAtlasError::Counts { .. })));
    let mut broken = interface.positions[..skin.positions.len()].to_vec();
    broken[5] = broken[6];
    let refused = build_atlas(&skin.positions, &broken, &skin.triangles);
    assert!(matches!(refused, Err(BuildAtlasError::Flatten { patch: Patch::Interface, .. })));
}

#[test]
fn the_report_compares_all_methods() {
    let (atlas, report) = finger_atlas();
    let text = serde_json::to_value(&report).unwrap();
    assert_eq!(text["hash"], atlas.hash());
    for patch in ["skin", "interface"] {
        let methods = text[patch]["methods"].as_array().unwrap();
        let names: Vec<_> = methods.iter().map(|m| m["method"].as_str().unwrap()).collect();
        let due = ["angle_based", "least_squares_conformal", "spectral_conformal"];
        assert_eq!(names, due);
        let errors = methods.iter().map(|m| &m["distortion"]["angle_error_rad"]["rms"]);
        let errors: Vec<f64> = errors.map(|e| e.as_f64().unwrap()).collect();
        assert!(errors.iter().all(|&e| e > 1e-4 && e < 0.5), "{errors:?}");
        assert_eq!(methods[0]["distortion"]["flipped"], 0);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn crumpled_surfaces_flatten_to_angles_that_fit(
        heights in proptest::collection::vec(-1.0f64..1.0, 81), crumple in 0.0f64..0.7,
    ) {
        let mut shape = Shape::grid(8, 8, |s, t| [8.0 * t, -8.0 * s, 0.0]);
        for (position, height) in shape.positions.iter_mut().zip(heights) {
            position[2] = -crumple * height;
        }
        let flat = shape.flatten(Method::AngleBased).unwrap();
        prop_assert!(flat.convergence.unwrap().residual_rad <= 1e-11);
        prop_assert_eq!(flat.distortion.flipped, 0);
        let area: f64 = shape.triangles.iter()
            .map(|t| angles::area(t.map(|v| shape.positions[v as usize]))).sum();
        let plane: f64 = shape.triangles.iter()
            .map(|t| angles::plane_area(t.map(|v| flat.uv[v as usize]))).sum();
        prop_assert!((plane / area - 1.0).abs() < 1e-12);
    }
}
