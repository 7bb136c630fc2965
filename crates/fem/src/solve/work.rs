//! Work of a moving indenter, from the equilibria on its path.

use super::loading::MovingIndenter;
use serde::{Deserialize, Serialize};

/// Exponent of force over way where only one equilibrium is known: a ball's (Hertz).
const DEFAULT_EXPONENT: f64 = 1.5;

/// Force along the path so far.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Work {
    /// Equilibria of a straight path by rising load fraction, the first at rest.
    straight: Vec<Found>,
    /// Displacement and force at the last equilibrium of any other path.
    last: ([f64; 3], [f64; 3]),
    /// Trapezoidal sum of any other path, mJ.
    sum_mj: f64,
    /// Its largest amount so far.
    pub largest_mj: f64,
    /// Work of pressure, mJ.
    pub pressure_mj: f64,
}

/// An equilibrium of a straight path.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Found {
    fraction: f64,
    /// Force along the travel, N.
    force_n: f64,
    stored_mj: f64,
    /// Whether force and energy are another body's, scaled to this one's.
    is_scaled: bool,
}

/// A part of a straight path whose energy and work part the most.
#[derive(Clone, Copy, Debug)]
pub(super) struct Doubtful {
    /// Load fraction of an equilibrium that mends it: of an end that is scaled, else its middle.
    pub fraction: f64,
    /// What energy and work of the whole path part by, over the work.
    pub relative: f64,
}

impl Work {
    /// Takes the contact force (N, on the body) and the stored energy of an equilibrium.
    pub(super) fn add(
        &mut self,
        indenter: &MovingIndenter,
        fraction: f64,
        force: [f64; 3],
        stored_mj: f64,
    ) {
        if let Some((_, direction)) = indenter.straight_travel() {
            if self.straight.is_empty() {
                self.straight.push(Found::default());
            }
            let force_n = (0..3).map(|i| force[i] * direction[i]).sum();
            return self.insert(Found { fraction, force_n, stored_mj, is_scaled: false });
        }
        let offset = indenter.offset_mm(fraction);
        let (from, before) = self.last;
        self.sum_mj +=
            (0..3).map(|i| 0.5 * (before[i] + force[i]) * (offset[i] - from[i])).sum::<f64>();
        self.largest_mj = self.largest_mj.max(self.sum_mj.abs());
        self.last = (offset, force);
    }

    /// Puts an equilibrium of a straight path in its place. Where another body's stood, those beside
    /// it are scaled by what it was off, linearly to nothing at this body's next equilibria.
    fn insert(&mut self, own: Found) {
        let at = self.straight.partition_point(|f| f.fraction < own.fraction);
        let Some(&scaled) = self.straight.get(at).filter(|f| f.fraction <= own.fraction) else {
            return self.straight.insert(at, own);
        };
        self.straight[at] = own;
        let off = [own.force_n / scaled.force_n - 1.0, own.stored_mj / scaled.stored_mj - 1.0];
        let is_own = |f: &Found| !f.is_scaled;
        let first = self.straight[..at].iter().rposition(is_own).unwrap_or(0);
        let last = self.straight[at + 1..].iter().position(is_own).map_or(at, |n| at + 1 + n);
        for k in (first + 1..last).filter(|k| *k != at && off.iter().all(|o| o.is_finite())) {
            let end = if k < at { first } else { last };
            let (x, end_x) = (self.straight[k].fraction, self.straight[end].fraction);
            // At rest nothing is known to be right.
            let part = if end == 0 { 1.0 } else { (x - end_x) / (own.fraction - end_x) };
            self.straight[k].force_n *= 1.0 + part * off[0];
            self.straight[k].stored_mj *= 1.0 + part * off[1];
        }
    }

    /// Work, mJ. On a straight path the force history is integrated with powers of the way that
    /// change smoothly from equilibrium to equilibrium, which is exact for Hertz-like contact.
    pub(super) fn total_mj(&self, indenter: &MovingIndenter) -> f64 {
        match indenter.straight_travel() {
            Some((length, _)) => self.pieces().iter().sum::<f64>() * length,
            None => self.sum_mj,
        }
    }

