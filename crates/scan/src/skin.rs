//! The skin's offset from the fitted template: a smooth field through the distances to the surface.

use crate::least_squares::solve;
use crate::placed::Placed;
use papilla_fingertip::geometry::fingertip::offset::{
    COLUMNS, OFFSET_MAX_MM, ROWS, at_uv, weights,
};
use papilla_fingertip::geometry::fingertip::{FingertipShape, SkinOffset};
use papilla_vector::dot;
use std::sync::Arc;

/// Rows and columns of the places where distances are taken.
pub const SAMPLES: [usize; 2] = [96, 96];
/// Weight of the control values' second differences against distances: what is finer than their
/// spacing of 2 mm is left to the surface's noise.
const SMOOTHNESS: f64 = 0.02;
/// Weight that keeps a control value at 0 to which no distance belongs.
const AT_REST: f64 = 1e-6;
/// Offsets below it everywhere are rounding of the file's triangles: the template is the finger, mm.
const NONE_MM: f64 = 0.02;
/// How close a point along the normal has to come to the surface, mm.
const CLOSE_MM: f64 = 1e-4;

/// The skin's offset and how well it fits.
#[derive(Clone, Debug)]
pub struct Skin {
    /// The field; `None` where the template alone lies on the surface.
    pub offset: Option<Arc<SkinOffset>>,
    /// Root of the mean square of the skin's distances from the surface, mm.
    pub rms_mm: f64,
    /// Largest of them, mm.
    pub worst_mm: f64,
    /// Where it is, u and v.
    pub worst_uv: [f64; 2],
    /// Distance of the surface from the template along its normals at [`SAMPLES`], mm, row by row
    /// of v; none where the surface was not met.
    pub of_template_mm: Vec<Option<f64>>,
    /// The same of the skin.
    pub of_skin_mm: Vec<Option<f64>>,
}

/// (u, v) of a sample.
#[must_use]
pub fn sample_uv(n: usize) -> [f64; 2] {
    let [rows, columns] = SAMPLES;
    let (i, j) = (n / columns, n % columns);
    [(j as f64 + 0.5) / columns as f64, 2.0 * (i as f64 + 0.5) / rows as f64]
}

/// Fits the offset of a template from a surface; an open one ends at the base plane, where the
/// nearest place is its rim.
pub(crate) fn offset(shape: &FingertipShape, surface: &Placed, open: bool) -> Skin {
    let end = if open { 1.95 } else { 2.0 };
    let count = SAMPLES[0] * SAMPLES[1];
    let of_template_mm: Vec<Option<f64>> = (0..count)
        .map(|n| {
            let uv = sample_uv(n);
            (uv[1] < end).then(|| along_normal(shape, surface, uv)).flatten()
        })
        .collect();
    let field = field(&of_template_mm);
    let own = |field: &Option<Arc<SkinOffset>>| -> Vec<Option<f64>> {
        let left = |(n, found): (usize, &Option<f64>)| {
            let by = field.as_ref().map_or(0.0, |f| f.at(at_uv(sample_uv(n))));
            found.map(|found| found - by)
        };
        of_template_mm.iter().enumerate().map(left).collect()
    };
    let offset = field.filter(|f| f.largest_mm() > NONE_MM).map(Arc::new);
    let of_skin_mm = own(&offset);
    let (mut squares, mut weight, mut worst) = (0.0, 0.0, (0.0_f64, [0.0; 2]));
    for (n, left) in of_skin_mm.iter().enumerate() {
        let Some(left) = left else { continue };
        let uv = sample_uv(n);
        let round = (std::f64::consts::FRAC_PI_2 * uv[1].min(1.0)).sin();
        squares += round * left * left;
        weight += round;
        if left.abs() > worst.0.abs() {
            worst = (*left, uv);
        }
    }
    let rms_mm = (squares / weight.max(f64::MIN_POSITIVE)).sqrt();
    let (worst_mm, worst_uv) = worst;
    Skin { offset, rms_mm, worst_mm, worst_uv, of_template_mm, of_skin_mm }
}

/// How far the surface lies along the template's normal; `None` if it is not met.
fn along_normal(shape: &FingertipShape, surface: &Placed, uv: [f64; 2]) -> Option<f64> {
    const STEPS: usize = 40;
    let s = at_uv(uv);
    let (p, n) = (shape.template_skin(s), shape.skin_normal_at(s));
    let mut by = 0.0_f64;
    for _ in 0..STEPS {
        let q = std::array::from_fn(|i| p[i] + by * n[i]);
        let (gap, normal) = surface.gap_and_normal(q);
        if gap.abs() < CLOSE_MM {
            return Some(by);
        }
        // Distance grows along the normal by the cosine to the surface's own.
        by -= gap / dot(normal, n).max(0.5);
        if by.abs() > OFFSET_MAX_MM {
            return None;
        }
    }
    None
}

/// Control values whose spline comes closest to the distances, as smooth as they allow.
fn field(distances: &[Option<f64>]) -> Option<SkinOffset> {
    let n = ROWS * COLUMNS;
    let (mut a, mut b) = (vec![0.0; n * n], vec![0.0; n]);
    let mut add = |terms: &[(usize, usize, f64)], value: f64, weight: f64| {
        for &(r, c, w) in terms {
            let i = r * COLUMNS + c;
            b[i] += weight * w * value;
            for &(q, d, x) in terms {
                a[i * n + q * COLUMNS + d] += weight * w * x;
            }
        }
    };
    let samples = SAMPLES[0] * SAMPLES[1];
    // Each control value counts as much as its distances do.
    let density = n as f64 / samples as f64;
    for (k, found) in distances.iter().enumerate() {
        if let Some(found) = found {
            add(&weights(at_uv(sample_uv(k))), *found, density);
        }
    }
    for r in 0..ROWS {
        for c in 0..COLUMNS {
            let turned = |by: usize| (c + by) % COLUMNS;
            let around = [(r, c, 1.0), (r, turned(1), -2.0), (r, turned(2), 1.0)];
            add(&around, 0.0, SMOOTHNESS);
            if r + 2 < ROWS {
                add(&[(r, c, 1.0), (r + 1, c, -2.0), (r + 2, c, 1.0)], 0.0, SMOOTHNESS);
            }
            add(&[(r, c, 1.0)], 0.0, AT_REST);
        }
    }
    let values = solve(&a, &b)?;
    let rows = values.chunks_exact(COLUMNS).map(<[f64]>::to_vec).collect();
    Some(SkinOffset::smooth(rows))
}
