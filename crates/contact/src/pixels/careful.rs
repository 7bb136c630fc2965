//! Careful rounds: what follows where the usual rounds have not settled.
//!
//! A round takes forces `f` of the vertices and the pressure `p` at which gaps are linearised, and
//! answers both anew. The usual rounds take all of the new pressure, and forget where they were
//! best. Careful ones go on from the best round so far: by a share of its change of `f` and `p`,
//! and by what Anderson's method (J. ACM 12, 1965) makes of the last rounds. A round that is worse
//! than the best is taken back, and the share becomes smaller.

use super::change::Change;
use super::smooth::{TERMS, solve};

/// Rounds after the best one that are no better, after which the next one counts as the best, and its
/// share: a jump of the answers is left behind.
const STUCK: i32 = 6;
const ANEW: f32 = 0.5;
/// Rounds beside the best that Anderson's method goes by.
const DEPTH: usize = 3;
/// Share of the change at first, the least one, and what multiplies it after a round that is better
/// than the best, or worse.
const SHARE: f32 = 0.3;
const SHARE_MIN: f32 = 0.02;
const BETTER: f32 = 1.3;
const WORSE: f32 = 0.5;
/// Most that Anderson's method goes on, over the residual.
const STEP_MAX: f32 = 4.0;
/// What keeps its weights small where rounds hardly differ, as a part of the squares.
const KEEP: f64 = 1e-3;

/// Where a round started, and what it answered.
#[derive(Debug)]
struct Tried {
    /// By active vertex, x y z, N: forces, and by how much they were answered otherwise.
    force: Vec<f32>,
    residual: Vec<f32>,
    /// By pixel that is solved for, MPa.
    pressure: Vec<f32>,
    answer: Vec<f32>,
}

/// The careful rounds of a frame.
#[derive(Debug)]
pub(super) struct Careful {
    best: Tried,
    now: Tried,
    /// Forces and residuals of earlier rounds, and how many there are.
    others: [[Vec<f32>; 2]; DEPTH],
    count: usize,
    best_change: f32,
    share: f32,
    /// Rounds since the best one.
    worse: i32,
}

impl Careful {
    pub(super) fn new(vertices: usize, pixels: usize) -> Self {
        let forces = || Vec::with_capacity(3 * vertices);
        let pressures = || Vec::with_capacity(pixels);
        let tried = || Tried {
            force: forces(),
            residual: forces(),
            pressure: pressures(),
            answer: pressures(),
        };
        Self {
            best: tried(),
            now: tried(),
            others: std::array::from_fn(|_| [forces(), forces()]),
            count: 0,
            best_change: f32::INFINITY,
            share: SHARE,
            worse: 0,
        }
    }

    /// Begins with a round that starts from this pressure.
    pub(super) fn begin(&mut self, pressure: &[f32]) {
        (self.count, self.best_change, self.share, self.worse) = (0, f32::INFINITY, SHARE, 0);
        copy(&mut self.now.pressure, pressure);
    }

    /// Takes note of a round from the forces `start` of the `active` vertices, and of its answers;
    /// returns the change of the forces over their sum.
    pub(super) fn note(
        &mut self,
        active: &[u32],
        [start, found]: [&[Vec<f32>; 3]; 2],
        pressure: &[f32],
    ) -> f32 {
        let Self { now, best, others, count, .. } = self;
        now.force.clear();
        now.residual.clear();
        let mut change = Change::default();
        for vertex in active.iter().map(|vertex| *vertex as usize) {
            for (start, found) in start.iter().zip(found) {
                now.force.push(start[vertex]);
                now.residual.push(change.count(start[vertex], found[vertex]));
            }
        }
        copy(&mut now.answer, pressure);
        let change = change.part();
        let is_better = change < self.best_change;
        if is_better {
            std::mem::swap(best, now);
        }
        if self.best_change < f32::INFINITY {
            let [force, residual] = &mut others[*count % DEPTH];
            copy(force, &now.force);
            copy(residual, &now.residual);
            *count += 1;
        }
        if is_better {
            if self.best_change < f32::INFINITY {
                self.share = (BETTER * self.share).min(1.0);
            }
            (self.best_change, self.worse) = (change, 0);
        } else {
            self.share = (WORSE * self.share).max(SHARE_MIN);
            self.worse += 1;
        }
        if self.worse == STUCK {
            (self.count, self.best_change, self.share, self.worse) = (0, f32::INFINITY, ANEW, 0);
        }
        change
    }

    /// Where the next round starts.
    pub(super) fn go_on(
        &mut self,
        active: &[u32],
        force_n: &mut [Vec<f32>; 3],
        pressure: &mut [f32],
    ) {
        let weights = self.weights();
        let Self { now, best, others, share, .. } = self;
        for (i, vertex) in active.iter().enumerate() {
            for (axis, force_n) in force_n.iter_mut().enumerate() {
                let i = 3 * i + axis;
                let (mut force, mut residual) = (best.force[i], best.residual[i]);
                for (weight, [f, r]) in weights.iter().zip(&*others) {
                    if *weight != 0.0 {
                        force += weight * (f[i] - best.force[i]);
                        residual += weight * (r[i] - best.residual[i]);
                    }
                }
                force_n[*vertex as usize] = force + *share * residual;
            }
        }
        now.pressure.clear();
        let ways = best.pressure.iter().zip(&best.answer);
        now.pressure.extend(ways.map(|(from, to)| from + *share * (to - from)));
        pressure.copy_from_slice(&now.pressure);
    }

