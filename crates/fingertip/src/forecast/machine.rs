//! How fast this machine is, by two probes of some milliseconds each.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};
use serde::Serialize;
use std::hint::black_box;
use std::sync::OnceLock;
use std::time::Instant;

/// Speed of one core: the fastest of several runs, which on a busy machine is what
/// the core does while it is left alone.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Machine {
    /// Multiplications and additions of a dense f32 matrix product, 1/s.
    pub dense_flops_per_s: f64,
    /// Bytes read from memory beyond the caches, 1/s.
    pub stream_bytes_per_s: f64,
}

/// Order of the matrices.
const ORDER: usize = 256;
/// Numbers that are streamed: 32 MiB.
const NUMBERS: usize = 8 << 20;
/// Runs of each probe.
const RUNS: usize = 9;

impl Machine {
    /// The core that this runs on, probed when it is first asked for: once for each process.
    #[must_use]
    pub fn here() -> Self {
        static HERE: OnceLock<Machine> = OnceLock::new();
        *HERE.get_or_init(Self::probe)
    }

    fn probe() -> Self {
        let entry = |i: usize, j: usize| ((7 * i + 3 * j) % 11) as f32;
        let (a, b) = (Mat::from_fn(ORDER, ORDER, entry), Mat::from_fn(ORDER, ORDER, entry));
        let mut c = Mat::<f32>::zeros(ORDER, ORDER);
        let product = fastest_s(RUNS, || {
            matmul(c.as_mut(), Accum::Replace, a.as_ref(), b.as_ref(), 1.0, Par::Seq);
            black_box(&c);
        });
        let numbers = vec![1.0f32; NUMBERS];
        let read = fastest_s(RUNS, || {
            // Sixteen sums side by side, or the latency of an addition would be measured.
            let mut sums = [0.0f32; 16];
            for chunk in black_box(&numbers).chunks_exact(16) {
                for (s, v) in sums.iter_mut().zip(chunk) {
                    *s += v;
                }
            }
            black_box(sums);
        });
        Self {
            dense_flops_per_s: 2.0 * (ORDER as f64).powi(3) / product,
            stream_bytes_per_s: 4.0 * NUMBERS as f64 / read,
        }
    }
}

/// Shortest time of `runs` runs, s.
pub(super) fn fastest_s(runs: usize, mut run: impl FnMut()) -> f64 {
    (0..runs)
        .map(|_| {
            let clock = Instant::now();
            run();
            clock.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min)
        .max(1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_machine_is_probed_once() {
        let first = Machine::here();
        assert!(first.dense_flops_per_s > 0.0 && first.stream_bytes_per_s > 0.0);
        // Two probes would hardly agree to the bit.
        assert_eq!(first, Machine::here());
    }
}
