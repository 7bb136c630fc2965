//! Solves for tangential forces below Coulomb's bound, for given normal forces.
//!
//! Given the tangential compliance `M`, the slip `s` without tangential forces, and the bounds
//! `b_i`, it finds `q_i` with `|q_i| <= b_i`. The slip is `w = M q + s`. A point slips only if its
//! force is at the bound, and then against the force. This is `q_i = P_i(q_i - r w_i)` for any `r >
//! 0`, with the projection `P_i` onto the disc of radius `b_i`; it minimises `q M q / 2 + s q` over
//! the discs. The method is projected gradients with Nesterov's acceleration, restarted when the
//! direction turns back (O'Donoghue & Candes, *Foundations of Computational Mathematics* 15, 2015).
//! Each point has a step length of its own, from the sums of absolute values along the rows of `M`,
//! which bound `M` from above.

use crate::kernels::multiply;

/// Compliance between points along two tangents each: blocks `[11, 12, 21, 22]` whose rows are
/// `stride` apart.
#[derive(Clone, Copy)]
pub(crate) struct Tangential<'a> {
    pub blocks: &'a [Vec<f32>; 4],
    pub stride: usize,
    /// Step of each point, N/mm.
    pub step: &'a [f32],
}

/// How an iteration ended.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Effort {
    /// Products with the compliance.
    pub products: u32,
    /// Largest violation left: slip of a point whose force could still resist it, mm.
    pub violation_mm: f32,
}

/// Memory of the iteration for up to a fixed number of points.
#[derive(Clone, Debug)]
pub(crate) struct DiscSolver {
    ahead: [Vec<f32>; 2],
    slip: [Vec<f32>; 2],
    part: Vec<f32>,
}

impl DiscSolver {
    pub(crate) fn new(points: usize) -> Self {
        let zeros = || vec![0.0; points];
        Self { ahead: [zeros(), zeros()], slip: [zeros(), zeros()], part: zeros() }
    }

    /// Improves `q` (N) from what it holds, for slips `s` (mm) without it and bounds (N), until no
    /// point violates its condition by more than `tolerance_mm`, or `products_max` are done.
    pub(crate) fn solve(
        &mut self,
        m: Tangential<'_>,
        s: [&[f32]; 2],
        bound: &[f32],
        q: [&mut [f32]; 2],
        (tolerance_mm, products_max): (f32, u32),
    ) -> Effort {
        let n = bound.len();
        let [q1, q2] = q;
        for i in 0..n {
            [q1[i], q2[i]] = to_disc([q1[i], q2[i]], bound[i]);
            [self.ahead[0][i], self.ahead[1][i]] = [q1[i], q2[i]];
        }
        let mut effort = Effort::default();
        let mut momentum = 1.0f32;
        while effort.products < products_max {
            self.slip(m, s, n);
            effort.products += 1;
            effort.violation_mm = 0.0;
            let next = 0.5 * (1.0 + (1.0 + 4.0 * momentum * momentum).sqrt());
            let on = (momentum - 1.0) / next;
            let mut turned_back = 0.0f32;
            let Self { ahead: [a1, a2], slip: [w1, w2], .. } = self;
            for i in 0..n {
                let (step, at) = (m.step[i], [a1[i], a2[i]]);
                let new = to_disc([at[0] - step * w1[i], at[1] - step * w2[i]], bound[i]);
                let by = [new[0] - at[0], new[1] - at[1]];
                let violation = size(by) / step;
                // NaN must not hide behind a maximum.
                if !(violation <= effort.violation_mm) {
                    effort.violation_mm = violation;
                }
                let gone = [new[0] - q1[i], new[1] - q2[i]];
                turned_back -= (by[0] * gone[0] + by[1] * gone[1]) / step;
                [q1[i], q2[i]] = new;
                [a1[i], a2[i]] = [new[0] + on * gone[0], new[1] + on * gone[1]];
            }
            if effort.violation_mm <= tolerance_mm || !effort.violation_mm.is_finite() {
                break;
            }
            momentum = next;
            if turned_back > 0.0 {
                momentum = 1.0;
                a1[..n].copy_from_slice(&q1[..n]);
                a2[..n].copy_from_slice(&q2[..n]);
            }
        }
        effort
    }

    /// `w = M ahead + s`.
    fn slip(&mut self, m: Tangential<'_>, s: [&[f32]; 2], n: usize) {
        let Self { ahead, slip, part } = self;
        let part = &mut part[..n];
        for (a, slip) in slip.iter_mut().enumerate() {
            slip[..n].copy_from_slice(&s[a][..n]);
            for (b, ahead) in ahead.iter().enumerate() {
                multiply(&m.blocks[2 * a + b], m.stride, &ahead[..n], part);
                slip.iter_mut().zip(&*part).for_each(|(w, p)| *w += p);
            }
        }
    }
}

