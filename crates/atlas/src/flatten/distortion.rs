//! What a flattening does to angles and areas.

use super::FlattenError;
use super::angles::{area, plane_area};
use super::disc::Disc;
use serde::Serialize;

/// Mean, root mean square and largest of absolute values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// Root of the mean square.
    pub rms: f64,
    /// Largest.
    pub max: f64,
}

impl Spread {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let (mut count, mut sum, mut squares, mut max) = (0.0, 0.0, 0.0, 0.0_f64);
        for value in values {
            count += 1.0;
            sum += value.abs();
            squares += value * value;
            max = max.max(value.abs());
        }
        Self { mean: sum / count, rms: f64::sqrt(squares / count), max }
    }
}

/// Distortion of a map from a surface to the plane, over all triangles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Distortion {
    /// Difference of corner angles, plane less surface, rad; each corner counts once.
    pub angle_error_rad: Spread,
    /// Natural logarithm of plane area over surface area, weighted by surface area in
    /// `mean` and `rms`. The whole areas are equal.
    pub area_log_ratio: Spread,
    /// Least plane area over surface area of a triangle.
    pub area_ratio_min: f64,
    /// Greatest plane area over surface area of a triangle.
    pub area_ratio_max: f64,
    /// Triangles that are mirrored or without area in the plane.
    pub flipped: usize,
}

/// Scales a map to the area of the surface.
pub(super) fn keep_area(
    positions: &[[f64; 3]],
    disc: &Disc,
    uv: &mut [[f64; 2]],
) -> Result<(), FlattenError> {
    let surface: f64 = disc.triangles.iter().map(|t| area(t.map(|v| positions[v]))).sum();
    let plane: f64 = disc.triangles.iter().map(|t| plane_area(t.map(|v| uv[v]))).sum();
    let scale = (surface / plane).sqrt();
    if !(scale.is_finite() && scale > 0.0) {
        let reason = format!("the map has area {plane}");
        return Err(FlattenError::Linear { step: "the conformal map", reason });
    }
    uv.iter_mut().for_each(|point| *point = point.map(|x| x * scale));
    Ok(())
}

/// Compares a map with the surface it flattens.
pub(super) fn measure(
    positions: &[[f64; 3]],
    disc: &Disc,
    surface_angles: &[[f64; 3]],
    uv: &[[f64; 2]],
) -> Distortion {
    let mut angle_errors = Vec::with_capacity(3 * surface_angles.len());
    let (mut ratio_min, mut ratio_max, mut flipped) = (f64::INFINITY, 0.0_f64, 0);
    let (mut surface_sum, mut log_sum, mut log_squares, mut log_max) = (0.0, 0.0, 0.0, 0.0_f64);
    for (&corners, angles) in disc.triangles.iter().zip(surface_angles) {
        let flat = corners.map(|vertex| uv[vertex]);
        for k in 0..3 {
            angle_errors.push(plane_angle(flat, k) - angles[k]);
        }
        let plane = plane_area(flat);
        if plane <= 0.0 {
            flipped += 1;
        }
        let surface = area(corners.map(|vertex| positions[vertex]));
        let ratio = plane.abs() / surface;
        ratio_min = ratio_min.min(ratio);
        ratio_max = ratio_max.max(ratio);
        let log = ratio.max(f64::MIN_POSITIVE).ln();
        surface_sum += surface;
        log_sum += surface * log.abs();
        log_squares += surface * log * log;
        log_max = log_max.max(log.abs());
    }
    Distortion {
        angle_error_rad: Spread::of(angle_errors.into_iter()),
        area_log_ratio: Spread {
            mean: log_sum / surface_sum,
            rms: (log_squares / surface_sum).sqrt(),
            max: log_max,
        },
        area_ratio_min: ratio_min,
        area_ratio_max: ratio_max,
        flipped,
    }
}

/// Angle at corner `k`, rad; negative in a mirrored triangle.
fn plane_angle(p: [[f64; 2]; 3], k: usize) -> f64 {
    let to = |i: usize| [p[(k + i) % 3][0] - p[k][0], p[(k + i) % 3][1] - p[k][1]];
    let (a, b) = (to(1), to(2));
    (a[0] * b[1] - a[1] * b[0]).atan2(a[0] * b[0] + a[1] * b[1])
}
