//! Small least-squares problems: dense normal equations, and Levenberg's method over them.

use faer::linalg::solvers::Solve;
use faer::{Col, Mat, Side};

/// Solves `A x = b` for a symmetric positive definite `A` (row-major); `None` if it is not.
pub(crate) fn solve(a: &[f64], b: &[f64]) -> Option<Vec<f64>> {
    let n = b.len();
    let factor = Mat::from_fn(n, n, |i, k| a[i * n + k]).llt(Side::Lower).ok()?;
    let x = factor.solve(&Col::from_fn(n, |i| b[i]));
    x.iter().all(|v| v.is_finite()).then(|| x.iter().copied().collect())
}

/// One parameter: where it begins, where it may go, and a step over which residuals change evenly.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Parameter {
    pub start: f64,
    pub range: [f64; 2],
    pub step: f64,
}

/// Iterations at most.
const ITERATIONS: usize = 60;
/// Relative decrease of the sum of squares below which it is done.
const DONE: f64 = 1e-10;
/// Beyond it a residual counts by its size and no longer by its square (Huber), mm: what the
/// template cannot follow, such as a nail's edge, does not pull at it.
const FAR_MM: f64 = 1.0;

/// Parameters that make the residuals (mm) small: Levenberg's method, derivatives by forward
/// differences, values kept within their ranges.
pub(crate) fn minimise(
    parameters: &[Parameter],
    residuals: &dyn Fn(&[f64]) -> Vec<f64>,
) -> Vec<f64> {
    let n = parameters.len();
    let weigh = |r: &[f64]| -> f64 {
        let one = |r: &f64| {
            let size = r.abs();
            if size <= FAR_MM { size * size } else { FAR_MM * (2.0 * size - FAR_MM) }
        };
        r.iter().map(one).sum()
    };
    let mut x: Vec<f64> = parameters.iter().map(|p| p.start).collect();
    let mut r = residuals(&x);
    let (mut cost, mut damping) = (weigh(&r), 1e-3);
    for _ in 0..ITERATIONS {
        let columns: Vec<Vec<f64>> = (0..n)
            .map(|k| {
                let mut moved = x.clone();
                moved[k] += parameters[k].step;
                let slope = |(a, b): (f64, &f64)| (a - b) / parameters[k].step;
                residuals(&moved).into_iter().zip(&r).map(slope).collect()
            })
            .collect();
        let weight: Vec<f64> = r.iter().map(|r| (FAR_MM / r.abs()).min(1.0)).collect();
        let product = |a: &[f64], b: &[f64]| -> f64 {
            a.iter().zip(b).zip(&weight).map(|((a, b), w)| w * a * b).sum()
        };
        let slope: Vec<f64> = columns.iter().map(|c| -product(c, &r)).collect();
        let square: Vec<f64> =
            (0..n * n).map(|i| product(&columns[i / n], &columns[i % n])).collect();
        let mut better = None;
        while better.is_none() && damping < 1e9 {
            let mut damped = square.clone();
            for k in 0..n {
                // A parameter that nothing depends on stays where it is.
                damped[k * n + k] += damping * square[k * n + k] + 1e-9;
            }
            if let Some(by) = solve(&damped, &slope) {
                let to: Vec<f64> = (0..n)
                    .map(|k| (x[k] + by[k]).clamp(parameters[k].range[0], parameters[k].range[1]))
                    .collect();
                let found = residuals(&to);
                let new = weigh(&found);
                if new < cost {
                    better = Some((to, found, new));
                    damping = (0.2 * damping).max(1e-9);
                    break;
                }
            }
            damping *= 5.0;
        }
        let Some((to, found, new)) = better else { break };
        let gained = cost - new;
        (x, r, cost) = (to, found, new);
        if gained < DONE * cost {
            break;
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_system_is_solved_and_an_indefinite_one_is_not() {
        let x = solve(&[4.0, 2.0, 2.0, 3.0], &[10.0, 8.0]).unwrap();
        assert!((x[0] - 1.75).abs() < 1e-14 && (x[1] - 1.5).abs() < 1e-14, "{x:?}");
        assert!(solve(&[1.0, 2.0, 2.0, 1.0], &[1.0, 1.0]).is_none());
    }

    #[test]
    fn a_circle_is_found_and_an_outlier_hardly_moves_it() {
        let parameter = |start| Parameter { start, range: [-10.0, 10.0], step: 1e-4 };
        let points: Vec<[f64; 2]> = (0..40)
            .map(|k| 0.157 * f64::from(k))
            .map(|a| [1.0 + 3.0 * a.cos(), -2.0 + 3.0 * a.sin()])
            .chain([[9.0, 9.0]])
            .collect();
        let residuals = |x: &[f64]| {
            points.iter().map(|p| (p[0] - x[0]).hypot(p[1] - x[1]) - x[2]).collect::<Vec<_>>()
        };
        let found = minimise(&[parameter(0.0), parameter(0.0), parameter(1.0)], &residuals);
        for (x, truth) in found.iter().zip([1.0, -2.0, 3.0]) {
            assert!((x - truth).abs() < 0.1, "{found:?}");
        }
    }
}
