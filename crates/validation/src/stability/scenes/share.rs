//! What a number of failures among a number of scenes says about the share that fails.

/// Probability that the share of failures is above the bound.
const DOUBT: f64 = 0.05;

/// Upper bound of the share that fails, at 95 % confidence: the largest `p` for which
/// `failures` or fewer among `scenes` independent ones still come about in 5 % of the cases
/// (Clopper & Pearson 1934, one-sided). Without a failure it is `1 - 0.05^(1/n)`, about `3 / n`.
pub(super) fn failing_at_most(failures: usize, scenes: usize) -> f64 {
    if failures >= scenes {
        return 1.0;
    }
    let (mut low, mut high) = (0.0, 1.0);
    // A double has no more digits.
    for _ in 0..100 {
        let p = 0.5 * (low + high);
        if as_few(failures, scenes, p) > DOUBT {
            low = p;
        } else {
            high = p;
        }
    }
    high
}

/// Probability of `failures` or fewer among `scenes`, each with probability `p` in `(0, 1)`.
fn as_few(failures: usize, scenes: usize, p: f64) -> f64 {
    let n = scenes as f64;
    let odds = (p / (1.0 - p)).ln();
    let mut logarithm = n * (-p).ln_1p();
    let mut sum = logarithm.exp();
    for k in 0..failures {
        let k = k as f64;
        logarithm += ((n - k) / (k + 1.0)).ln() + odds;
        sum += logarithm.exp();
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_those_of_the_binomial_distribution() {
        for n in [1, 10, 3000, 10_000] {
            let none = 1.0 - 0.05f64.powf(1.0 / n as f64);
            assert!((failing_at_most(0, n) / none - 1.0).abs() < 1e-10);
            assert!((failing_at_most(n, n) - 1.0).abs() < 1e-15);
            // All but one: 1 - p^n = 0.05.
            let all_but_one = 0.95f64.powf(1.0 / n as f64);
            assert!((failing_at_most(n - 1, n) / all_but_one - 1.0).abs() < 1e-10, "{n}");
        }
        // Quantiles of the beta distribution, .95 of Beta(2, 9) and Beta(6, 95).
        assert!((failing_at_most(1, 10) - 0.394_163).abs() < 1e-6);
        assert!((failing_at_most(5, 100) - 0.102_25).abs() < 1e-5);
    }
}
