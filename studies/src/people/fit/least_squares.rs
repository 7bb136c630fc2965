//! Least squares in the unit box, with few evaluations.
//!
//! Levenberg's and Marquardt's method (Nocedal & Wright 2006, sec. 10.3). The Jacobian comes from
//! differences once, and again when a step fails; between, Broyden's update learns it from the steps
//! themselves. What stands at a bound and would leave stays there.

use faer::linalg::solvers::Solve;
use faer::{Col, Mat, Side};
use serde::Serialize;

/// Distance of difference quotients.
const DIFFERENCE: f64 = 0.05;
/// First damping, of the largest diagonal entry of `J^T J`.
const DAMPING: f64 = 1e-3;
/// The damping at which a search ends.
const DAMPING_MAX: f64 = 1e3;
/// A step that gains less than this share of the cost is the last.
const GAIN_MIN: f64 = 1e-3;
/// A step shorter than this is the last.
const STEP_MIN: f64 = 2e-3;

/// Why a search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Ended {
    /// No step gains anything worth its while.
    Converged,
    /// It may evaluate no more.
    Evaluations,
}

/// A point that was tried.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tried {
    /// Where, each in 0 to 1.
    pub at: Vec<f64>,
    /// Half the sum of the squared residuals.
    pub cost: f64,
}

/// What was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Found {
    /// Where, each in 0 to 1.
    pub at: Vec<f64>,
    /// Residuals there.
    pub residuals: Vec<f64>,
    /// `d residual / d at`, one row a residual, as the search had it last.
    pub jacobian: Vec<Vec<f64>>,
    /// Every evaluation, in order.
    pub tried: Vec<Tried>,
    /// Why it ended.
    pub ended: Ended,
}

/// Half the sum of squares.
pub(crate) fn cost(residuals: &[f64]) -> f64 {
    0.5 * residuals.iter().map(|r| r * r).sum::<f64>()
}

/// Weighted differences at a point of the unit box.
type Residuals<'a, E> = dyn FnMut(&[f64]) -> Result<Vec<f64>, E> + 'a;

/// Minimizes the sum of squares of `residuals` over the unit box, from `start`, with at most `most`
/// evaluations (and those of the Jacobian that is begun). A residual that is not a number makes a
/// point one that is not taken.
///
/// # Errors
/// What `residuals` returns.
pub fn search<E>(start: &[f64], most: usize, residuals: &mut Residuals<'_, E>) -> Result<Found, E> {
    let mut tried: Vec<Tried> = Vec::new();
    let mut evaluate = |at: &[f64]| {
        let found = residuals(at)?;
        tried.push(Tried { at: at.to_vec(), cost: cost(&found) });
        Ok::<_, E>((found, tried.len()))
    };
    let mut at = start.to_vec();
    let (mut here, mut count) = evaluate(&at)?;
    let (mut jacobian, mut fresh) = (Vec::new(), false);
    let mut damping = DAMPING;
    let ended = loop {
        if jacobian.is_empty() {
            let mut better: Option<(Vec<f64>, Vec<f64>)> = None;
            jacobian = differences(&at, &here, &mut |x| {
                let (there, n) = evaluate(x)?;
                count = n;
                let least = better.as_ref().map_or(cost(&here), |(_, r)| cost(r));
                if cost(&there) < least {
                    better = Some((x.to_vec(), there.clone()));
                }
                Ok(there)
            })?;
            // What was tried anyway may be a step.
            if let Some(better) = better {
                (at, here) = better;
            }
            fresh = true;
        }
        if count >= most {
            break Ended::Evaluations;
        }
        let to = step(&at, &here, &jacobian, damping);
        let length = at.iter().zip(&to).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        if length < STEP_MIN {
            if fresh {
                break Ended::Converged;
            }
            jacobian.clear();
            continue;
        }
        let (there, n) = evaluate(&to)?;
        count = n;
        let (before, after) = (cost(&here), cost(&there));
        if after < before {
            learn(&mut jacobian, &at, &here, &to, &there);
            (at, here, fresh) = (to, there, false);
            damping = (0.2 * damping).max(1e-6);
            if before - after < GAIN_MIN * before {
                break Ended::Converged;
            }
        } else if fresh {
            damping *= 10.0;
            if damping > DAMPING_MAX {
                break Ended::Converged;
            }
        } else {
            jacobian.clear();
            damping = damping.max(DAMPING);
        }
    };
    Ok(Found { at, residuals: here, jacobian, tried, ended })
}

/// Difference quotients, inward at the upper bound.
fn differences<E>(
    at: &[f64],
    here: &[f64],
    residuals: &mut Residuals<'_, E>,
) -> Result<Vec<Vec<f64>>, E> {
    let mut rows = vec![vec![0.0; at.len()]; here.len()];
    for k in 0..at.len() {
        let mut beside = at.to_vec();
        let d = if at[k] + DIFFERENCE > 1.0 { -DIFFERENCE } else { DIFFERENCE };
        beside[k] += d;
        for ((row, r), old) in rows.iter_mut().zip(residuals(&beside)?).zip(here) {
            // What cannot be evaluated beside says nothing.
            row[k] = if r.is_finite() { (r - old) / d } else { 0.0 };
        }
    }
    Ok(rows)
}

