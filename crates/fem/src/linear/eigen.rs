//! Small symmetric eigenproblems; [`papilla_solid::tensor::eigen`] has the 3 x 3 one of the hot path.

/// Eigenvalues and eigenvectors (rows) of a symmetric matrix by Jacobi's rotations.
pub(crate) fn eigen<const N: usize>(mut a: [[f64; N]; N]) -> ([f64; N], [[f64; N]; N]) {
    let mut v = [[0.0; N]; N];
    for i in 0..N {
        v[i][i] = 1.0;
    }
    // Converges quadratically; ten sweeps are plenty for six columns.
    for _ in 0..30 {
        for p in 0..N {
            for q in p + 1..N {
                if a[p][q] == 0.0 {
                    continue;
                }
                let tau = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                let t = tau.signum() / (tau.abs() + (1.0 + tau * tau).sqrt());
                let c = 1.0 / (1.0 + t * t).sqrt();
                let s = t * c;
                for k in 0..N {
                    (a[k][p], a[k][q]) = (c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]);
                }
                for k in 0..N {
                    (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
                    (v[p][k], v[q][k]) = (c * v[p][k] - s * v[q][k], s * v[p][k] + c * v[q][k]);
                }
                (a[p][q], a[q][p]) = (0.0, 0.0);
            }
        }
    }
    (std::array::from_fn(|i| a[i][i]), v)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_and_values_make_the_matrix_again() {
        let a = [[2.0, -1.0, 0.3], [-1.0, 5.0, 1e-9], [0.3, 1e-9, 2.0]];
        let (values, vectors) = eigen(a);
        for i in 0..3 {
            for j in 0..3 {
                let made: f64 = (0..3).map(|k| values[k] * vectors[k][i] * vectors[k][j]).sum();
                assert!((made - a[i][j]).abs() < 1e-14, "{i} {j}: {made}");
            }
        }
        let (values, _) = eigen([[3.0, 0.0], [0.0, -1.0]]);
        assert_eq!(values.map(f64::to_bits), [3.0, -1.0].map(f64::to_bits));
    }
}
