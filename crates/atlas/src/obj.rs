//! Wavefront OBJ text of an atlas.

use super::{Atlas, Patch};
use crate::MAP_SIDE_PX;
use std::fmt::Write as _;

pub(super) fn write(atlas: &Atlas) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail, so the results are dropped.
    let _ = writeln!(text, "# Papilla atlas {}", atlas.hash());
    let _ = writeln!(text, "# positions in mm; {} mm per pixel", atlas.mm_per_px());
    let side_px = MAP_SIDE_PX as f32;
    let mut first = 1;
    for patch in Patch::ALL {
        let vertices = atlas.patch(patch);
        let _ = writeln!(text, "o {patch}");
        for [x, y, z] in &vertices.positions_mm {
            let _ = writeln!(text, "v {x} {y} {z}");
        }
        for [u, v] in &vertices.uv_px {
            let _ = writeln!(text, "vt {} {}", u / side_px, 1.0 - v / side_px);
        }
        for corners in atlas.triangles() {
            let [a, b, c] = corners.map(|vertex| u64::from(vertex) + first);
            let _ = writeln!(text, "f {a}/{a} {b}/{b} {c}/{c}");
        }
        first += atlas.vertex_count() as u64;
    }
    text
}
