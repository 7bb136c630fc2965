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
//! | peak distance | straight line between the two peaks on the undeformed interface, mm |
//! | nail-base error | relative L2 over the [nail-base zone](NAIL_BASE_MM) |
//! | total-energy error | `abs(sum p - sum t) / sum t` (pixels have equal area) |
//! | SSIM | [`ssim`] of `p / max t` and `t / max t` |
//! | closest factor | `sum p t / sum p^2` |

mod ssim;

pub use ssim::ssim;

use papilla_engine::card::{Metrics, Similarity, Spread};
use papilla_proto::atlas::{Atlas, Raster};
use papilla_proto::{MAP_LEN, MAP_SIDE_PX};
use serde::Serialize;
use std::ops::Range;

/// Where the truth is below this part of its maximum is the far field.
pub const FAR_FIELD: f32 = 0.1;

/// The nail-base zone: the part of the interface at these distances from the tip, mm along the
/// finger.
///
/// The nail plate of the default fingertip ends 14 mm from the tip; the zone reaches 2 mm to
/// either side of that edge, over the nail's matrix and its fold. Presses on the pad load it
/// through the tissue more than by touching it, and a network that sees 2 to 3 mm around a
/// pixel cannot know of them.
pub const NAIL_BASE_MM: Range<f32> = 12.0..16.0;

/// Where the figures are taken: the interface's pixels and their places.
#[derive(Clone, Debug)]
pub struct Ground {
    /// True inside the patch.
    pub mask: Vec<bool>,
    /// True in the nail-base zone.
    pub nail_base: Vec<bool>,
    /// Place of each pixel on the undeformed interface, mm; 0 outside the patch.
    pub position_mm: Vec<[f32; 3]>,
}

impl Ground {
    /// The ground of the atlas whose interface `interface` draws.
    #[must_use]
    pub fn new(atlas: &Atlas, interface: &Raster) -> Self {
        let place = |i| interface.position_mm(atlas, i / MAP_SIDE_PX, i % MAP_SIDE_PX);
        let places: Vec<Option<[f32; 3]>> = (0..MAP_LEN).map(place).collect();
        Self {
            mask: interface.mask().to_vec(),
            nail_base: places
                .iter()
                .map(|p| p.is_some_and(|[x, ..]| NAIL_BASE_MM.contains(&x)))
                .collect(),
            position_mm: places.into_iter().map(Option::unwrap_or_default).collect(),
        }
    }

    fn distance_mm(&self, a: usize, b: usize) -> f64 {
        let (a, b) = (self.position_mm[a], self.position_mm[b]);
        let squared = |axis: usize| f64::from(a[axis] - b[axis]).powi(2);
        (squared(0) + squared(1) + squared(2)).sqrt()
    }
}

/// The figures of one sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SampleMetrics {
    /// Relative L2 error.
    pub relative_l2: f64,
    /// Relative L2 error in the far field; none if the truth is zero there.
    pub far_field_relative_l2: Option<f64>,
    /// Relative error of the greatest value.
    pub peak_error: f64,
    /// Distance between the places of the two greatest values, mm.
    pub peak_distance_mm: f64,
    /// Relative L2 error in the nail-base zone; none if the truth is zero there.
    pub nail_base_error: Option<f64>,
    /// Relative error of the sum.
    pub total_energy_error: f64,
    /// Structural similarity; 1 is equal.
    pub ssim: f64,
    /// The factor that brings the prediction closest in relative L2; none if it is zero everywhere.
    pub closest_factor: Option<f64>,
}