    /// Weights of the differences of earlier rounds from the best, with which its residual would be
    /// least if answers were linear.
    fn weights(&self) -> [f32; DEPTH] {
        let Self { best, others, count, worse, .. } = self;
        let kept = (*count).min(DEPTH);
        let mut matrix = [[0.0f64; TERMS]; TERMS];
        let mut due = [0.0f64; TERMS];
        for (i, row) in matrix.iter_mut().enumerate() {
            row[i] = 1.0;
        }
        let square: f64 = best.residual.iter().map(|r| f64::from(*r).powi(2)).sum();
        for i in 0..kept {
            let by = |i: usize, at: usize| f64::from(others[i][1][at] - best.residual[at]);
            let all = 0..best.residual.len();
            for k in 0..=i {
                let sum: f64 = all.clone().map(|at| by(i, at) * by(k, at)).sum();
                (matrix[i][k], matrix[k][i]) = (sum, sum);
            }
            matrix[i][i] += KEEP * (matrix[i][i] + square) + 1e-9;
            due[i] = -all.map(|at| by(i, at) * f64::from(best.residual[at])).sum::<f64>();
        }
        let Some(found) = solve(matrix, due) else { return [0.0; DEPTH] };
        let mut weights: [f32; DEPTH] =
            std::array::from_fn(|i| if i < kept { found[i] as f32 } else { 0.0 });
        let step: f64 = (0..best.force.len())
            .map(|at| {
                let by = |i: usize| f64::from(weights[i] * (others[i][0][at] - best.force[at]));
                (0..kept).map(by).sum::<f64>().powi(2)
            })
            .sum();
        let least = (f64::from(STEP_MAX).powi(2) * square / step.max(1e-30)).sqrt().min(1.0);
        let part = least as f32 * WORSE.powi(*worse);
        weights.iter_mut().for_each(|weight| *weight *= part);
        weights
    }
}

fn copy(to: &mut Vec<f32>, from: &[f32]) {
    to.clear();
    to.extend_from_slice(from);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounds that would go to and fro ever wider, beside others that have a long way to go, arrive;
    /// vertices that are not active stay as they are.
    #[test]
    fn careful_rounds_settle_where_plain_ones_run_away() {
        let (factors, due) = ([-6.0f32, 0.9, 0.5], [1.0f32, 2.0, 3.0]);
        let answer = |f: f32, axis: usize| due[axis] + factors[axis] * (f - due[axis]);
        let mut force: [Vec<f32>; 3] = std::array::from_fn(|_| vec![7.0, 0.5]);
        let (mut plain, mut pressure) = (force.clone(), [0.0f32; 2]);
        let mut careful = Careful::new(2, 2);
        careful.begin(&pressure);
        let mut change = f32::INFINITY;
        for round in 0..40 {
            if round > 0 {
                careful.go_on(&[1], &mut force, &mut pressure);
            }
            let mut found = force.clone();
            for axis in 0..3 {
                found[axis][1] = answer(force[axis][1], axis);
                plain[axis][1] = answer(plain[axis][1], axis);
            }
            // Of pressure, too, the whole answer would be too much.
            pressure = pressure.map(|p| 1.0 - 3.0 * (p - 1.0));
            change = careful.note(&[1], [&force, &found], &pressure);
            if change < 1e-3 {
                break;
            }
        }
        assert!(change < 1e-3, "{change}");
        assert!(!(plain[0][1].abs() < 1e6), "{plain:?}");
        for axis in 0..3 {
            assert!((force[axis][1] - due[axis]).abs() < 0.05, "{force:?}");
            assert_eq!(force[axis][0].to_bits(), 7.0f32.to_bits());
        }
    }

    /// A jump of the answers, over which no small step leads, does not hold rounds for ever.
    #[test]
    fn rounds_leave_a_jump_behind() {
        // Beyond 1.0 the way on is as long as to 3.0; before it, rounds are told that they are nearly there.
        let answer = |f: f32| if f < 1.0 { f + 0.1 } else { f + 0.5 * (3.0 - f) };
        let mut force: [Vec<f32>; 3] = [vec![0.9], vec![0.0], vec![0.0]];
        let mut careful = Careful::new(1, 0);
        careful.begin(&[]);
        let mut change = f32::INFINITY;
        for round in 0..60 {
            if round > 0 {
                careful.go_on(&[0], &mut force, &mut []);
            }
            let found = [vec![answer(force[0][0])], vec![0.0], vec![0.0]];
            change = careful.note(&[0], [&force, &found], &[]);
            if change < 0.03 {
                break;
            }
        }
        assert!(change < 0.03, "{change}");
        assert!((force[0][0] - 3.0).abs() < 0.3, "{force:?}");
    }
}