    /// Takes the course of force and energy between the last two equilibria of a straight path from
    /// another body's, scaled to this one's at the ends.
    pub(super) fn take_course(&mut self, guide: &Self) {
        let [.., from, to] = self.straight[..] else { return };
        let at = self.straight.len() - 1;
        let same =
            |f: Found| guide.straight.iter().find(|g| g.fraction.total_cmp(&f.fraction).is_eq());
        let (Some(first), Some(last)) = (same(from), same(to)) else { return };
        let ratio = |own: f64, other: f64| if other > 0.0 { own / other } else { f64::NAN };
        let end = [ratio(to.force_n, last.force_n), ratio(to.stored_mj, last.stored_mj)];
        let start = [ratio(from.force_n, first.force_n), ratio(from.stored_mj, first.stored_mj)];
        if end.iter().any(|r| r.is_nan()) {
            return;
        }
        let between = guide
            .straight
            .iter()
            .filter(|g| g.fraction > from.fraction && g.fraction < to.fraction)
            .map(|g| {
                let part = (g.fraction - from.fraction) / (to.fraction - from.fraction);
                let [force, stored] = [0, 1].map(|k| {
                    // At rest there is no ratio.
                    let near = if start[k].is_nan() { end[k] } else { start[k] };
                    near + part * (end[k] - near)
                });
                let (force_n, stored_mj) = (force * g.force_n, stored * g.stored_mj);
                Found { fraction: g.fraction, force_n, stored_mj, is_scaled: true }
            })
            .collect::<Vec<_>>();
        self.straight.splice(at..at, between);
    }

    /// The part beyond the load fraction `from` in which energy and work part the most; none of a
    /// path that is not straight or has not come so far.
    pub(super) fn doubtful(&self, indenter: &MovingIndenter, from: f64) -> Option<Doubtful> {
        let (length, _) = indenter.straight_travel()?;
        let work: Vec<f64> = self.pieces().iter().map(|w| w * length).collect();
        let total: f64 = work.iter().sum();
        let stored = self.straight.last()?.stored_mj;
        let miss = |i: usize| {
            (self.straight[i + 1].stored_mj - self.straight[i].stored_mj - work[i]).abs()
        };
        let (a, b) = (0..work.len())
            .filter(|&i| self.straight[i].fraction >= from)
            .max_by(|&i, &j| miss(i).total_cmp(&miss(j)))
            .map(|i| (self.straight[i], self.straight[i + 1]))?;
        let scaled = [b, a].into_iter().find(|f| f.is_scaled);
        let fraction = scaled.map_or(0.5 * (a.fraction + b.fraction), |f| f.fraction);
        Some(Doubtful { fraction, relative: ((stored - total) / total).abs() })
    }

    fn pieces(&self) -> Vec<f64> {
        let points: Vec<(f64, f64)> =
            self.straight.iter().map(|f| (f.fraction, f.force_n)).collect();
        pieces(&points)
    }
}

/// Four Gauss points and weights on [-1, 1].
const GAUSS_4: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_9),
    (-0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_9),
];

/// Integrals between `(x, f)` points, the first of them `(0, 0)`: `ln f` is a cubic
/// polynomial of `ln x` between points, with the slope of the parabola through three of them, and
/// linear before the first; trapezia where a force is not positive.
fn pieces(points: &[(f64, f64)]) -> Vec<f64> {
    let pushed = points.iter().skip(1).take_while(|p| p.1 > 0.0).count();
    let logs: Vec<(f64, f64)> =
        points[1.min(points.len())..][..pushed].iter().map(|(x, f)| (x.ln(), f.ln())).collect();
    let slopes = slopes(&logs);
    let trapezium = |a: (f64, f64), b: (f64, f64)| 0.5 * (b.0 - a.0) * (a.1 + b.1);
    let mut out = match (points.get(1), slopes.first()) {
        (Some(&(x, f)), Some(m)) if *m > -1.0 => vec![x * f / (m + 1.0)],
        (Some(&b), _) => vec![trapezium(points[0], b)],
        (None, _) => Vec::new(),
    };
    for i in 2..points.len() {
        let (a, b) = (points[i - 1], points[i]);
        if i > pushed {
            out.push(trapezium(a, b));
            continue;
        }
        let ((s, p), (t, q)) = (logs[i - 2], logs[i - 1]);
        let (m, n) = ((t - s) * slopes[i - 2], (t - s) * slopes[i - 1]);
        let mut sum = 0.0;
        for (at, weight) in GAUSS_4 {
            let x = 0.5 * ((1.0 - at) * a.0 + (1.0 + at) * b.0);
            let r = (x.ln() - s) / (t - s);
            let rest = 1.0 - r;
            let value = rest * rest * ((1.0 + 2.0 * r) * p + r * m)
                + r * r * ((3.0 - 2.0 * r) * q - rest * n);
            sum += 0.5 * (b.0 - a.0) * weight * value.exp();
        }
        out.push(sum);
    }
    out
}

