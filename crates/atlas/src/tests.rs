use super::testing::{grid_atlas, grid_parts};
use super::*;
use crate::MAP_LEN;
use proptest::prelude::*;

fn refused(change: impl FnOnce(&mut serde_json::Value)) -> AtlasError {
    let mut value = serde_json::to_value(grid_atlas(4, 20.0, 200.0, 3.0)).unwrap();
    change(&mut value);
    Atlas::from_json(&value.to_string()).unwrap_err()
}

#[test]
fn json_round_trip_keeps_every_bit() {
    let atlas = grid_atlas(7, 13.7, 201.3, 5.1);
    let again = Atlas::from_json(&atlas.to_json().unwrap()).unwrap();
    assert_eq!(again, atlas);
    for patch in Patch::ALL {
        assert_eq!(again.patch(patch), atlas.patch(patch));
    }
    assert_eq!(again.triangles(), atlas.triangles());
    assert_eq!(atlas.hash().len(), 64);
}

#[test]
fn the_hash_is_that_of_the_documented_bytes() {
    let (triangles, skin, interface) = grid_parts(1, 10.0, 20.0, 0.0);
    let atlas = Atlas::new(0.1, triangles.clone(), skin.clone(), interface.clone()).unwrap();
    let mut bytes = b"papilla-atlas\0\0\0".to_vec();
    for number in [1u32, 224, 4, 2] {
        bytes.extend(number.to_le_bytes());
    }
    bytes.extend(0.1f32.to_le_bytes());
    triangles.iter().flatten().for_each(|i| bytes.extend(i.to_le_bytes()));
    for patch in [skin, interface] {
        patch.positions_mm.iter().flatten().for_each(|x| bytes.extend(x.to_le_bytes()));
        patch.uv_px.iter().flatten().for_each(|x| bytes.extend(x.to_le_bytes()));
    }
    let digest: String = Sha256::digest(&bytes).iter().map(|b| format!("{b:02x}")).collect();
    assert_eq!(atlas.hash(), digest);
}

#[test]
fn minus_zero_hashes_like_zero() {
    let (triangles, mut skin, interface) = grid_parts(1, 10.0, 20.0, 0.0);
    skin.positions_mm[0][0] = 0.0;
    let plus = Atlas::new(0.1, triangles.clone(), skin.clone(), interface.clone()).unwrap();
    skin.positions_mm[0][0] = -0.0;
    let minus = Atlas::new(0.1, triangles, skin, interface).unwrap();
    assert_eq!(plus.hash(), minus.hash());
}

#[test]
fn tampering_is_found() {
    let moved = refused(|v| v["skin"]["positions_mm"][3][1] = 1.25.into());
    assert!(matches!(moved, AtlasError::Hash { .. }), "{moved}");
    let scaled = refused(|v| v["mm_per_px"] = 0.2.into());
    assert!(matches!(scaled, AtlasError::Hash { .. }), "{scaled}");
    let renamed = refused(|v| v["hash"] = "0".repeat(64).into());
    assert!(matches!(renamed, AtlasError::Hash { .. }), "{renamed}");
}

#[test]
fn broken_files_are_refused_for_their_own_reason() {
    assert!(matches!(refused(|v| v["version"] = 2.into()), AtlasError::Version { found: 2, .. }));
    assert!(matches!(refused(|v| v["size_px"] = 256.into()), AtlasError::Size { found: 256, .. }));
    assert!(matches!(refused(|v| v["mm_per_px"] = 0.into()), AtlasError::Scale(_)));
    assert!(matches!(refused(|v| v["triangles"] = serde_json::json!([])), AtlasError::Empty));
    assert!(matches!(
        refused(|v| v["triangles"][5][1] = 25.into()),
        AtlasError::Index { triangle: 5, vertex: 25, count: 25 }
    ));
    assert!(matches!(
        refused(|v| v["interface"]["uv_px"][6][0] = 1e39.into()),
        AtlasError::NotFinite { .. } | AtlasError::Json(_)
    ));
    assert!(matches!(
        refused(|v| v["skin"]["uv_px"][6][0] = 224.5.into()),
        AtlasError::Outside { patch: Patch::Skin, vertex: 6, .. }
    ));
    assert!(matches!(
        refused(|v| v["interface"]["uv_px"] = serde_json::json!([])),
        AtlasError::Count { patch: Patch::Interface, list: "uv_px", found: 0, expected: 25 }
    ));
    assert!(matches!(
        refused(|v| v["triangles"][4] = serde_json::json!([0, 1, 5])),
        AtlasError::Flipped { triangle: 4, empty: false, .. }
    ));
    assert!(matches!(
        refused(|v| v["triangles"][4] = serde_json::json!([0, 1, 1])),
        AtlasError::Flipped { triangle: 4, empty: true, .. }
    ));
    assert!(matches!(
        refused(|v| v["triangles"][4] = v["triangles"][0].clone()),
        AtlasError::Overlap { first: 0, second: 4, .. }
    ));
    assert!(matches!(refused(|v| v["more"] = 1.into()), AtlasError::Json(_)));
}

