//! Work of a moving indenter, from the equilibria on its path.

use super::loading::MovingIndenter;

/// Force along the path so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Work {
    /// `(load fraction, force along the travel)` of a straight path, N.
    straight: Vec<(f64, f64)>,
    /// Displacement and force at the last equilibrium of any other path.
    last: ([f64; 3], [f64; 3]),
    /// Trapezoidal sum of any other path, mJ.
    sum_mj: f64,
    /// Its largest amount so far.
    pub largest_mj: f64,
}

impl Work {
    /// Takes the contact force (N, on the body) of an equilibrium.
    pub(super) fn add(&mut self, indenter: &MovingIndenter, fraction: f64, force: [f64; 3]) {
        if let Some((_, direction)) = indenter.straight_travel() {
            if self.straight.is_empty() {
                self.straight.push((0.0, 0.0));
            }
            self.straight.push((fraction, (0..3).map(|i| force[i] * direction[i]).sum()));
            return;
        }
        let offset = indenter.offset_mm(fraction);
        let (from, before) = self.last;
        self.sum_mj +=
            (0..3).map(|i| 0.5 * (before[i] + force[i]) * (offset[i] - from[i])).sum::<f64>();
        self.largest_mj = self.largest_mj.max(self.sum_mj.abs());
        self.last = (offset, force);
    }

    /// Work, mJ. On a straight path the force history is integrated by a power
    /// law between equilibria, which is exact for Hertz-like contact.
    pub(super) fn total_mj(&self, indenter: &MovingIndenter) -> f64 {
        match indenter.straight_travel() {
            Some((length, _)) => power_law_integral(&self.straight) * length,
            None => self.sum_mj,
        }
    }
}

/// Integral of `(x, f)` points with `f = c x^m` on each interval; on the first,
/// from `x = 0`, with the exponent of the second.
fn power_law_integral(points: &[(f64, f64)]) -> f64 {
    let exponent = |a: (f64, f64), b: (f64, f64)| {
        if a.0 > 0.0 && a.1 > 0.0 && b.1 > 0.0 {
            Some((b.1 / a.1).ln() / (b.0 / a.0).ln())
        } else {
            None
        }
    };
    let mut total = 0.0;
    for (i, w) in points.windows(2).enumerate() {
        let (a, b) = (w[0], w[1]);
        let m = exponent(a, b).or_else(|| points.get(i + 2).and_then(|&c| exponent(b, c)));
        total += match m {
            Some(m) if (m + 1.0).abs() > 1e-6 && b.0 > 0.0 => (b.0 * b.1 - a.0 * a.1) / (m + 1.0),
            _ => 0.5 * (b.0 - a.0) * (a.1 + b.1),
        };
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_work_of_a_power_law_is_exact() {
        let points: Vec<_> =
            (0..6).map(|i| f64::from(i) * 0.3).map(|x| (x, 2.0 * x.powf(1.7))).collect();
        let exact = 2.0 * 1.5f64.powf(2.7) / 2.7;
        assert!((power_law_integral(&points) - exact).abs() < 1e-12 * exact);
    }
}
