//! Rates of SA1 afferents from what their receptors feel: a gain and a threshold.

use serde::{Deserialize, Serialize};

/// `rate = gain (felt - threshold)`, none below the threshold.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Law {
    /// Impulses a second for each unit of what is felt.
    pub gain: f64,
    /// In the unit of what is felt; not negative, for an SA1 afferent is silent at rest.
    pub threshold: f64,
}

impl Law {
    /// Impulses a second.
    #[must_use]
    pub fn rate_per_s(&self, felt: f64) -> f64 {
        (self.gain * (felt - self.threshold)).max(0.0)
    }

    /// The law with the least sum of squares; `None` where no rate rises with what is felt.
    ///
    /// For each set of the largest values that could lie above the threshold it is the line of least
    /// squares, or, where that line's threshold lies outside of what makes this set, the line from
    /// the bound: the sum of squares is convex in between, so the best of these is the best of all.
    #[must_use]
    pub fn fitted(felt: &[f64], rate_per_s: &[f64]) -> Option<Self> {
        let mut points: Vec<(f64, f64)> =
            felt.iter().copied().zip(rate_per_s.iter().copied()).collect();
        points.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut best: Option<(f64, Self)> = None;
        for above in 1..=points.len() {
            let set = &points[..above];
            let high = set[above - 1].0;
            let low = points.get(above).map_or(0.0, |p| p.0).max(0.0);
            let free = line(set).map(|l| l.threshold).filter(|t| (low..=high).contains(t));
            let thresholds = [free, Some(low), Some(high)].into_iter().flatten();
            for threshold in thresholds.filter(|t| *t >= 0.0) {
                let Some(law) = through(set, threshold) else { continue };
                let missed = points.iter().map(|p| (p.1 - law.rate_per_s(p.0)).powi(2)).sum();
                if best.is_none_or(|(least, _)| missed < least) {
                    best = Some((missed, law));
                }
            }
        }
        best.map(|(_, law)| law)
    }
}

/// As [`Law::fitted`], with a threshold of either sign: one below 0 is a rate at rest. `None` where
/// the line of least squares does not rise.
#[must_use]
pub fn line_of(felt: &[f64], rate_per_s: &[f64]) -> Option<Law> {
    line(&felt.iter().copied().zip(rate_per_s.iter().copied()).collect::<Vec<_>>())
}

/// Line of least squares; `None` if it does not rise.
fn line(points: &[(f64, f64)]) -> Option<Law> {
    let n = points.len() as f64;
    let mean = |pick: fn(&(f64, f64)) -> f64| points.iter().map(pick).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let xx: f64 = points.iter().map(|p| (p.0 - x).powi(2)).sum();
    let xy: f64 = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    let gain = xy / xx;
    (gain.is_finite() && gain > 0.0).then(|| Law { gain, threshold: x - y / gain })
}

/// Line of least squares that starts at `threshold`; `None` if it does not rise.
fn through(points: &[(f64, f64)], threshold: f64) -> Option<Law> {
    let over = |p: &(f64, f64)| p.0 - threshold;
    let gain = points.iter().map(|p| over(p) * p.1).sum::<f64>()
        / points.iter().map(|p| over(p).powi(2)).sum::<f64>();
    (gain.is_finite() && gain > 0.0).then_some(Law { gain, threshold })
}

/// Share of the variance of `measured` that `predicted` explains; negative where the mean of
/// `measured` would be nearer.
#[must_use]
pub fn r_squared(measured: &[f64], predicted: &[f64]) -> f64 {
    let mean = measured.iter().sum::<f64>() / measured.len() as f64;
    let all: f64 = measured.iter().map(|m| (m - mean).powi(2)).sum();
    let missed: f64 = measured.iter().zip(predicted).map(|(m, p)| (m - p).powi(2)).sum();
    1.0 - missed / all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn missed(law: Law, felt: &[f64], rate: &[f64]) -> f64 {
        felt.iter().zip(rate).map(|(q, r)| (r - law.rate_per_s(*q)).powi(2)).sum()
    }

    #[test]
    fn a_law_is_found_from_its_own_rates() {
        let truth = Law { gain: 7.0, threshold: 1.3 };
        let felt = [0.2, 4.0, 1.0, 2.5, 1.4, 9.0];
        let law = Law::fitted(&felt, &felt.map(|q| truth.rate_per_s(q))).unwrap();
        assert!((law.gain - 7.0).abs() < 1e-12 && (law.threshold - 1.3).abs() < 1e-12, "{law:?}");
    }

    /// Against a search of the whole plane of gain and threshold.
    #[test]
    fn no_other_gain_and_threshold_are_nearer() {
        let felt = [0.3, 0.5, 0.9, 1.6, 2.2, 2.9, 3.1];
        for rate in [
            [0.0, 9.0, 4.0, 20.0, 31.0, 28.0, 50.0],
            [21.3, 29.4, 37.2, 44.0, 54.3, 73.1, 84.0],
            [0.0, 0.0, 0.0, 1.0, 40.0, 41.0, 90.0],
        ] {
            let least = missed(Law::fitted(&felt, &rate).unwrap(), &felt, &rate);
            for i in 0..=300 {
                for j in 0..=300 {
                    let law = Law { gain: 0.3 * f64::from(i), threshold: 0.01 * f64::from(j) };
                    assert!(missed(law, &felt, &rate) >= least - 1e-9, "{law:?}");
                }
            }
        }
    }

    #[test]
    fn rates_that_fall_have_no_law_and_the_mean_explains_nothing() {
        assert_eq!(Law::fitted(&[1.0, 2.0, 3.0], &[0.0, 0.0, 0.0]), None);
        let rate = [1.0, 2.0, 6.0];
        assert_eq!(r_squared(&rate, &[3.0; 3]), 0.0);
        assert_eq!(r_squared(&rate, &rate), 1.0);
        assert!(r_squared(&rate, &[6.0, 2.0, 1.0]) < 0.0);
    }
}