#[test]
fn another_atlas_is_refused() {
    let (one, other) = (grid_atlas(3, 20.0, 200.0, 0.0), grid_atlas(3, 20.0, 201.0, 0.0));
    assert!(one.require_hash(one.hash()).is_ok());
    assert!(matches!(one.require_hash(other.hash()), Err(AtlasError::Mismatch { .. })));
}

#[test]
fn centres_on_edges_and_vertices_belong_to_one_triangle_each() {
    // Vertices on pixel centres: every edge and diagonal passes through centres.
    let atlas = grid_atlas(10, 10.5, 110.5, 0.0);
    let raster = Raster::new(&atlas, Patch::Skin);
    assert_eq!(raster.pixel_count(), 101 * 101);
    let values: Vec<f32> = (0..atlas.vertex_count()).map(|i| (i * 37 % 101) as f32).collect();
    let mut pixels = vec![1.0; MAP_LEN];
    raster.rasterise(&values, &mut pixels).unwrap();
    for (value, &[u, v]) in values.iter().zip(&atlas.patch(Patch::Skin).uv_px) {
        let pixel = pixels[v as usize * MAP_SIDE_PX + u as usize];
        assert_eq!(pixel.to_bits(), value.to_bits(), "at ({u}, {v})");
    }
    assert_eq!(pixels[0].to_bits(), 0, "outside the mask a map is zero");
}

#[test]
fn wrong_buffer_lengths_are_refused() {
    let atlas = grid_atlas(3, 20.0, 200.0, 0.0);
    let raster = Raster::new(&atlas, Patch::Interface);
    let mut pixels = vec![0.0; MAP_LEN];
    let short = raster.rasterise(&[0.0; 3], &mut pixels);
    assert!(matches!(short, Err(AtlasError::BufferLength { found: 3, expected: 16, .. })));
    let short = raster.rasterise(&[0.0; 16], &mut pixels[1..]);
    assert!(matches!(short, Err(AtlasError::BufferLength { expected: MAP_LEN, .. })));
}

#[test]
fn a_map_read_back_at_the_vertices_gives_the_field() {
    let atlas = grid_atlas(12, 30.0, 190.0, 4.0);
    for patch in Patch::ALL {
        let raster = Raster::new(&atlas, patch);
        let uv_px = &atlas.patch(patch).uv_px;
        let field: Vec<f32> = uv_px.iter().map(|[u, v]| 3.0 + 0.01 * u - 0.02 * v).collect();
        let (mut pixels, mut back) = (vec![0.0; MAP_LEN], vec![0.0; field.len()]);
        raster.rasterise(&field, &mut pixels).unwrap();
        VertexSampler::new(&atlas, &raster).sample(&pixels, &mut back).unwrap();
        for (vertex, (a, b)) in field.iter().zip(&back).enumerate() {
            let rim = [vertex / 13, vertex % 13].iter().any(|&i| i == 0 || i == 12);
            let tolerance = if rim { 0.05 } else { 1e-4 };
            assert!((a - b).abs() < tolerance, "{patch} vertex {vertex}: {a} came back as {b}");
        }
    }
}

#[test]
fn obj_text_holds_both_patches() {
    let atlas = grid_atlas(2, 0.0, 224.0, 0.0);
    let text = atlas.to_obj();
    let count = |prefix: &str| text.lines().filter(|line| line.starts_with(prefix)).count();
    assert_eq!([count("o "), count("v "), count("vt "), count("f ")], [2, 18, 18, 16]);
    // Upper left of the image: u = 0, v = 0 is texture coordinate (0, 1).
    assert!(text.contains("\nvt 0 1\n"));
    assert!(text.contains("\nf 10/10 13/13 11/11\n"), "faces of the second object are offset");
}

