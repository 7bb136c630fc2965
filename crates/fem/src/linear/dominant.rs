//! Dominant directions of many vectors, from their inner products.

use faer::{Mat, Side};

/// The `count` largest eigenvalues of a symmetric `n x n` matrix, falling, with their
/// eigenvectors; fewer if the rest is rounding. `None` if the matrix is not finite.
#[must_use]
pub fn dominant(matrix: &[f64], n: usize, count: usize) -> Option<Vec<(f64, Vec<f64>)>> {
    let full = Mat::from_fn(n, n, |i, k| matrix[i * n + k]);
    let found = full.self_adjoint_eigen(Side::Lower).ok()?;
    let values = found.S().column_vector();
    let largest = (0..n).map(|i| values[i]).fold(0.0, f64::max);
    let kept = (0..n).rev().take(count).take_while(|&i| values[i] > 1e-12 * largest);
    Some(kept.map(|i| (values[i], (0..n).map(|k| found.U()[(k, i)]).collect())).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_come_first_and_rounding_is_left_out() {
        // 5 u u^T + 2 v v^T with u, v orthonormal in three dimensions.
        let (u, v) = ([0.6, 0.8, 0.0], [0.0, 0.0, 1.0]);
        let matrix: Vec<f64> =
            (0..9).map(|e| 5.0 * u[e / 3] * u[e % 3] + 2.0 * v[e / 3] * v[e % 3]).collect();
        let found = dominant(&matrix, 3, 3).unwrap();
        assert_eq!(found.len(), 2);
        for ((value, vector), (due, direction)) in found.iter().zip([(5.0, u), (2.0, v)]) {
            assert!((value - due).abs() < 1e-13);
            let along: f64 = vector.iter().zip(direction).map(|(a, b)| a * b).sum();
            assert!((along.abs() - 1.0).abs() < 1e-13);
        }
        assert!(dominant(&[f64::NAN], 1, 1).is_none_or(|found| found.is_empty()));
    }
}
