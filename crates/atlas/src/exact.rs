//! Exact orientation tests in the image plane.
//!
//! Pixel coordinates are `f32`. Times 2^40 they become integers (anything finer than
//! 2^-41 px is rounded, once and for all), and on integers the sign of an area is
//! exact. So no rounding can put a pixel centre on both sides of a shared edge, or on
//! neither, and every machine draws the same map.

/// Steps per pixel.
const STEPS: f64 = (1u64 << 40) as f64;

/// A point of the image on the exact grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct GridPoint {
    u: i128,
    v: i128,
}

impl GridPoint {
    /// Grid point of `[u, v]` in pixels, which must be finite and within a few
    /// thousand pixels.
    pub(super) fn new(uv_px: [f32; 2]) -> Self {
        Self { u: steps(f64::from(uv_px[0])), v: steps(f64::from(uv_px[1])) }
    }

    /// Centre of a pixel.
    pub(super) fn pixel_centre(row: usize, column: usize) -> Self {
        Self { u: steps(column as f64 + 0.5), v: steps(row as f64 + 0.5) }
    }
}

fn steps(px: f64) -> i128 {
    (px * STEPS).round() as i128
}

/// Twice the area of the triangle in squared steps: positive where the image shows
/// `a`, `b`, `c` counter-clockwise (`v` runs down), exact.
pub(super) fn doubled_area(a: GridPoint, b: GridPoint, c: GridPoint) -> i128 {
    (b.v - a.v) * (c.u - a.u) - (b.u - a.u) * (c.v - a.v)
}
