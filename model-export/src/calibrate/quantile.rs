//! Linear quantile regression on few facts and few states.

/// What is fitted to: `values` by rows of as many numbers each as there are coefficients to find,
/// the constant 1 first, and the weight of each row.
#[derive(Debug, Default)]
pub(super) struct Table {
    pub(super) rows: Vec<Vec<f64>>,
    pub(super) values: Vec<f64>,
    pub(super) weights: Vec<f64>,
}

/// The pinball loss is rounded off within so much of its edge, finer and finer.
const ROUNDED: [f64; 4] = [0.3, 0.1, 0.03, 0.01];
/// Steps at each.
const STEPS: usize = 12;

impl Table {
    /// The coefficients whose sum with a row is the `share` quantile of its value: those of least
    /// pinball loss and `ridge` times their squares, but for the constant's. Reweighted least
    /// squares (Hunter & Lange 2000).
    pub(super) fn quantile(&self, share: f64, ridge: f64) -> Vec<f64> {
        let count = self.rows.first().map_or(0, Vec::len);
        let mut found = vec![0.0; count];
        if let Some(first) = found.first_mut() {
            *first = conformal_quantile(&self.values, share).unwrap_or(0.0);
        }
        for rounded in ROUNDED {
            for _ in 0..STEPS {
                let mut matrix = vec![vec![0.0; count + 1]; count];
                for (i, row) in matrix.iter_mut().enumerate() {
                    row[i] = if i == 0 { 1e-9 } else { 2.0 * ridge };
                }
                for ((row, value), weight) in self.rows.iter().zip(&self.values).zip(&self.weights)
                {
                    let miss = value - dot(row, &found);
                    let of_square = 0.5 * weight / miss.hypot(rounded);
                    let due = of_square * value + weight * (share - 0.5);
                    for (line, a) in matrix.iter_mut().zip(row) {
                        for (sum, b) in line.iter_mut().zip(row) {
                            *sum += of_square * a * b;
                        }
                        line[count] += due * a;
                    }
                }
                found = solved(matrix);
            }
        }
        found
    }
}

/// The value that another one of their kind exceeds with a chance of 1 - `share` at most: split
/// conformal prediction, which counts the other one among them. None without values.
pub(super) fn conformal_quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let place = (share * (sorted.len() + 1) as f64 - 1e-9).ceil() as usize;
    sorted.get(place.clamp(1, sorted.len().max(1)) - 1).copied()
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The solution of a positive definite system, whose right side is the last column.
fn solved(mut lines: Vec<Vec<f64>>) -> Vec<f64> {
    let count = lines.len();
    for i in 0..count {
        let (above, below) = lines.split_at_mut(i + 1);
        let pivot = &above[i];
        for line in below {
            let part = line[i] / pivot[i];
            line.iter_mut().zip(pivot).skip(i).for_each(|(to, from)| *to -= part * from);
        }
    }
    let mut found = vec![0.0; count];
    for i in (0..count).rev() {
        let known = dot(&lines[i][i + 1..count], &found[i + 1..]);
        found[i] = (lines[i][count] - known) / lines[i][i];
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values spread evenly over 0 to 1 + x: their quantiles are lines in x.
    #[test]
    fn quantiles_of_a_widening_band_are_found() {
        let mut table = Table::default();
        for i in 0..40 {
            for k in 0..25 {
                let x = f64::from(i) / 40.0;
                table.rows.push(vec![1.0, x]);
                table.values.push((f64::from(k) + 0.5) / 25.0 * (1.0 + x));
                table.weights.push(1.0);
            }
        }
        for share in [0.5, 0.9] {
            for found in table.quantile(share, 1e-6) {
                assert!((found - share).abs() < 0.03, "{found} at {share}");
            }
        }
    }

    #[test]
    fn a_quantile_leaves_room_for_the_next_value() {
        let values: Vec<f64> = (1..=19).rev().map(f64::from).collect();
        // The 18th of 19: of twenty equally likely places of the next one, 18 are below it.
        assert_eq!(conformal_quantile(&values, 0.9), Some(18.0));
        assert_eq!(conformal_quantile(&values[..4], 0.9), Some(19.0));
        assert_eq!(conformal_quantile(&[], 0.5), None);
    }
}