#[test]
fn a_pixel_knows_its_place_on_the_finger() {
    let atlas = grid_atlas(5, 20.0, 200.0, 0.0);
    let raster = Raster::new(&atlas, Patch::Skin);
    let [x, y, z] = raster.position_mm(&atlas, 100, 50).unwrap();
    assert!((x - 10.05).abs() < 1e-4 && (y + 5.05).abs() < 1e-4 && (z + 1.0).abs() < 1e-6);
    assert!(raster.position_mm(&atlas, 0, 0).is_none());
    assert!(raster.at(400, 400).is_none());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn linear_fields_come_out_exactly(
        side in 1usize..20, low in 5.0f32..60.0, high in 120.0f32..215.0, bend in 0.0f32..2.5,
        slope_u in -2.0f32..2.0, slope_v in -2.0f32..2.0, offset in -50.0f32..50.0,
    ) {
        let atlas = grid_atlas(side, low, high, bend);
        let raster = Raster::new(&atlas, Patch::Skin);
        let at = |u: f32, v: f32| offset + slope_u * u + slope_v * v;
        let field: Vec<f32> =
            atlas.patch(Patch::Skin).uv_px.iter().map(|&[u, v]| at(u, v)).collect();
        let mut pixels = vec![0.0; MAP_LEN];
        raster.rasterise(&field, &mut pixels).unwrap();
        for (&index, pixel) in raster.indices().iter().zip(raster.pixels()) {
            let (row, column) = (index as usize / MAP_SIDE_PX, index as usize % MAP_SIDE_PX);
            let due = at(column as f32 + 0.5, row as f32 + 0.5);
            prop_assert!((pixels[index as usize] - due).abs() < 2e-3);
            prop_assert!((pixel.weights.iter().sum::<f32>() - 1.0).abs() < 3e-7);
            prop_assert!(pixel.weights.iter().all(|w| (0.0..=1.0).contains(w)));
            prop_assert_eq!(raster.at(row, column), Some(pixel));
        }
    }

    #[test]
    fn the_mask_has_the_area_of_the_triangles(
        side in 1usize..30, low in 5.0f32..60.0, high in 120.0f32..215.0, bend in 0.0f32..2.0,
    ) {
        let atlas = grid_atlas(side, low, high, bend);
        for patch in Patch::ALL {
            let raster = Raster::new(&atlas, patch);
            let uv_px = &atlas.patch(patch).uv_px;
            let area: f32 = atlas.triangles().iter().map(|corners| {
                let [a, b, c] = corners.map(|vertex| uv_px[vertex as usize]);
                0.5 * ((b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1]))
            }).sum();
            let inside = raster.mask().iter().filter(|&&m| m).count();
            prop_assert_eq!(inside, raster.pixel_count());
            // Pixels are lost or won along the rim only: at most about one per two pixels.
            let rim_px = 4.0 * (high - low + 4.0 * bend);
            prop_assert!((inside as f32 - area).abs() < 0.6 * rim_px, "{} against {}", inside, area);
        }
    }

    #[test]
    fn pixels_neither_vanish_nor_double_when_triangles_are_reordered(
        side in 2usize..16, low in 5u8..60, high in 120u8..210, seed in 1usize..1000,
    ) {
        // Whole and half pixels: many centres lie exactly on edges and vertices.
        let (triangles, skin, interface) =
            grid_parts(side, f32::from(low) * 0.5, f32::from(high) * 0.5, 0.0);
        let count = triangles.len();
        let mut reordered = triangles.clone();
        reordered.sort_by_key(|t| (t[0] as usize * seed + t[1] as usize * 31) % (count + 7));
        let one = Atlas::new(0.1, triangles, skin.clone(), interface.clone()).unwrap();
        let two = Atlas::new(0.1, reordered, skin, interface).unwrap();
        let [one, two] = [one, two].map(|atlas| Raster::new(&atlas, Patch::Skin));
        prop_assert_eq!(one.indices(), two.indices());
    }
}