impl SampleMetrics {
    /// Compares two maps of 224 x 224 values, J/m3, over the pixels of the interface.
    ///
    /// None if the truth has no energy: nothing is relative to zero.
    #[must_use]
    pub fn measure(predicted: &[f32], truth: &[f32], ground: &Ground) -> Option<Self> {
        let [mut all, mut far, mut nail_base] = <[Sums; 3]>::default();
        let (mut peak, mut peak_true) = (None, None);
        for i in (0..truth.len()).filter(|&i| ground.mask[i]) {
            all.add(predicted[i], truth[i]);
            if ground.nail_base[i] {
                nail_base.add(predicted[i], truth[i]);
            }
            rise(&mut peak, i, predicted[i]);
            rise(&mut peak_true, i, truth[i]);
        }
        let ((at, peak), (at_true, peak_true)) = (peak?, peak_true?);
        if peak_true <= 0.0 {
            return None;
        }
        for i in (0..truth.len()).filter(|&i| ground.mask[i] && truth[i] < FAR_FIELD * peak_true) {
            far.add(predicted[i], truth[i]);
        }
        let peak_true = f64::from(peak_true);
        Some(Self {
            relative_l2: all.relative_l2()?,
            far_field_relative_l2: far.relative_l2(),
            peak_error: (f64::from(peak) - peak_true).abs() / peak_true,
            peak_distance_mm: ground.distance_mm(at, at_true),
            nail_base_error: nail_base.relative_l2(),
            total_energy_error: (all.predicted - all.truth).abs() / all.truth,
            ssim: ssim(predicted, truth, &ground.mask, peak_true),
            closest_factor: all.closest_factor(),
        })
    }
}

/// Keeps the place and value of the greatest so far, the first of equals.
fn rise(greatest: &mut Option<(usize, f32)>, place: usize, value: f32) {
    if greatest.is_none_or(|(_, most)| value > most) {
        *greatest = Some((place, value));
    }
}

#[derive(Default)]
struct Sums {
    error_squared: f64,
    truth_squared: f64,
    predicted_squared: f64,
    product: f64,
    predicted: f64,
    truth: f64,
}

impl Sums {
    fn add(&mut self, p: f32, t: f32) {
        let (p, t) = (f64::from(p), f64::from(t));
        self.error_squared += (p - t).powi(2);
        self.truth_squared += t * t;
        self.predicted_squared += p * p;
        self.product += p * t;
        self.predicted += p;
        self.truth += t;
    }

    fn relative_l2(&self) -> Option<f64> {
        (self.truth_squared > 0.0).then(|| (self.error_squared / self.truth_squared).sqrt())
    }

    fn closest_factor(&self) -> Option<f64> {
        (self.predicted_squared > 0.0).then(|| self.product / self.predicted_squared)
    }
}

/// `|predicted - truth| / |truth|` over all values; none where the truth is zero.
pub(crate) fn relative_l2(predicted: &[f32], truth: &[f32]) -> Option<f64> {
    let mut all = Sums::default();
    for (p, t) in predicted.iter().zip(truth) {
        all.add(*p, *t);
    }
    all.relative_l2()
}

/// The same over the pixels of the interface.
pub(crate) fn relative_l2_on(ground: &Ground, predicted: &[f32], truth: &[f32]) -> Option<f64> {
    let mut all = Sums::default();
    for ((p, t), _) in predicted.iter().zip(truth).zip(&ground.mask).filter(|(_, is_in)| **is_in) {
        all.add(*p, *t);
    }
    all.relative_l2()
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
    let nail_base: Vec<f64> = samples.iter().filter_map(|s| s.nail_base_error).collect();
    let ssim = all(|s| s.ssim);
    Some(Metrics {
        dataset_sha256: None,
        split: split.to_owned(),
        samples: samples.len(),
        relative_l2: spread(&all(|s| s.relative_l2))?,
        far_field_relative_l2: spread(&far),
        peak_error: spread(&all(|s| s.peak_error))?,
        peak_distance_mm: spread(&all(|s| s.peak_distance_mm)),
        nail_base_error: spread(&nail_base),
        total_energy_error: spread(&all(|s| s.total_energy_error))?,
        ssim: Similarity { median: quantile(&ssim, 0.5)?, p5: quantile(&ssim, 0.05)? },
    })
}

/// Median and 95th percentile; none if there are no values.
pub(crate) fn spread(values: &[f64]) -> Option<Spread> {
    Some(Spread { median: quantile(values, 0.5)?, p95: quantile(values, 0.95)? })
}

#[cfg(test)]
mod tests;
