//! The direction of a Newton step: the tangent and the linear system with it.
//!
//! A factorization costs as much as some thirty solves, so an older f32 factor
//! preconditions conjugate gradients on the current tangent, and is renewed
//! when that takes too many iterations.

use super::{Fixed, Held, Newton};
use crate::element::Dilatation;
use crate::linear::{DofMap, FactorKind, FactorMemory, NumericFactor, conjugate_gradient};
use crate::solve::loading::Loading;
use crate::solve::{StepError, mixed};
use std::time::Instant;

impl Newton<'_> {
    pub(super) fn assemble(
        &mut self,
        fixed: Fixed<'_>,
        u: &[[f64; 3]],
        independent: &[Dilatation],
    ) -> Result<(), StepError> {
        let result = self.evaluate_with(fixed, u, independent, true);
        for (dof, &e) in self.problem.system.dofs.of_dof.iter().enumerate() {
            if e != DofMap::FIXED {
                self.right[e as usize] = -self.current.residual_n[dof];
            }
        }
        result
    }

    /// Solves `tangent * step = right`; where the tangent is indefinite, a nearby one
    /// that is not, if there is one.
    pub(super) fn solve_step(&mut self, loading: &Loading, tolerance: f64, mixed: bool) {
        let mut cg_max = self.options.cg_max;
        let mut factor = match self.held.take() {
            Held::Factor(f) if !self.stale && f.kind() == FactorKind::Preconditioner => {
                if mixed {
                    cg_max = cg_max.min(mixed::OLD_FACTOR_CG_MAX);
                }
                f
            }
            other => self.factorize(other.release(), loading),
        };
        let mut fresh = false;
        loop {
            if factor.kind() == FactorKind::Indefinite {
                let clock = Instant::now();
                self.step.copy_from_slice(&self.right);
                factor.solve(&self.problem.system, &mut self.step);
                self.effort.solve_s += clock.elapsed().as_secs_f64();
                break;
            }
            let clock = Instant::now();
            let found = conjugate_gradient(
                &self.problem.system,
                &self.tangent,
                &mut factor,
                &self.right,
                &mut self.step,
                tolerance,
                cg_max,
                &mut self.cg,
            );
            self.effort.solve_s += clock.elapsed().as_secs_f64();
            tracing::trace!(
                iterations = found.iterations,
                residual = found.relative_residual,
                tolerance,
                negative_curvature = found.negative_curvature,
                assemble_s = self.effort.assemble_s,
                factor_s = self.effort.factor_s,
                solve_s = self.effort.solve_s,
                "conjugate gradients"
            );
            self.effort.cg_iterations += found.iterations;
            let enough = self.options.refactor_after_cg * if mixed { 2 } else { 1 };
            self.stale = found.iterations > enough;
            if found.negative_curvature && self.convexify(loading) {
                continue;
            }
            let usable = found.relative_residual <= tolerance
                || (found.negative_curvature && found.iterations > 0);
            if usable || fresh {
                break;
            }
            factor = self.factorize(factor.release(), loading);
            cg_max = self.options.cg_max;
            fresh = true;
        }
        self.held = Held::Factor(factor);
    }

    /// Gives back to the tangent what convex edges of the indenter take from it, which is
    /// what mostly makes it indefinite: a direction downhill then costs no more than
    /// any other. `false` if that has been done or there is nothing to give back.
    fn convexify(&mut self, loading: &Loading) -> bool {
        let any = !self.current.curvature.is_empty();
        let Some(surface) = &self.problem.contact else { return any };
        let points = surface.points(loading.contact());
        for (point, k) in self.current.curvature.drain(..) {
            self.problem.add_point(&mut self.tangent, points.support(point), &k);
        }
        any
    }

    fn factorize(&mut self, memory: FactorMemory, loading: &Loading) -> NumericFactor {
        let clock = Instant::now();
        self.effort.factorizations += 1;
        let system = &self.problem.system;
        let mut tried = memory.cholesky(system, &self.tangent);
        if let Err(memory) = tried {
            tried = if self.convexify(loading) {
                memory.cholesky(system, &self.tangent)
            } else {
                Err(memory)
            };
        }
        let factor = tried.unwrap_or_else(|memory| {
            tracing::debug!("tangent not positive definite: L B L^T");
            self.effort.indefinite_factorizations += 1;
            memory.indefinite(system, &self.tangent)
        });
        if let Some(condition) = factor.condition_at_least(system) {
            self.condition = condition;
            tracing::trace!(condition, "tangent factorized");
        }
        self.stale = false;
        self.effort.factor_s += clock.elapsed().as_secs_f64();
        factor
    }
}
