//! Least squares between bounds, on the normal equations.
//!
//! Crates that solve it allocate at each call, which a frame must not.

/// Most sweeps over the unknowns.
const SWEEPS: usize = 200;
/// A sweep that changes no unknown by more than this part of the greatest is the last.
const SETTLED: f64 = 1e-5;

/// Which unknowns the matrix couples; the rest of a row is zero.
#[derive(Debug)]
pub(crate) struct Coupled {
    others: Vec<u32>,
    ends: Vec<usize>,
}

impl Coupled {
    /// Those of a symmetric matrix, row-major.
    pub(crate) fn of(gram: &[f64], n: usize) -> Self {
        let (mut others, mut ends) = (Vec::new(), Vec::with_capacity(n));
        for row in gram.chunks_exact(n) {
            let coupled = row.iter().zip(0..).filter(|(value, _)| value.abs() > 0.0);
            others.extend(coupled.map(|(_, other)| other));
            ends.push(others.len());
        }
        Self { others, ends }
    }

    /// Adds a multiple of row `i` of the matrix.
    fn add(&self, sum: &mut [f64], gram: &[f64], i: usize, times: f64) {
        if times.abs() > 0.0 {
            let begin = if i == 0 { 0 } else { self.ends[i - 1] };
            let row = &gram[i * sum.len()..];
            for &other in &self.others[begin..self.ends[i]] {
                sum[other as usize] += times * row[other as usize];
            }
        }
    }
}

/// Finds the minimum of `x' G x / 2 - b' x` with `0 <= x <= max` by descent along one unknown after
/// the other, which converges for every positive semidefinite `G` (Luo & Tseng 1992).
///
/// `gram` is symmetric, row-major; `slope` holds `b` and is used up. It begins at `x`. Unknowns that
/// nothing depends on keep their value.
pub(crate) fn solve(
    gram: &[f64],
    coupled: &Coupled,
    slope: &mut [f64],
    max: &[f64],
    x: &mut [f64],
) {
    let n = x.len();
    for i in 0..n {
        coupled.add(slope, gram, i, -x[i]);
    }
    for _ in 0..SWEEPS {
        let (mut moved, mut greatest) = (0.0_f64, 0.0_f64);
        for i in 0..n {
            let own = gram[i * n + i];
            if own > 0.0 {
                let to = (x[i] + slope[i] / own).clamp(0.0, max[i]);
                let by = to - x[i];
                x[i] = to;
                coupled.add(slope, gram, i, -by);
                moved = moved.max(by.abs());
            }
            greatest = greatest.max(x[i]);
        }
        if moved <= SETTLED * greatest {
            break;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// `|A x - y|^2` of three unknowns over eight rows.
    fn cost(a: &[f64], y: &[f64], x: &[f64]) -> f64 {
        let row = |i: usize| (0..3).map(|k| a[3 * i + k] * x[k]).sum::<f64>() - y[i];
        (0..8).map(|i| row(i).powi(2)).sum()
    }

    proptest! {
        /// No point of a grid over the box is better, and every slope points out of the box.
        #[test]
        fn nothing_in_the_box_is_better(
            a in prop::collection::vec(-1.0..1.0, 24),
            y in prop::collection::vec(-2.0..2.0, 8),
        ) {
            let (max, cells) = ([1.5; 3], 20);
            let product = |i: usize, k: usize| (0..8).map(|r| a[3 * r + i] * a[3 * r + k]).sum();
            let gram: Vec<f64> = (0..9).map(|at| product(at / 3, at % 3)).collect();
            let right: Vec<f64> = (0..3).map(|i| (0..8).map(|r| a[3 * r + i] * y[r]).sum()).collect();
            let (mut x, mut slope) = ([0.0; 3], right);
            solve(&gram, &Coupled::of(&gram, 3), &mut slope, &max, &mut x);
            prop_assert!(x.iter().all(|x| (0.0..=1.5).contains(x)), "{x:?}");
            let found = cost(&a, &y, &x);
            for at in 0..(cells + 1) * (cells + 1) * (cells + 1_usize) {
                let digits = [at % 21, at / 21 % 21, at / 441];
                let other = digits.map(|d| 1.5 * d as f64 / cells as f64);
                let grid = cost(&a, &y, &other);
                prop_assert!(found <= grid * (1.0 + 1e-6) + 1e-6, "{x:?} {found}, {other:?} {grid}");
            }
        }
    }
}
