//! How far a particular finger's skin lies from the template's, along the template's normals.
//!
//! The offset is a uniform bicubic B-spline over the template's (u, v), twice continuously
//! differentiable on the body. `u` turns once round the finger, from 0 at the palmar line; `v` runs
//! from 0 at the tip's pole over 1 at the cap's equator to 2 at the base plane. At the pole all `u`
//! are one point: row `i` of the control values holds no harmonics of `u` above `i`, as polar
//! coordinates of a smooth function do.

use super::{SurfaceParameter, azimuth_from_palmar};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Control values along `v`, 2 mm apart on the default finger.
pub const ROWS: usize = 17;
/// Control values along `u`, 2 mm apart on the default finger.
pub const COLUMNS: usize = 24;
/// Largest control value that is believed, mm: beyond it the template is of another finger.
pub const OFFSET_MAX_MM: f64 = 5.0;
/// Rounding that is allowed where the pole's row has to be one number, mm.
const POLE_MM: f64 = 1e-9;

/// Control values of the offset, mm, `[row along v][column along u]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SkinOffset {
    /// 1; another one is not read.
    pub format: u32,
    /// [`ROWS`] lists of [`COLUMNS`] numbers, outward positive.
    pub offset_mm: Vec<Vec<f64>>,
}

/// Why control values were refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SkinOffsetError {
    /// Of another program's version.
    #[error("format {0} is not known; 1 is")]
    Format(u32),
    /// Another grid.
    #[error("offset_mm has to be {ROWS} lists of {COLUMNS} numbers")]
    Size,
    /// Absurd.
    #[error(
        "offset_mm[{row}][{column}] = {value} mm is not within {OFFSET_MAX_MM} mm of the template: fit the \
         template's dimensions first"
    )]
    Value {
        /// Along v.
        row: usize,
        /// Along u.
        column: usize,
        /// What stands there.
        value: f64,
    },
    /// Several values for one point.
    #[error("offset_mm[{0}] is not smooth at the tip's pole, where all columns meet in one point")]
    Pole(usize),
}

/// (u, v) of a parameter: `u` in [0, 1), `v` in [0, 2].
#[must_use]
pub fn uv(s: SurfaceParameter) -> [f64; 2] {
    let (section, v) = match s {
        SurfaceParameter::Cap([x, y, z]) => ([y, z], y.hypot(z).atan2(-x) / FRAC_PI_2),
        SurfaceParameter::Body(d, t) => (d, 1.0 + t),
    };
    [(azimuth_from_palmar(section) / TAU).rem_euclid(1.0) % 1.0, v]
}

/// The parameter at (u, v).
#[must_use]
pub fn at_uv([u, v]: [f64; 2]) -> SurfaceParameter {
    let (y, z) = (TAU * u).sin_cos();
    if v <= 1.0 {
        let (across, x) = (FRAC_PI_2 * v).sin_cos();
        SurfaceParameter::Cap([-x, across * y, -across * z])
    } else {
        SurfaceParameter::Body([y, -z], v - 1.0)
    }
}

impl SkinOffset {
    /// From control values; harmonics that a row near the pole cannot have are taken out.
    #[must_use]
    pub fn smooth(mut offset_mm: Vec<Vec<f64>>) -> Self {
        for (row, values) in offset_mm.iter_mut().enumerate().take(COLUMNS / 2) {
            *values = up_to(values, row);
        }
        Self { format: 1, offset_mm }
    }

    /// Checks size and values.
    ///
    /// # Errors
    /// [`SkinOffsetError`] names the first that is wrong.
    pub fn validate(&self) -> Result<(), SkinOffsetError> {
        if self.format != 1 {
            return Err(SkinOffsetError::Format(self.format));
        }
        let rows = &self.offset_mm;
        if rows.len() != ROWS || rows.iter().any(|r| r.len() != COLUMNS) {
            return Err(SkinOffsetError::Size);
        }
        for (row, values) in rows.iter().enumerate() {
            // NaN is not within either.
            let wrong = values.iter().position(|v| !(v.abs() <= OFFSET_MAX_MM));
            if let Some(column) = wrong {
                return Err(SkinOffsetError::Value { row, column, value: values[column] });
            }
        }
        for row in 0..2 {
            let smooth = up_to(&rows[row], row);
            if rows[row].iter().zip(&smooth).any(|(a, b)| (a - b).abs() > POLE_MM) {
                return Err(SkinOffsetError::Pole(row));
            }
        }
        Ok(())
    }

    /// The offset at a parameter, mm.
    #[must_use]
    pub fn at(&self, s: SurfaceParameter) -> f64 {
        weights(s).iter().map(|&(row, column, w)| w * self.offset_mm[row][column]).sum()
    }

    /// Largest control value, mm.
    #[must_use]
    pub fn largest_mm(&self) -> f64 {
        self.offset_mm.iter().flatten().fold(0.0, |most, v| most.max(v.abs()))
    }
}

