//! Conjugate gradients preconditioned by an older or coarser factor.

use super::dot::dot;
use super::factor::NumericFactor;
use super::symbolic::{SymbolicSystem, SymmetricMatrix};

/// Vectors of the iteration, re-used.
#[derive(Clone, Debug, Default)]
pub struct CgWorkspace {
    residual: Vec<f64>,
    preconditioned: Vec<f64>,
    direction: Vec<f64>,
    product: Vec<f64>,
}

/// How an iteration ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CgOutcome {
    /// Iterations done, one preconditioner solve each.
    pub iterations: u32,
    /// `|b - A x| / |b|` at the end.
    pub relative_residual: f64,
    /// A direction of negative curvature was met: the matrix is indefinite.
    pub negative_curvature: bool,
}

/// Solves `A x = b` to `|b - A x| <= tolerance |b|` from `x = 0`.
///
/// Stops early at `iterations_max` or at a direction of negative curvature
/// (`x` is then the best so far; zero if it was the first).
#[allow(clippy::too_many_arguments)]
pub fn conjugate_gradient(
    system: &SymbolicSystem,
    matrix: &SymmetricMatrix,
    preconditioner: &mut NumericFactor,
    b: &[f64],
    x: &mut [f64],
    tolerance: f64,
    iterations_max: u32,
    w: &mut CgWorkspace,
) -> CgOutcome {
    let n = b.len();
    x.fill(0.0);
    w.residual.clear();
    w.residual.extend_from_slice(b);
    w.product.resize(n, 0.0);
    let target = tolerance * dot(b, b).sqrt();
    let scale = dot(b, b).sqrt();
    let mut outcome =
        CgOutcome { iterations: 0, relative_residual: 1.0, negative_curvature: false };
    if scale == 0.0 {
        outcome.relative_residual = 0.0;
        return outcome;
    }
    let mut rz_old = 0.0;
    for iteration in 0..iterations_max {
        w.preconditioned.clear();
        w.preconditioned.extend_from_slice(&w.residual);
        preconditioner.solve(system, &mut w.preconditioned);
        let rz = dot(&w.residual, &w.preconditioned);
        if iteration == 0 {
            w.direction.clear();
            w.direction.extend_from_slice(&w.preconditioned);
        } else {
            let beta = rz / rz_old;
            for (d, z) in w.direction.iter_mut().zip(&w.preconditioned) {
                *d = z + beta * *d;
            }
        }
        rz_old = rz;
        system.multiply(matrix, &w.direction, &mut w.product);
        let curvature = dot(&w.direction, &w.product);
        if !(curvature > 0.0) {
            outcome.negative_curvature = true;
            return outcome;
        }
        let alpha = rz / curvature;
        for i in 0..n {
            x[i] += alpha * w.direction[i];
            w.residual[i] -= alpha * w.product[i];
        }
        outcome.iterations = iteration + 1;
        let norm = dot(&w.residual, &w.residual).sqrt();
        outcome.relative_residual = norm / scale;
        if norm <= target {
            return outcome;
        }
    }
    outcome
}
