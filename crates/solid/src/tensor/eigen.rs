//! Eigenvalues and eigenvectors of symmetric 3 x 3 matrices.

use super::Mat3;

/// Sweeps of Jacobi's method; it converges quadratically, five are plenty.
const SWEEPS_MAX: u32 = 12;

/// Eigenvalues of the symmetric `m` with its orthonormal eigenvectors, one a row.
///
/// Jacobi's method: accurate to rounding of the largest entry, also for repeated
/// and nearly equal eigenvalues, where closed forms lose half the digits.
#[must_use]
#[inline(always)]
pub fn symmetric(m: &Mat3) -> ([f64; 3], Mat3) {
    let mut a = *m;
    let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..SWEEPS_MAX {
        if [a[0][1], a[0][2], a[1][2]].iter().all(|&x| x == 0.0) {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            rotate(&mut a, &mut v, p, q);
        }
    }
    ([a[0][0], a[1][1], a[2][2]], v)
}

/// Annihilates `a[p][q]` (Golub & Van Loan, 8.5.2).
#[inline(always)]
fn rotate(a: &mut Mat3, v: &mut Mat3, p: usize, q: usize) {
    let off = a[p][q];
    // Below rounding of the diagonal it changes nothing.
    if off.abs() <= 0.5 * f64::EPSILON * (a[p][p].abs() * a[q][q].abs()).sqrt() {
        a[p][q] = 0.0;
        a[q][p] = 0.0;
        return;
    }
    // Roots, not `hypot`, which took a quarter of a simulation of Ogden's law. Where `tau` squared is no
    // number, the turn is too small to be one.
    let tau = (a[q][q] - a[p][p]) / (2.0 * off);
    let t = tau.signum() / (tau.abs() + (1.0 + tau * tau).sqrt());
    let c = 1.0 / (1.0 + t * t).sqrt();
    let s = t * c;
    let r = 3 - p - q;
    a[p][p] -= t * off;
    a[q][q] += t * off;
    a[p][q] = 0.0;
    a[q][p] = 0.0;
    let (rp, rq) = (a[r][p], a[r][q]);
    a[r][p] = c * rp - s * rq;
    a[p][r] = a[r][p];
    a[r][q] = s * rp + c * rq;
    a[q][r] = a[r][q];
    let (vp, vq) = (v[p], v[q]);
    v[p] = std::array::from_fn(|i| c * vp[i] - s * vq[i]);
    v[q] = std::array::from_fn(|i| s * vp[i] + c * vq[i]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn rebuilt(values: [f64; 3], vectors: &Mat3) -> Mat3 {
        std::array::from_fn(|i| {
            std::array::from_fn(|j| (0..3).map(|a| values[a] * vectors[a][i] * vectors[a][j]).sum())
        })
    }

    proptest! {
        #[test]
        fn the_matrix_comes_back(v in prop::array::uniform6(-1.0f64..1.0), scale in -200i32..200) {
            let s = 10f64.powi(scale / 2);
            let m = [[v[0], v[1], v[2]], [v[1], v[3], v[4]], [v[2], v[4], v[5]]].map(|r| r.map(|x| x * s));
            let (values, vectors) = symmetric(&m);
            let back = rebuilt(values, &vectors);
            for i in 0..3 {
                for j in 0..3 {
                    prop_assert!((back[i][j] - m[i][j]).abs() < 1e-14 * s);
                    let dot: f64 = (0..3).map(|k| vectors[i][k] * vectors[j][k]).sum();
                    prop_assert!((dot - f64::from(u8::from(i == j))).abs() < 1e-14);
                }
            }
        }
    }

    #[test]
    fn repeated_and_nearly_equal_values_are_exact() {
        for gap in [0.0, 1e-16, 1e-12, 1e-8, 1e-4] {
            let turned = rebuilt(
                [1.0, 1.0 + gap, 2.0],
                &[[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]],
            );
            let (mut values, _) = symmetric(&turned);
            values.sort_unstable_by(f64::total_cmp);
            assert!((values[1] - values[0] - gap).abs() < 4e-16 && (values[2] - 2.0).abs() < 4e-16);
        }
    }
}
