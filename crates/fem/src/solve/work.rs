//! Work of a moving indenter, from the equilibria on its path.

use super::loading::MovingIndenter;

/// Exponent of force over way where only one equilibrium is known: a ball's (Hertz).
const DEFAULT_EXPONENT: f64 = 1.5;

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

    /// Work, mJ. On a straight path the force history is integrated with powers of the way that
    /// change smoothly from equilibrium to equilibrium, which is exact for Hertz-like contact.
    pub(super) fn total_mj(&self, indenter: &MovingIndenter) -> f64 {
        match indenter.straight_travel() {
            Some((length, _)) => integral(&self.straight) * length,
            None => self.sum_mj,
        }
    }
}

/// Four Gauss points and weights on [-1, 1].
const GAUSS_4: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_9),
    (-0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_9),
];

/// Integral from `x = 0` of `(x, f)` points, the first of them `(0, 0)`: `ln f` is a cubic
/// polynomial of `ln x` between points, with the slope of the parabola through three of them, and
/// linear before the first; trapezia where a force is not positive.
fn integral(points: &[(f64, f64)]) -> f64 {
    let pushed = points.iter().skip(1).take_while(|p| p.1 > 0.0).count();
    let logs: Vec<(f64, f64)> =
        points[1.min(points.len())..][..pushed].iter().map(|(x, f)| (x.ln(), f.ln())).collect();
    let slopes = slopes(&logs);
    let trapezium = |a: (f64, f64), b: (f64, f64)| 0.5 * (b.0 - a.0) * (a.1 + b.1);
    let mut total = match (points.get(1), slopes.first()) {
        (Some(&(x, f)), Some(m)) if *m > -1.0 => x * f / (m + 1.0),
        (Some(&b), _) => trapezium(points[0], b),
        (None, _) => 0.0,
    };
    for i in 2..points.len() {
        let (a, b) = (points[i - 1], points[i]);
        if i > pushed {
            total += trapezium(a, b);
            continue;
        }
        let ((s, p), (t, q)) = (logs[i - 2], logs[i - 1]);
        let (m, n) = ((t - s) * slopes[i - 2], (t - s) * slopes[i - 1]);
        for (at, weight) in GAUSS_4 {
            let x = 0.5 * ((1.0 - at) * a.0 + (1.0 + at) * b.0);
            let r = (x.ln() - s) / (t - s);
            let rest = 1.0 - r;
            let value = rest * rest * ((1.0 + 2.0 * r) * p + r * m)
                + r * r * ((3.0 - 2.0 * r) * q - rest * n);
            total += 0.5 * (b.0 - a.0) * weight * value.exp();
        }
    }
    total
}

/// Slope at each of some points of the parabola through it and its neighbours.
fn slopes(points: &[(f64, f64)]) -> Vec<f64> {
    let secant = |i: usize| (points[i + 1].1 - points[i].1) / (points[i + 1].0 - points[i].0);
    let last = points.len().saturating_sub(1);
    (0..points.len())
        .map(|i| {
            if last < 1 {
                return DEFAULT_EXPONENT;
            }
            if last < 2 {
                return secant(0);
            }
            // Slopes of the parabola through points k - 1, k, k + 1.
            let k = i.clamp(1, last - 1);
            let (h, g) = (points[k].0 - points[k - 1].0, points[k + 1].0 - points[k].0);
            let bend = (secant(k) - secant(k - 1)) / (h + g);
            secant(k - 1) + bend * (2.0 * points[i].0 - points[k].0 - points[k - 1].0)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_work_of_a_power_law_is_exact_to_the_quadrature() {
        let points: Vec<_> =
            (0..6).map(|i| f64::from(i) * 0.3).map(|x| (x, 2.0 * x.powf(1.7))).collect();
        let exact = 2.0 * 1.5f64.powf(2.7) / 2.7;
        assert!((integral(&points) - exact).abs() < 1e-6 * exact);
    }

    /// Of a force that stiffens like a finger's, six equilibria give a thousandth.
    #[test]
    fn the_work_of_a_stiffening_force_is_close() {
        let force = |x: f64| x.powf(1.5) * (1.2 * x).exp();
        let mut points = vec![(0.0, 0.0), (0.075, force(0.075))];
        points.extend((1..=6).map(|i| 0.25 * f64::from(i)).map(|x| (x, force(x))));
        let n = 200_000;
        let exact: f64 =
            (0..n).map(|i| force(1.5 * (f64::from(i) + 0.5) / f64::from(n))).sum::<f64>() * 1.5
                / f64::from(n);
        assert!((integral(&points) / exact - 1.0).abs() < 5e-4);
    }

    #[test]
    fn a_force_that_vanishes_is_summed_by_trapezia() {
        let points = [(0.0, 0.0), (1.0, 1.0), (2.0, 0.0), (3.0, 0.0)];
        let expected = 1.0 / (DEFAULT_EXPONENT + 1.0) + 0.5;
        assert!((integral(&points) - expected).abs() < 1e-12);
        assert!(integral(&[]).abs() < f64::MIN_POSITIVE);
    }
}
