//! How far a predicted SED map is from the truth.
//!
//! All figures are over the pixels of the interface (the raster's mask), in `f64`. With
//! `p` predicted and `t` true:
//!
//! | figure | definition |
//! |---|---|
//! | relative L2 | `sqrt(sum (p-t)^2 / sum t^2)` |
//! | far-field relative L2 | the same over pixels with `t < 0.1 max t` |
//! | peak error | `abs(max p - max t) / max t` |
//! | total-energy error | `abs(sum p - sum t) / sum t` (pixels have equal area) |
//! | SSIM | [`ssim`] of `p / max t` and `t / max t` |

mod ssim;

pub use ssim::ssim;

use papilla_engine::card::{Metrics, Similarity, Spread};
use serde::Serialize;

/// Where the truth is below this part of its maximum is the far field.
pub const FAR_FIELD: f32 = 0.1;

/// The figures of one sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SampleMetrics {
    /// Relative L2 error.
    pub relative_l2: f64,
    /// Relative L2 error in the far field; none if the truth is zero there.
    pub far_field_relative_l2: Option<f64>,
    /// Relative error of the greatest value.
    pub peak_error: f64,
    /// Relative error of the sum.
    pub total_energy_error: f64,
    /// Structural similarity; 1 is equal.
    pub ssim: f64,
}

impl SampleMetrics {
    /// Compares two maps of 224 x 224 values, J/m3, over the pixels of `mask`.
    ///
    /// None if the truth has no energy: nothing is relative to zero.
    #[must_use]
    pub fn measure(predicted: &[f32], truth: &[f32], mask: &[bool]) -> Option<Self> {
        let inside = || mask.iter().zip(predicted.iter().zip(truth)).filter(|(m, _)| **m);
        let mut sums = Sums::default();
        let mut far = Sums::default();
        let (mut peak, mut peak_true) = (f32::NEG_INFINITY, 0.0f32);
        for (_, (&p, &t)) in inside() {
            peak = peak.max(p);
            peak_true = peak_true.max(t);
            sums.add(p, t);
        }
        if peak_true <= 0.0 {
            return None;
        }
        for (_, (&p, &t)) in inside().filter(|(_, (_, t))| **t < FAR_FIELD * peak_true) {
            far.add(p, t);
        }
        let peak_true = f64::from(peak_true);
        Some(Self {
            relative_l2: sums.relative_l2()?,
            far_field_relative_l2: far.relative_l2(),
            peak_error: (f64::from(peak) - peak_true).abs() / peak_true,
            total_energy_error: (sums.predicted - sums.truth).abs() / sums.truth,
            ssim: ssim(predicted, truth, mask, peak_true),
        })
    }
}

#[derive(Default)]
struct Sums {
    error_squared: f64,
    truth_squared: f64,
    predicted: f64,
    truth: f64,
}

impl Sums {
    fn add(&mut self, p: f32, t: f32) {
        let (p, t) = (f64::from(p), f64::from(t));
        self.error_squared += (p - t).powi(2);
        self.truth_squared += t * t;
        self.predicted += p;
        self.truth += t;
    }

    fn relative_l2(&self) -> Option<f64> {
        (self.truth_squared > 0.0).then(|| (self.error_squared / self.truth_squared).sqrt())
    }
}

/// Quantile of `values` at `q` in 0..=1, interpolated linearly between the two nearest
/// order statistics (numpy's default). None if there are no values.
#[must_use]
pub fn quantile(values: &[f64], q: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let place = q.clamp(0.0, 1.0) * sorted.len().checked_sub(1)? as f64;
    let (below, part) = (place.floor() as usize, place.fract());
    let above = (below + 1).min(sorted.len() - 1);
    Some(sorted[below] + part * (sorted[above] - sorted[below]))
}

/// Median and spread over the samples of a split, as a card holds them.
///
/// None if there are no samples.
#[must_use]
pub fn summarise(split: &str, samples: &[SampleMetrics]) -> Option<Metrics> {
    let all = |figure: fn(&SampleMetrics) -> f64| samples.iter().map(figure).collect::<Vec<_>>();
    let far: Vec<f64> = samples.iter().filter_map(|s| s.far_field_relative_l2).collect();
    let ssim = all(|s| s.ssim);
    Some(Metrics {
        split: split.to_owned(),
        samples: samples.len(),
        relative_l2: spread(&all(|s| s.relative_l2))?,
        far_field_relative_l2: spread(&far),
        peak_error: spread(&all(|s| s.peak_error))?,
        total_energy_error: spread(&all(|s| s.total_energy_error))?,
        ssim: Similarity { median: quantile(&ssim, 0.5)?, p5: quantile(&ssim, 0.05)? },
    })
}

fn spread(values: &[f64]) -> Option<Spread> {
    Some(Spread { median: quantile(values, 0.5)?, p95: quantile(values, 0.95)? })
}

#[cfg(test)]
mod tests;