/// Slope at each of some points of the parabola through it and its neighbours.
fn slopes(points: &[(f64, f64)]) -> Vec<f64> {
    let secant = |i: usize| (points[i + 1].1 - points[i].1) / (points[i + 1].0 - points[i].0);
    let last = points.len().saturating_sub(1);
    (0..points.len())
        .map(|i| {
            match last {
                0 => return DEFAULT_EXPONENT,
                1 => return secant(0),
                _ => {}
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
    use papilla_sdf::{Placement, Sphere};
    use std::sync::Arc;

    fn straight() -> MovingIndenter {
        let start = Placement::turned(0.0, 0.0, 0.0, [0.0; 3]);
        MovingIndenter::straight(Arc::new(Sphere { radius_mm: 1.0 }), start, [0.0, 0.0, 1.0])
    }

    fn integral(points: &[(f64, f64)]) -> f64 {
        pieces(points).iter().sum()
    }

    /// Where a plate comes down beside a dot the force has a kink: the part that holds it is the
    /// doubtful one, and equilibria in its middle, again and again, mend the work.
    #[test]
    fn work_is_mended_where_the_force_has_a_kink() {
        let force = |x: f64| x.powf(1.5) + 8.0 * (x - 0.5).max(0.0).powf(1.2);
        let energy = |x: f64| x.powf(2.5) / 2.5 + 8.0 * (x - 0.5).max(0.0).powf(2.2) / 2.2;
        let straight = straight();
        let mut work = Work::default();
        for x in [0.1, 0.25, 0.6, 1.0] {
            work.add(&straight, x, [0.0, 0.0, force(x)], energy(x));
        }
        let before = work.doubtful(&straight, 0.0).unwrap();
        assert!(before.relative > 5e-3, "{before:?}");
        for _ in 0..6 {
            let x = work.doubtful(&straight, 0.0).unwrap().fraction;
            work.add(&straight, x, [0.0, 0.0, force(x)], energy(x));
        }
        let after = work.doubtful(&straight, 0.0).unwrap();
        assert!(after.relative < 0.1 * before.relative, "{before:?} {after:?}");
        assert!((work.total_mj(&straight) / energy(1.0) - 1.0).abs() < 1e-3);
        assert!(work.doubtful(&straight, 1.0).is_none());
    }

    /// What a body's force is over a guide's at two equilibria it is in between, linear in the way.
    #[test]
    fn a_guides_course_gives_the_work_between_two_equilibria() {
        let force = |x: f64| x.powf(1.5) * (1.2 * x).exp();
        let times = |x: f64| 1.03 - 0.02 * (x - 0.5).max(0.0);
        let straight = straight();
        let way = [0.05, 0.12, 0.25, 0.5, 0.62, 0.75, 0.87, 1.0];
        let along = |scale: &dyn Fn(f64) -> f64| {
            let mut work = Work::default();
            for x in way {
                work.add(&straight, x, [0.0, 0.0, scale(x) * force(x)], scale(x) * x);
            }
            work
        };
        let (guide, due) = (along(&|_| 1.0), along(&times));
        let mut own = Work::default();
        for x in [0.5, 1.0] {
            own.add(&straight, x, [0.0, 0.0, times(x) * force(x)], times(x) * x);
            own.take_course(&guide);
        }
        let (found, due) = (own.total_mj(&straight), due.total_mj(&straight));
        assert!((found / due - 1.0).abs() < 1e-12, "{found} {due}");
        assert_eq!(own.straight.len(), way.len() + 1);
    }

    /// A guide that errs most at first touch: its points give way to this body's own.
    #[test]
    fn a_guides_course_that_is_off_is_mended_where_the_guide_was() {
        let straight = straight();
        let off = |x: f64| 1.0 + 0.3 * (-8.0 * x).exp();
        let add = |work: &mut Work, x: f64, off: f64| {
            work.add(&straight, x, [0.0, 0.0, off * x.powf(1.5)], off * x.powf(2.5) / 2.5);
        };
        let (mut guide, mut own) = (Work::default(), Work::default());
        [0.03, 0.08, 0.16, 0.25].into_iter().for_each(|x| add(&mut guide, x, off(x)));
        add(&mut own, 0.25, 1.0);
        own.take_course(&guide);
        let before = own.doubtful(&straight, 0.0).unwrap();
        for _ in 0..3 {
            let fraction = own.doubtful(&straight, 0.0).unwrap().fraction;
            add(&mut own, fraction, 1.0);
        }
        let after = own.doubtful(&straight, 0.0).unwrap();
        assert!(after.relative < 0.1 * before.relative, "{before:?} {after:?}");
    }

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
        assert!((integral(&points) - 1.0 / (DEFAULT_EXPONENT + 1.0) - 0.5).abs() < 1e-12);
        assert!(integral(&[]).abs() < f64::MIN_POSITIVE);
    }
}