/// Broyden's update: the least change that explains a step.
fn learn(jacobian: &mut [Vec<f64>], at: &[f64], here: &[f64], to: &[f64], there: &[f64]) {
    let way: Vec<f64> = to.iter().zip(at).map(|(b, a)| b - a).collect();
    let square: f64 = way.iter().map(|d| d * d).sum();
    for ((row, r0), r1) in jacobian.iter_mut().zip(here).zip(there) {
        let told: f64 = row.iter().zip(&way).map(|(j, d)| j * d).sum();
        for (j, d) in row.iter_mut().zip(&way) {
            *j += (r1 - r0 - told) * d / square;
        }
    }
}

/// The damped step within the box: `(J^T J + damping D) d = -J^T r` over the parameters that may
/// move, clipped; one that the step takes through its bound moves there and is held, and the others
/// are asked again.
fn step(at: &[f64], here: &[f64], jacobian: &[Vec<f64>], damping: f64) -> Vec<f64> {
    let n = at.len();
    let slope: Vec<f64> =
        (0..n).map(|k| jacobian.iter().zip(here).map(|(row, r)| row[k] * r).sum()).collect();
    let normal = |i: usize, j: usize| jacobian.iter().map(|row| row[i] * row[j]).sum::<f64>();
    let scale = (0..n).map(|k| normal(k, k)).fold(f64::MIN_POSITIVE, f64::max);
    let mut fixed: Vec<Option<f64>> = vec![None; n];
    loop {
        let free: Vec<usize> = (0..n).filter(|&k| fixed[k].is_none()).collect();
        let matrix: Vec<Vec<f64>> = free
            .iter()
            .map(|&i| {
                let damp = |j: usize| if i == j { damping * scale } else { 0.0 };
                free.iter().map(|&j| normal(i, j) + damp(j)).collect()
            })
            .collect();
        let right: Vec<f64> = free
            .iter()
            .map(|&i| {
                let held = |j: usize| fixed[j].map_or(0.0, |d| normal(i, j) * d);
                -slope[i] - (0..n).map(held).sum::<f64>()
            })
            .collect();
        let moves = solved(&matrix, &right);
        let out = free.iter().zip(&moves).find(|(k, d)| !(0.0..=1.0).contains(&(at[**k] + **d)));
        match out {
            Some((&k, d)) => fixed[k] = Some((at[k] + d).clamp(0.0, 1.0) - at[k]),
            None => {
                for (k, d) in free.into_iter().zip(moves) {
                    fixed[k] = Some(d);
                }
                return at.iter().zip(fixed).map(|(a, d)| a + d.unwrap_or(0.0)).collect();
            }
        }
    }
}

/// `A d = b` of a matrix that is positive definite; no step where it is not.
fn solved(a: &[Vec<f64>], b: &[f64]) -> Vec<f64> {
    let n = b.len();
    let factor = Mat::from_fn(n, n, |i, k| a[i][k]).llt(Side::Lower);
    factor.map_or_else(
        |_| vec![0.0; n],
        |f| f.solve(&Col::from_fn(n, |i| b[i])).iter().copied().collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    fn found(start: &[f64], most: usize, f: impl Fn(&[f64]) -> Vec<f64>) -> Found {
        search(start, most, &mut |x| Ok::<_, Infallible>(f(x))).unwrap()
    }

    #[test]
    fn a_line_is_met_in_one_step() {
        let f = |x: &[f64]| vec![x[0] - 0.3, 2.0 * (x[1] - 0.8), x[0] + x[1] - 1.1];
        let found = found(&[0.9, 0.1], 20, f);
        assert!(cost(&found.residuals) < 1e-6, "{found:?}");
        assert!(found.tried.len() <= 10, "{}", found.tried.len());
    }

    #[test]
    fn what_would_leave_the_box_stops_at_its_bound_and_the_others_go_on() {
        // Without bounds x = (2, -0.5); on x0 = 1 the valley's floor is at x1 = 0.5.
        let f = |x: &[f64]| vec![x[0] - 2.0, 3.0 * (x[0] + x[1] - 1.5)];
        let found = found(&[0.2, 0.2], 40, f);
        assert!((found.at[0] - 1.0).abs() < 1e-9 && (found.at[1] - 0.5).abs() < 1e-2, "{found:?}");
        assert_eq!(found.ended, Ended::Converged);
        assert!(found.tried.iter().all(|t| t.at.iter().all(|v| (0.0..=1.0).contains(v))));
    }

    #[test]
    fn a_curved_valley_is_followed_and_evaluations_are_counted() {
        // Rosenbrock's, with its minimum at (0.5, 0.25).
        let f = |x: &[f64]| vec![10.0 * (x[1] - x[0] * x[0]), 0.5 - x[0]];
        let all = found(&[0.05, 0.9], 200, f);
        assert!((all.at[0] - 0.5).abs() < 0.02 && (all.at[1] - 0.25).abs() < 0.02, "{all:?}");
        let some = found(&[0.05, 0.9], 5, f);
        assert_eq!((some.ended, some.tried.len()), (Ended::Evaluations, 5));
        // The same start takes the same way, bit for bit.
        assert_eq!(all, found(&[0.05, 0.9], 200, f));
    }

    #[test]
    fn a_point_without_a_value_is_not_taken() {
        let f = |x: &[f64]| vec![if x[0] > 0.6 { f64::NAN } else { x[0] - 0.9 }];
        let found = found(&[0.1], 60, f);
        assert!(found.at[0] <= 0.6 && found.at[0] > 0.4, "{found:?}");
    }
}
