//! Forces on the way of a press, and what lies between its stored states.

use serde::{Deserialize, Serialize};

/// Force over depth from first touch, rising.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ForcePath {
    /// Depths, mm.
    pub depth_mm: Vec<f64>,
    /// Forces, N, one a depth.
    pub force_n: Vec<f64>,
}

/// Exponent of force over depth before the first stored state: Hertz' law.
const HERTZ: f64 = 1.5;

impl ForcePath {
    /// Adds a stored state.
    pub fn push(&mut self, depth_mm: f64, force_n: f64) {
        self.depth_mm.push(depth_mm);
        self.force_n.push(force_n);
    }

    /// Takes the last state back.
    pub(crate) fn pop(&mut self) {
        self.depth_mm.pop();
        self.force_n.pop();
    }

    /// The largest force, N, and the depth there, mm; zeros of an empty path.
    #[must_use]
    pub fn deepest(&self) -> (f64, f64) {
        let last = |v: &[f64]| v.last().copied().unwrap_or(0.0);
        (last(&self.force_n), last(&self.depth_mm))
    }

    /// Whether a force lies on the path, N.
    #[must_use]
    pub fn reaches(&self, force_n: f64) -> bool {
        self.deepest().0 >= force_n
    }

    /// Depth at a force, mm: a power law between two states, Hertz' before the first; `None` beyond
    /// the last.
    #[must_use]
    pub fn depth_at(&self, force_n: f64) -> Option<f64> {
        let above = self.force_n.iter().position(|f| *f >= force_n)?;
        let (f1, d1) = (self.force_n[above], self.depth_mm[above]);
        let exponent = match above.checked_sub(1) {
            None => 1.0 / HERTZ,
            Some(k) => (d1 / self.depth_mm[k]).ln() / (f1 / self.force_n[k]).ln(),
        };
        Some(d1 * (force_n / f1).powf(exponent))
    }

    /// Force at a depth, N: a power law between two states, Hertz' before the first, on beyond the last;
    /// not a number without a state.
    #[must_use]
    pub fn force_at(&self, depth_mm: f64) -> f64 {
        let last = match self.depth_mm.len().checked_sub(1) {
            Some(last) if depth_mm > 0.0 => last,
            Some(_) => return 0.0,
            None => return f64::NAN,
        };
        let above = self.depth_mm.iter().position(|d| *d >= depth_mm).unwrap_or(last);
        let (d1, f1) = (self.depth_mm[above], self.force_n[above]);
        let exponent = match above.checked_sub(1) {
            None => HERTZ,
            Some(k) => (f1 / self.force_n[k]).ln() / (d1 / self.depth_mm[k]).ln(),
        };
        f1 * (depth_mm / d1).powf(exponent)
    }

    /// A value that was read at each state, taken to a force along the line between the two states
    /// next to it; `None` beyond the last by more than `beyond` of the force.
    #[must_use]
    pub fn value_at(&self, force_n: f64, values: &[f64], beyond: f64) -> Option<f64> {
        if self.force_n.is_empty() || force_n > (1.0 + beyond) * self.deepest().0 {
            return None;
        }
        if self.force_n.len() == 1 {
            return values.first().copied();
        }
        let above = self.force_n.iter().position(|f| *f >= force_n);
        let above = above.unwrap_or(self.force_n.len() - 1).max(1);
        let (f0, f1) = (self.force_n[above - 1], self.force_n[above]);
        let part = (force_n - f0) / (f1 - f0);
        Some(values[above - 1] + part * (values[above] - values[above - 1]))
    }

    /// `dF/dd` at every state, N/mm: of the parabola through it and its neighbours, the origin
    /// among them; at the last state of the last three.
    #[must_use]
    pub fn stiffness_n_per_mm(&self) -> Vec<f64> {
        let points: Vec<(f64, f64)> = std::iter::once((0.0, 0.0))
            .chain(self.depth_mm.iter().copied().zip(self.force_n.iter().copied()))
            .collect();
        let last = points.len() - 1;
        (1..=last)
            .map(|k| {
                let middle = k.min(last.saturating_sub(1)).max(1);
                match points.get(middle + 1) {
                    Some(&c) => slope([points[middle - 1], points[middle], c], points[k].0),
                    None => points[1].1 / points[1].0,
                }
            })
            .collect()
    }
}

/// Slope at `x` of the parabola through three points.
fn slope(p: [(f64, f64); 3], x: f64) -> f64 {
    (0..3)
        .map(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            p[i].1 * (2.0 * x - p[j].0 - p[k].0) / ((p[i].0 - p[j].0) * (p[i].0 - p[k].0))
        })
        .sum()
}

/// Depths every `step_mm` up to `limit_mm`.
#[must_use]
pub fn steps_mm(step_mm: f64, limit_mm: f64) -> Vec<f64> {
    let count = (limit_mm / step_mm).round() as usize;
    (1..=count).map(|k| step_mm * k as f64).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(law: impl Fn(f64) -> f64) -> ForcePath {
        let mut path = ForcePath::default();
        for d in steps_mm(0.2, 2.0) {
            path.push(d, law(d));
        }
        path
    }

    #[test]
    fn a_power_law_is_inverted_and_read_between_states() {
        let hertz = path(|d| 0.7 * d.powf(1.5));
        for force in [0.01, 0.05, 0.3, 1.9] {
            let depth = hertz.depth_at(force).unwrap();
            assert!((0.7 * depth.powf(1.5) - force).abs() < 1e-12, "{force}: {depth}");
        }
        assert_eq!(hertz.depth_at(3.0), None);
        for depth in [0.05_f64, 0.31, 1.9, 2.2] {
            let force = hertz.force_at(depth);
            assert!((force - 0.7 * depth.powf(1.5)).abs() < 1e-12, "{depth}: {force}");
        }
        assert!(hertz.force_at(0.0) == 0.0 && ForcePath::default().force_at(1.0).is_nan());
        assert!(hertz.reaches(1.9) && !hertz.reaches(2.0));
        // Linear in force is read exactly, between states and a little beyond them.
        let values: Vec<f64> = hertz.force_n.iter().map(|f| 3.0 + 2.0 * f).collect();
        let last = hertz.deepest().0;
        for force in [0.2, 1.0, 1.02 * last] {
            let found = hertz.value_at(force, &values, 0.05).unwrap();
            assert!((found - 3.0 - 2.0 * force).abs() < 1e-12);
        }
        assert_eq!(hertz.value_at(1.1 * last, &values, 0.05), None);
    }

    #[test]
    fn stiffness_is_that_of_the_law() {
        // A parabola exactly, an exponential to the second order of the step.
        let square = path(|d| d * d);
        for (d, k) in square.depth_mm.iter().zip(square.stiffness_n_per_mm()) {
            assert!((k - 2.0 * d).abs() < 1e-12, "{d}: {k}");
        }
        let exponential = path(|d| 0.1 * (1.5 * d).exp_m1());
        let exact = |d: f64| 0.15 * (1.5 * d).exp();
        let found = exponential.stiffness_n_per_mm();
        for (d, k) in exponential.depth_mm.iter().zip(&found).take(9) {
            assert!((k / exact(*d) - 1.0).abs() < 0.02, "{d}: {k}");
        }
    }
}
