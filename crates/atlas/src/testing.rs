//! Atlases for tests: a wavy triangulated disc, not a shape of this project.

use super::{Atlas, PatchVertices};

/// A grid of `side x side` quads (two triangles each) between `low` and `high` pixels,
/// sheared and bent by `bend` pixels; the interface is the skin shrunk about its centre.
pub(crate) fn grid_parts(
    side: usize,
    low: f32,
    high: f32,
    bend: f32,
) -> (Vec<[u32; 3]>, PatchVertices, PatchVertices) {
    let mut skin = PatchVertices::default();
    let mut interface = PatchVertices::default();
    for row in 0..=side {
        for column in 0..=side {
            let (s, t) = (column as f32 / side as f32, row as f32 / side as f32);
            let (wave_u, wave_v) = ((5.0 * t).sin() * bend, (4.0 * s).cos() * bend);
            let uv = [low + (high - low) * s + wave_u, low + (high - low) * t + wave_v];
            let middle = 0.5 * (low + high);
            skin.uv_px.push(uv);
            skin.positions_mm.push([uv[1] * 0.1, -uv[0] * 0.1, -1.0]);
            interface.uv_px.push(uv.map(|x| middle + 0.9 * (x - middle)));
            interface.positions_mm.push([uv[1] * 0.09, -uv[0] * 0.09, -0.5]);
        }
    }
    let vertex = |row: usize, column: usize| (row * (side + 1) + column) as u32;
    let mut triangles = Vec::new();
    for row in 0..side {
        for column in 0..side {
            let [a, b] = [vertex(row, column), vertex(row, column + 1)];
            let [c, d] = [vertex(row + 1, column), vertex(row + 1, column + 1)];
            triangles.extend([[a, c, b], [b, c, d]]);
        }
    }
    (triangles, skin, interface)
}

/// An atlas of [`grid_parts`], 0.1 mm per pixel.
pub(crate) fn grid_atlas(side: usize, low: f32, high: f32, bend: f32) -> Atlas {
    let (triangles, skin, interface) = grid_parts(side, low, high, bend);
    Atlas::new(0.1, triangles, skin, interface).unwrap()
}
