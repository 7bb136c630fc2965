//! Structural similarity of two maps.

use papilla_proto::MAP_SIDE_PX;

/// Half of the window of 11 x 11 pixels.
const REACH: usize = 5;
/// Standard deviation of the window, pixels.
const SIGMA: f64 = 1.5;
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// Mean structural similarity over the pixels of `mask`, after both maps are divided by
/// `scale` (the truth's maximum, so that the dynamic range is 1).
///
/// As Wang, Bovik, Sheikh & Simoncelli, 'Image quality assessment: from error visibility
/// to structural similarity', IEEE Trans. Image Process. 13 (2004): an 11 x 11 Gaussian
/// window of sigma 1.5 px, K1 = 0.01, K2 = 0.03. Beyond the image the maps are zero, as
/// they are outside the mask. 1 for equal maps; `NaN` if the mask is empty.
#[must_use]
pub fn ssim(predicted: &[f32], truth: &[f32], mask: &[bool], scale: f64) -> f64 {
    let scaled = |map: &[f32]| map.iter().map(|&v| f64::from(v) / scale).collect::<Vec<_>>();
    let (p, t) = (scaled(predicted), scaled(truth));
    let product =
        |a: &[f64], b: &[f64]| blur(&a.iter().zip(b).map(|(a, b)| a * b).collect::<Vec<_>>());
    let (mean_p, mean_t) = (blur(&p), blur(&t));
    let (pp, tt, pt) = (product(&p, &p), product(&t, &t), product(&p, &t));
    let (mut sum, mut count) = (0.0, 0.0);
    for i in (0..mask.len()).filter(|&i| mask[i]) {
        let (mp, mt) = (mean_p[i], mean_t[i]);
        let (var_p, var_t, covariance) = (pp[i] - mp * mp, tt[i] - mt * mt, pt[i] - mp * mt);
        sum += ((2.0 * mp * mt + C1) * (2.0 * covariance + C2))
            / ((mp * mp + mt * mt + C1) * (var_p + var_t + C2));
        count += 1.0;
    }
    sum / count
}

/// Gaussian weights of one row of the window; their sum is 1.
fn window() -> [f64; 2 * REACH + 1] {
    let mut weights = [0.0; 2 * REACH + 1];
    for (i, weight) in weights.iter_mut().enumerate() {
        let x = i as f64 - REACH as f64;
        *weight = (-x * x / (2.0 * SIGMA * SIGMA)).exp();
    }
    let sum: f64 = weights.iter().sum();
    weights.map(|weight| weight / sum)
}

fn blur(map: &[f64]) -> Vec<f64> {
    let pass = |map: &[f64], step: usize| -> Vec<f64> {
        let weights = window();
        (0..map.len())
            .map(|i| {
                let place = i / step % MAP_SIDE_PX;
                let first = place.saturating_sub(REACH);
                let last = (place + REACH).min(MAP_SIDE_PX - 1);
                let start = i - place * step;
                (first..=last).map(|j| weights[j + REACH - place] * map[start + j * step]).sum()
            })
            .collect()
    };
    pass(&pass(map, 1), MAP_SIDE_PX)
}