/// The nearest place in a disc round 0.
pub(crate) fn to_disc(q: [f32; 2], radius: f32) -> [f32; 2] {
    let size = size(q);
    if size <= radius {
        return q;
    }
    if !(radius > 0.0) {
        return [0.0; 2];
    }
    q.map(|v| v * (radius / size))
}

pub(crate) fn size([x, y]: [f32; 2]) -> f32 {
    (x * x + y * y).sqrt()
}

/// Steps of the points: one over the sum of absolute values along the rows of each, or over `least`
/// (mm/N) where that is more: without compliance the least slip would ask for any force.
pub(crate) fn steps(blocks: &[Vec<f32>; 4], stride: usize, least: f32, step: &mut [f32]) {
    let n = step.len();
    for (i, step) in step.iter_mut().enumerate() {
        let of = |block: &[f32]| block[i * stride..][..n].iter().map(|v| v.abs()).sum::<f32>();
        let sum = (of(&blocks[0]) + of(&blocks[1])).max(of(&blocks[2]) + of(&blocks[3]));
        *step = 1.0 / sum.max(least);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Points on an incompressible half-space (Cerruti), random slips and bounds.
    fn problem(seed: u64, n: usize) -> ([Vec<f32>; 4], [Vec<f32>; 2], Vec<f32>) {
        let mut random = fastrand::Rng::with_seed(seed);
        let at: Vec<[f32; 2]> = (0..n).map(|_| [4.0 * random.f32(), 4.0 * random.f32()]).collect();
        let mut m: [Vec<f32>; 4] = std::array::from_fn(|_| vec![0.0; n * n]);
        for i in 0..n {
            for k in 0..n {
                let d = [at[i][0] - at[k][0], at[i][1] - at[k][1]];
                let r = (d[0] * d[0] + d[1] * d[1] + 0.09).sqrt();
                for (pair, block) in m.iter_mut().enumerate() {
                    let (a, b) = (pair / 2, pair % 2);
                    let same = if a == b { 1.0 } else { 0.0 };
                    block[i * n + k] = same / r + d[a] * d[b] / r.powi(3);
                }
            }
        }
        let slips = std::array::from_fn(|_| (0..n).map(|_| random.f32() - 0.4).collect());
        (m, slips, (0..n).map(|_| 0.2 * random.f32()).collect())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        /// No force beyond its bound; what slips does so against a force at its bound.
        #[test]
        fn coulombs_law_holds_at_random_points(seed in any::<u64>(), n in 1usize..60) {
            let (m, s, bound) = problem(seed, n);
            let mut step = vec![0.0; n];
            steps(&m, n, 1e-6, &mut step);
            let mut q = [vec![0.0; n], vec![0.0; n]];
            let [q1, q2] = &mut q;
            let matrix = Tangential { blocks: &m, stride: n, step: &step };
            let effort = DiscSolver::new(n).solve(
                matrix, [&s[0], &s[1]], &bound, [q1, q2], (1e-5, 4000));
            prop_assert!(effort.violation_mm <= 1e-5, "{effort:?}");
            for i in 0..n {
                let slip = |a: usize| f64::from(s[a][i]) + (0..n).map(|k| {
                    f64::from(m[2 * a][i * n + k]) * f64::from(q[0][k])
                        + f64::from(m[2 * a + 1][i * n + k]) * f64::from(q[1][k])
                }).sum::<f64>();
                let w = [slip(0), slip(1)];
                let [x, y] = [f64::from(q[0][i]), f64::from(q[1][i])];
                let (size, most) = (x.hypot(y), f64::from(bound[i]));
                prop_assert!(size <= most * (1.0 + 1e-6), "{size} beyond {most}");
                let sticks = w[0].hypot(w[1]) < 2e-4;
                let resists = (x * w[0] + y * w[1]) < -0.99 * most * w[0].hypot(w[1]);
                prop_assert!(sticks || resists, "{i}: {w:?} against {x} {y} of {most}");
            }
        }
    }

    #[test]
    fn what_makes_no_sense_ends() {
        let m: [Vec<f32>; 4] = std::array::from_fn(|_| vec![f32::NAN, 0.0, 0.0, 1.0]);
        let matrix = Tangential { blocks: &m, stride: 2, step: &[1.0, f32::NAN] };
        let (mut a, mut b) = ([1.0, f32::NAN], [0.0; 2]);
        let effort = DiscSolver::new(2).solve(
            matrix,
            [&[1.0, f32::INFINITY], &[0.0, 0.0]],
            &[1.0, 1.0],
            [&mut a, &mut b],
            (1e-6, 100),
        );
        assert!(effort.products <= 100 && effort.violation_mm.is_nan());
    }
}
