//! What one core can do at most.

use pulp::{Arch, Simd, WithSimd};
use std::hint::black_box;
use std::time::{Duration, Instant};

/// Rates of one core; the best of many tries, since what disturbs one makes it slower.
#[derive(Clone, Debug)]
pub struct Rates {
    /// Bytes read in a second of a buffer that is read again and again, from [`LEAST_BYTES`] on each
    /// twice as large as the one before.
    pub bytes_per_s: Vec<f64>,
    /// Additions and multiplications of f32 in a second.
    pub operations_per_s: f64,
}

/// Size of the smallest buffer.
pub const LEAST_BYTES: u64 = 16 << 10;
/// Up to 32 MiB, more than an operator reads.
const BUFFERS: u32 = 12;
/// Time of all tries of one rate.
const TRIES: Duration = Duration::from_millis(80);
/// Sums that do not wait for each other: more than two units with a delay of four cycles hold.
const SUMS: usize = 12;
const ROUNDS: usize = 20_000;

impl Rates {
    /// Measures this core.
    #[must_use]
    pub fn measure() -> Self {
        let arch = Arch::new();
        let read = |size: u32| {
            let buffer = vec![1.0_f32; (LEAST_BYTES << size) as usize / size_of::<f32>()];
            size_of_val(&buffer[..]) as f64 / least(|| arch.dispatch(Read(black_box(&buffer))))
        };
        let mut operations = 0;
        let computed_s = least(|| {
            let (sum, lanes) = arch.dispatch(Compute(black_box(0.5)));
            operations = 2 * SUMS * ROUNDS * lanes;
            sum
        });
        Self {
            bytes_per_s: (0..BUFFERS).map(read).collect(),
            operations_per_s: operations as f64 / computed_s,
        }
    }

    /// Least time for so many bytes, s: as if they lay in the nearest cache that holds them.
    #[must_use]
    pub fn read_s(&self, bytes: u64) -> f64 {
        let size = bytes.div_ceil(LEAST_BYTES).next_power_of_two().ilog2() as usize;
        let rate = self.bytes_per_s.get(size).or(self.bytes_per_s.last());
        bytes as f64 / rate.copied().unwrap_or(f64::INFINITY)
    }
}

/// Least time of one call, s.
fn least(mut work: impl FnMut() -> f32) -> f64 {
    let (begun, mut least) = (Instant::now(), Duration::MAX);
    while begun.elapsed() < TRIES {
        let start = Instant::now();
        black_box(work());
        least = start.elapsed().min(least);
    }
    least.as_secs_f64()
}

/// The sum of all values: every byte is read once.
struct Read<'a>(&'a [f32]);

impl WithSimd for Read<'_> {
    type Output = f32;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f32 {
        let (vectors, _) = S::as_simd_f32s(self.0);
        // Variables of their own: an array of sums would go through memory.
        let zero = simd.splat_f32s(0.0);
        let (mut a, mut b, mut c, mut d) = (zero, zero, zero, zero);
        let (mut e, mut f, mut g, mut h) = (zero, zero, zero, zero);
        let (chunks, _) = vectors.as_chunks::<8>();
        for &[p, q, r, s, t, u, v, w] in chunks {
            (a, b, c, d) = (
                simd.add_f32s(a, p),
                simd.add_f32s(b, q),
                simd.add_f32s(c, r),
                simd.add_f32s(d, s),
            );
            (e, f, g, h) = (
                simd.add_f32s(e, t),
                simd.add_f32s(f, u),
                simd.add_f32s(g, v),
                simd.add_f32s(h, w),
            );
        }
        [a, b, c, d, e, f, g, h].map(|sum| simd.reduce_sum_f32s(sum)).iter().sum()
    }
}

/// Products and sums in registers alone: the result, and values in a vector.
struct Compute(f32);

impl WithSimd for Compute {
    type Output = (f32, usize);

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> (f32, usize) {
        let (factor, term) = (simd.splat_f32s(self.0), simd.splat_f32s(1.0));
        let mut sums = [term; SUMS];
        for _ in 0..ROUNDS {
            for sum in &mut sums {
                *sum = simd.mul_add_e_f32s(*sum, factor, term);
            }
        }
        (sums.into_iter().map(|sum| simd.reduce_sum_f32s(sum)).sum(), S::F32_LANES)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_is_read_and_every_product_is_done() {
        let arch = Arch::new();
        let values: Vec<f32> = (0..4096).map(|i| (i % 7) as f32).collect();
        let sum: f32 = values.iter().sum();
        assert_eq!(arch.dispatch(Read(&values)).to_bits(), sum.to_bits());
        // x = x / 2 + 1 ends at 2 in every lane.
        let (sum, lanes) = arch.dispatch(Compute(0.5));
        assert!((sum - (2 * SUMS * lanes) as f32).abs() < 1e-3, "{sum}");
    }

    #[test]
    fn bytes_are_read_at_the_rate_of_the_least_buffer_that_holds_them() {
        let rates = Rates { bytes_per_s: vec![4.0, 2.0, 1.0], operations_per_s: 1.0 };
        for (bytes, due_s) in [
            (LEAST_BYTES / 2, LEAST_BYTES as f64 / 8.0),
            (LEAST_BYTES, LEAST_BYTES as f64 / 4.0),
            (LEAST_BYTES + 4, (LEAST_BYTES + 4) as f64 / 2.0),
            (3 * LEAST_BYTES, 3.0 * LEAST_BYTES as f64),
            (99 * LEAST_BYTES, 99.0 * LEAST_BYTES as f64),
        ] {
            assert!((rates.read_s(bytes) - due_s).abs() < 1e-6, "{bytes}");
        }
    }
}
