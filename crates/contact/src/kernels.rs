//! Sums and products over f32 vectors, compiled for the widest vectors of the processor.

/// Partial sums of a dot product: enough for two 512-bit registers.
const LANES: usize = 32;

/// Runs `work` compiled for the widest vectors of this processor.
#[inline(always)]
pub(crate) fn vectorized<T>(work: impl FnOnce() -> T) -> T {
    pulp::Arch::new().dispatch(work)
}

/// `a . b`; to be called inside [`vectorized`].
#[inline(always)]
pub(crate) fn dot(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0f32; LANES];
    let (a_blocks, b_blocks) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f32 = a_blocks.remainder().iter().zip(b_blocks.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a_blocks.zip(b_blocks) {
        for l in 0..LANES {
            sums[l] += x[l] * y[l];
        }
    }
    let mut width = LANES / 2;
    while width > 0 {
        for l in 0..width {
            sums[l] += sums[l + width];
        }
        width /= 2;
    }
    sums[0] + rest
}

/// `y += k x`; to be called inside [`vectorized`].
#[inline(always)]
pub(crate) fn add_scaled(y: &mut [f32], k: f32, x: &[f32]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += k * x;
    }
}

/// `y = A x` for a square matrix of `x.len()` columns whose rows are `stride` apart.
pub(crate) fn multiply(a: &[f32], stride: usize, x: &[f32], y: &mut [f32]) {
    let columns = x.len();
    vectorized(|| {
        for (y, row) in y.iter_mut().zip(a.chunks(stride)) {
            *y = dot(&row[..columns], x);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_what_they_are_in_double_precision() {
        for n in [0, 1, 7, 31, 32, 33, 100] {
            let a: Vec<f32> = (0..n).map(|i| (i as f32 * 0.37).sin()).collect();
            let b: Vec<f32> = (0..n).map(|i| (i as f32 * 0.11).cos()).collect();
            let due: f64 = a.iter().zip(&b).map(|(x, y)| f64::from(*x) * f64::from(*y)).sum();
            let found = f64::from(vectorized(|| dot(&a, &b)));
            assert!((found - due).abs() <= 1e-5 * (n as f64).sqrt().max(1.0), "{n}: {found} {due}");
        }
    }

    #[test]
    fn rows_may_be_farther_apart_than_they_are_long() {
        let a = [1.0, 2.0, 9.0, 3.0, 4.0, 9.0];
        let mut y = [0.0; 2];
        multiply(&a, 3, &[1.0, 10.0], &mut y);
        assert_eq!(y.map(f32::to_bits), [21f32, 43.0].map(f32::to_bits));
    }
}
