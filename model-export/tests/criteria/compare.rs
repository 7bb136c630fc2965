//! One row of the ladder held against another, figure by figure.

use papilla_engine::card::Spread;
use papilla_engine::ladder::SetErrors;

/// Every figure as an error: name, rung's, and whether it is present in both.
fn figures(errors: &SetErrors) -> Vec<(String, Option<f64>)> {
    let mut all = Vec::new();
    let mut add = |name: &str, spread: Option<Spread>| {
        all.push((format!("{name}, median"), spread.map(|s| s.median)));
        all.push((format!("{name}, p95"), spread.map(|s| s.p95)));
    };
    add("relative L2", Some(errors.relative_l2));
    add("far field", errors.far_field_relative_l2);
    add("peak", Some(errors.peak_error));
    add("place of the peak", errors.peak_distance_mm);
    add("nail base", errors.nail_base_error);
    add("total energy", Some(errors.total_energy_error));
    all.push(("1 - SSIM, median".to_owned(), Some(1.0 - errors.ssim.median)));
    all.push(("1 - SSIM, p5".to_owned(), Some(1.0 - errors.ssim.p5)));
    all
}

/// The figures in which `rung` is not better than `baseline`, and how many there are.
pub(crate) fn lost(rung: &SetErrors, baseline: &SetErrors) -> (Vec<String>, usize) {
    let pairs = figures(rung).into_iter().zip(figures(baseline));
    let both: Vec<(String, f64, f64)> =
        pairs.filter_map(|((name, ours), (_, theirs))| Some((name, ours?, theirs?))).collect();
    let count = both.len();
    let lost = both.into_iter().filter(|(_, ours, theirs)| ours >= theirs);
    (lost.map(|(name, ..)| name).collect(), count)
}

#[cfg(test)]
mod tests {
    use super::lost;
    use papilla_engine::card::{Similarity, Spread};
    use papilla_engine::ladder::SetErrors;

    fn errors(value: f64) -> SetErrors {
        let spread = Spread { median: value, p95: 2.0 * value };
        SetErrors {
            samples: 1,
            relative_l2: spread,
            far_field_relative_l2: Some(spread),
            peak_error: spread,
            peak_distance_mm: Some(spread),
            nail_base_error: None,
            total_energy_error: spread,
            ssim: Similarity { median: 1.0 - value, p5: 1.0 - 2.0 * value },
        }
    }

    #[test]
    fn better_is_better_in_every_figure_that_both_have() {
        let (good, bad) = (errors(0.1), errors(0.2));
        assert_eq!(lost(&good, &bad), (Vec::new(), 12));
        assert_eq!(lost(&bad, &good).0.len(), 12);
        let mut mixed = errors(0.1);
        mixed.peak_error.p95 = 0.9;
        mixed.ssim.median = 0.5;
        assert_eq!(lost(&mixed, &bad).0, ["peak, p95", "1 - SSIM, median"]);
        // No better is not better.
        assert_eq!(lost(&good, &good).0.len(), 12);
    }
}
