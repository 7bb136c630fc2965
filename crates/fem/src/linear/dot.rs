//! The inner product of the solver.

/// Inner product, summed in one order whatever the processor.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four sums: fixed order, so the result repeats, and no serial dependency.
    let mut s = [0.0; 4];
    let (mut p, mut q) = (a.chunks_exact(4), b.chunks_exact(4));
    for (x, y) in (&mut p).zip(&mut q) {
        for i in 0..4 {
            s[i] += x[i] * y[i];
        }
    }
    let tail: f64 = p.remainder().iter().zip(q.remainder()).map(|(x, y)| x * y).sum();
    (s[0] + s[1]) + (s[2] + s[3]) + tail
}