/// The control values that an offset depends on, with their weights; a value may come twice.
#[must_use]
pub fn weights(s: SurfaceParameter) -> [(usize, usize, f64); 20] {
    let [u, v] = uv(s);
    let (column, across) = basis(u * COLUMNS as f64, COLUMNS);
    let (row, along) = basis(0.5 * v.clamp(0.0, 2.0) * (ROWS - 1) as f64, ROWS - 1);
    let mut out = [(0, 0, 0.0); 20];
    for (j, &wu) in across.iter().enumerate() {
        let c = (column + j + COLUMNS - 1) % COLUMNS;
        // Before the pole come the rows behind it, seen from the other side; beyond the base goes
        // the straight line of the last two.
        let mut put =
            |k: usize, row: usize, column: usize, w: f64| out[5 * j + k] = (row, column, w);
        for (i, &wv) in along.iter().enumerate() {
            let w = wu * wv;
            match (row + i).checked_sub(1) {
                None => put(i, 1, (c + COLUMNS / 2) % COLUMNS, w),
                Some(r) if r == ROWS => {
                    put(i, ROWS - 1, c, 2.0 * w);
                    put(4, ROWS - 2, c, -w);
                }
                Some(r) => put(i, r, c, w),
            }
        }
    }
    out
}

/// The interval that holds `x` (of `intervals`), and the four cubic B-splines there, the first of
/// them that of the knot before the interval.
fn basis(x: f64, intervals: usize) -> (usize, [f64; 4]) {
    let at = (x.max(0.0) as usize).min(intervals - 1);
    let t = x - at as f64;
    let s = 1.0 - t;
    let (t2, t3) = (t * t, t * t * t);
    let values = [s * s * s, 3.0 * t3 - 6.0 * t2 + 4.0, -3.0 * t3 + 3.0 * t2 + 3.0 * t + 1.0, t3];
    (at, values.map(|v| v / 6.0))
}

/// The harmonics of a periodic row up to one of them.
fn up_to(values: &[f64], highest: usize) -> Vec<f64> {
    let n = values.len();
    // One number exactly, not to rounding.
    if highest == 0 {
        return vec![values.iter().sum::<f64>() / n as f64; n];
    }
    if highest >= n / 2 {
        return values.to_vec();
    }
    let angle = |m: usize, j: usize| TAU * ((m * j) % n) as f64 / n as f64;
    let sum = |f: &dyn Fn(usize) -> f64| (0..n).map(|j| values[j] * f(j)).sum::<f64>() / n as f64;
    let mean = sum(&|_| 1.0);
    let parts: Vec<_> =
        (1..=highest).map(|m| [sum(&|j| angle(m, j).cos()), sum(&|j| angle(m, j).sin())]).collect();
    let at = |j: usize| {
        let part = |(k, [c, s]): (usize, &[f64; 2])| {
            2.0 * (c * angle(k + 1, j).cos() + s * angle(k + 1, j).sin())
        };
        mean + parts.iter().enumerate().map(part).sum::<f64>()
    };
    (0..n).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Some control values that turn and wave.
    fn waves() -> SkinOffset {
        let value = |i: usize, j: usize| {
            0.3 * (TAU * j as f64 / COLUMNS as f64 + 0.4).cos() + 0.2 * (0.7 * i as f64).sin()
        };
        let rows = (0..ROWS).map(|i| (0..COLUMNS).map(|j| value(i, j)).collect()).collect();
        SkinOffset::smooth(rows)
    }

    #[test]
    fn parameters_and_uv_are_inverse() {
        for v in [0.0, 0.25, 0.99, 1.0, 1.3, 2.0] {
            for u in [0.0, 0.1, 0.5, 0.93] {
                let [a, b] = uv(at_uv([u, v]));
                let turned = (a - u).abs().min(1.0 - (a - u).abs());
                assert!((b - v).abs() < 1e-12 && (v < 1e-9 || turned < 1e-12), "{u} {v}: {a} {b}");
            }
        }
    }

    #[test]
    fn weights_are_a_partition_of_one_and_keep_a_constant() {
        for v in [0.0, 0.01, 0.4, 1.0, 1.77, 1.99, 2.0] {
            for u in [0.0, 0.2, 0.77, 0.999] {
                let sum: f64 = weights(at_uv([u, v])).iter().map(|w| w.2).sum();
                assert!((sum - 1.0).abs() < 1e-14, "{u} {v}: {sum}");
            }
        }
    }

    #[test]
    fn the_pole_is_one_point_and_ways_over_it_have_no_kink() {
        let field = waves();
        field.validate().unwrap();
        let at = |u: f64, v: f64| field.at(at_uv([u, v]));
        let pole = at(0.0, 0.0);
        for k in 0..12 {
            let u = f64::from(k) / 12.0;
            assert!((at(u, 0.0) - pole).abs() < 1e-12);
            // Slopes to both sides of the pole are one line's.
            let (h, across) = (1e-4, (u + 0.5).rem_euclid(1.0));
            let kink = at(u, h) + at(across, h) - 2.0 * pole;
            assert!(kink.abs() < 1e-5, "{u}: {kink}");
        }
    }

    #[test]
    fn bad_control_values_are_named() {
        let good = waves();
        let with = |change: fn(&mut SkinOffset)| {
            let mut bad = good.clone();
            change(&mut bad);
            bad.validate().unwrap_err()
        };
        assert_eq!(with(|s| s.format = 2), SkinOffsetError::Format(2));
        assert_eq!(with(|s| drop(s.offset_mm.pop())), SkinOffsetError::Size);
        assert_eq!(with(|s| s.offset_mm[0][3] += 0.1), SkinOffsetError::Pole(0));
        let e = with(|s| s.offset_mm[9][4] = 7.0);
        assert!(e.to_string().contains("offset_mm[9][4] = 7 mm"), "{e}");
        let nan = with(|s| s.offset_mm[9][4] = f64::NAN);
        assert!(matches!(nan, SkinOffsetError::Value { row: 9, column: 4, .. }));
    }
}
