//! Newton's method at one load fraction, with the linear solves it needs.
//!
//! A factorization costs as much as some thirty solves, so an older f32 factor
//! preconditions conjugate gradients on the current tangent, and is renewed
//! when that takes too many iterations.

use super::effort::Effort;
use super::evaluate::{Evaluation, Trial, evaluate_body};
use super::loading::Loading;
use super::mixed;
use super::problem::Problem;
use super::{Options, SolveError, StepError};
use crate::contact::{ContactRule, FrictionTrial, Support};
use crate::element::{Dilatation, Memory};
use crate::linear::{
    CgWorkspace, Equations, Factor, Factorizer, SymmetricMatrix, conjugate_gradient,
};
use std::time::Instant;

/// What stays fixed while an equilibrium is sought.
#[derive(Clone, Copy)]
pub(super) struct Fixed<'a> {
    pub loading: &'a Loading,
    pub load_fraction: f64,
    pub multipliers: &'a [f64],
    pub memory: Memory<'a>,
    pub friction: Option<&'a FrictionTrial>,
}

impl<'a> Fixed<'a> {
    fn trial(&self, u: &'a [[f64; 3]], carried: &'a [Dilatation], penalty: f64) -> Trial<'a> {
        Trial {
            u,
            carried,
            multipliers_mpa: self.multipliers,
            penalty,
            load_fraction: self.load_fraction,
            memory: self.memory,
            friction: self.friction,
        }
    }
}

/// Memory and counters of the iteration.
pub(super) struct Newton<'a> {
    pub problem: &'a Problem,
    pub options: Options,
    pub penalty: f64,
    /// Forces below this are rounding of a body at rest, N.
    pub rounding_force_n: f64,
    pub effort: Effort,
    factorizer: Factorizer,
    tangent: SymmetricMatrix,
    /// Renew the factor at the next linear solve.
    stale: bool,
    /// See [`Factorizer::condition_at_least`]; of the last Cholesky factor.
    pub condition: f64,
    cg: CgWorkspace,
    right: Vec<f64>,
    step: Vec<f64>,
    trial_u: Vec<[f64; 3]>,
    /// Dilatations at the end of a full step, and of the one that is tried.
    next: Vec<Dilatation>,
    trial_carried: Vec<Dilatation>,
    pub current: Evaluation,
    trial: Evaluation,
}

impl<'a> Newton<'a> {
    pub(super) fn new(problem: &'a Problem, options: Options) -> Result<Self, SolveError> {
        let n = problem.structure.equations.count;
        Ok(Self {
            problem,
            options,
            penalty: 0.0,
            rounding_force_n: 1e-13 * force_scale_n(problem),
            effort: Effort::default(),
            factorizer: Factorizer::new(&problem.structure)?,
            tangent: problem.structure.zeros(),
            stale: true,
            condition: f64::NAN,
            cg: CgWorkspace::default(),
            right: vec![0.0; n],
            step: vec![0.0; n],
            trial_u: Vec::new(),
            next: Vec::new(),
            trial_carried: Vec::new(),
            current: Evaluation::default(),
            trial: Evaluation::default(),
        })
    }

    /// Forgets the factor, so that a new press does not depend on the last one, and gets ready
    /// for contact of this kind.
    pub(super) fn forget(&mut self, rule: ContactRule) {
        let of_rule = || self.problem.penalty_mpa_per_mm(rule);
        self.penalty = self.options.penalty_mpa_per_mm.unwrap_or_else(of_rule);
        self.stale = true;
        self.condition = f64::NAN;
        self.effort = Effort::default();
    }

    /// Brings `u`, and the dilatations that elements carry along, if any, to equilibrium with
    /// everything else `fixed`, to a residual of `tolerance` times the reference force.
    pub(super) fn equilibrate(
        &mut self,
        tolerance: f64,
        fixed: Fixed<'_>,
        u: &mut [[f64; 3]],
        carried: &mut [Dilatation],
    ) -> Result<(), StepError> {
        self.evaluate(fixed, u, carried)?;
        let floor = self.rounding_force_n;
        let mut previous = f64::INFINITY;
        for iteration in 0..=self.options.newton_max {
            let (norm, reference) = (self.current.residual_norm, self.current.reference_norm);
            let load_fraction = fixed.load_fraction;
            tracing::trace!(iteration, load_fraction, residual = norm, reference, "newton");
            if norm <= tolerance * reference || norm <= floor {
                return Ok(());
            }
            let last = iteration == self.options.newton_max;
            // Nearly incompressible bodies round more than is asked of the residual: where it
            // no longer falls, what is left is as good as it gets.
            if (norm > 0.5 * previous || (last && iteration > 0)) && norm <= self.rounding_n(u) {
                tracing::debug!(residual = norm / reference, "the residual is down to rounding");
                return Ok(());
            }
            if last {
                break;
            }
            self.assemble(fixed, u, carried)?;
            let mut forcing = Self::forcing(norm, previous, tolerance * reference);
            if !carried.is_empty() {
                let share = self.current.mixed_norm / norm;
                forcing = mixed::forcing(forcing, share, tolerance * reference / norm);
            }
            previous = norm;
            self.solve_step(fixed.loading, forcing, !carried.is_empty());
            match self.line_search(fixed, u, carried) {
                // Energy differences drown in rounding, and so does what is left of the residual.
                Err(StepError::LineSearch { .. }) if norm <= self.rounding_n(u) => return Ok(()),
                other => other?,
            }
            self.effort.newton_iterations += 1;
        }
        Err(StepError::Newton {
            iterations: self.options.newton_max,
            residual: self.current.residual_norm / self.current.reference_norm,
        })
    }

    /// Residual that the rounding of `u` can make, N, with the tangent in hand.
    fn rounding_n(&self, u: &[[f64; 3]]) -> f64 {
        let mut unknowns = vec![0.0; self.right.len()];
        for (v, &e) in u.as_flattened().iter().zip(&self.problem.structure.equations.of_dof) {
            if e != Equations::FIXED {
                unknowns[e as usize] = *v;
            }
        }
        f64::EPSILON * self.problem.structure.absolute_product_norm(&self.tangent, &unknowns)
    }

    /// How exactly to solve the linear system: no more than its model of the
    /// body is worth (Eisenstat & Walker 1996, choice 2), nor than is asked of
    /// the residual in the end.
    fn forcing(norm: f64, previous: f64, target: f64) -> f64 {
        let (first, gamma) = (1e-3, 0.1);
        let ratio = norm / previous;
        let wanted = if previous.is_finite() { gamma * ratio * ratio } else { first };
        let enough = 0.3 * target / norm;
        wanted.min(first).max(enough).min(0.3)
    }

    /// Evaluates at `u` into `current`, without a tangent.
    pub(super) fn evaluate(
        &mut self,
        fixed: Fixed<'_>,
        u: &[[f64; 3]],
        carried: &[Dilatation],
    ) -> Result<(), StepError> {
        let clock = Instant::now();
        let trial = fixed.trial(u, carried, self.penalty);
        let result = evaluate_body(self.problem, fixed.loading, &trial, None, &mut self.current);
        self.effort.assemble_s += clock.elapsed().as_secs_f64();
        result
    }

    fn assemble(
        &mut self,
        fixed: Fixed<'_>,
        u: &[[f64; 3]],
        carried: &[Dilatation],
    ) -> Result<(), StepError> {
        let clock = Instant::now();
        let trial = fixed.trial(u, carried, self.penalty);
        let tangent = Some(&mut self.tangent);
        let result = evaluate_body(self.problem, fixed.loading, &trial, tangent, &mut self.current);
        self.effort.assemble_s += clock.elapsed().as_secs_f64();
        for (dof, &e) in self.problem.structure.equations.of_dof.iter().enumerate() {
            if e != Equations::FIXED {
                self.right[e as usize] = -self.current.residual_n[dof];
            }
        }
        result
    }

    /// Solves `tangent * step = right`; where the tangent is indefinite, a nearby one
    /// that is not, if there is one.
    fn solve_step(&mut self, loading: &Loading, tolerance: f64, mixed: bool) {
        let mut cg_max = self.options.cg_max;
        if self.stale || self.factorizer.held() != Some(Factor::Preconditioner) {
            self.factorize(loading);
        } else if mixed {
            cg_max = cg_max.min(mixed::OLD_FACTOR_CG_MAX);
        }
        let mut fresh = false;
        loop {
            if self.factorizer.held() == Some(Factor::Indefinite) {
                let clock = Instant::now();
                self.step.copy_from_slice(&self.right);
                self.factorizer.solve(&self.problem.structure, &mut self.step);
                self.effort.solve_s += clock.elapsed().as_secs_f64();
                return;
            }
            let clock = Instant::now();
            let found = conjugate_gradient(
                &self.problem.structure,
                &self.tangent,
                &mut self.factorizer,
                &self.right,
                &mut self.step,
                tolerance,
                cg_max,
                &mut self.cg,
            );
            self.effort.solve_s += clock.elapsed().as_secs_f64();
            self.effort.cg_iterations += found.iterations;
            self.stale = found.iterations > self.options.refactor_after_cg;
            if found.negative_curvature && self.convexify(loading) {
                continue;
            }
            let usable = found.relative_residual <= tolerance
                || (found.negative_curvature && found.iterations > 0);
            if usable || fresh {
                return;
            }
            self.factorize(loading);
            cg_max = self.options.cg_max;
            fresh = true;
        }
    }

    /// Gives back to the tangent what convex edges of the indenter take from it, which is
    /// what mostly makes it indefinite: a direction downhill then costs no more than
    /// any other. `false` if that has been done or there is nothing to give back.
    fn convexify(&mut self, loading: &Loading) -> bool {
        let any = !self.current.curvature.is_empty();
        let Some(surface) = &self.problem.contact else { return any };
        let points = surface.points(loading.contact());
        for (point, k) in self.current.curvature.drain(..) {
            let Support { nodes, values } = points.support(point);
            self.problem.structure.add_point(&mut self.tangent, nodes, values, &k);
        }
        any
    }

    fn factorize(&mut self, loading: &Loading) {
        let clock = Instant::now();
        self.effort.factorizations += 1;
        let structure = &self.problem.structure;
        let mut definite = self.factorizer.cholesky(structure, &self.tangent).is_ok();
        if !definite && self.convexify(loading) {
            definite = self.factorizer.cholesky(structure, &self.tangent).is_ok();
        }
        if let Some(condition) = self.factorizer.condition_at_least(structure) {
            self.condition = condition;
            tracing::trace!(condition, "tangent factorized");
        }
        if !definite {
            tracing::debug!("tangent not positive definite: L B L^T");
            self.effort.indefinite_factorizations += 1;
            self.factorizer.indefinite(structure, &self.tangent);
        }
        self.stale = false;
        self.effort.factor_s += clock.elapsed().as_secs_f64();
    }

    /// Sets the trial to `length` of the step from `u` and what is carried.
    fn go(&mut self, u: &[[f64; 3]], carried: &[Dilatation], length: f64) {
        self.trial_u.clear();
        self.trial_u.extend_from_slice(u);
        for (node, v) in self.trial_u.iter_mut().enumerate() {
            for i in 0..3 {
                let e = self.problem.structure.equations.of_dof[3 * node + i];
                if e != Equations::FIXED {
                    v[i] += length * self.step[e as usize];
                }
            }
        }
        self.trial_carried.clear();
        for (c, n) in carried.iter().zip(&self.next) {
            self.trial_carried.push(std::array::from_fn(|r| c[r] + length * (n[r] - c[r])));
        }
    }

    /// Backtracks along `step` until potential or residual falls; with carried dilatations,
    /// which go the same way, until the potential or the residual of both fields does.
    fn line_search(
        &mut self,
        fixed: Fixed<'_>,
        u: &mut [[f64; 3]],
        carried: &mut [Dilatation],
    ) -> Result<(), StepError> {
        // Derivative of the potential along the step; an indefinite tangent
        // can point uphill.
        let mut slope: f64 = -crate::linear::dot(&self.right, &self.step);
        if slope > 0.0 {
            slope = -slope;
            self.step.iter_mut().for_each(|s| *s = -*s);
        }
        let (energy, norm) = (self.current.potential_mj, self.current.residual_norm);
        let mixed_norm = self.current.mixed_norm;
        self.next.clear();
        if !carried.is_empty() {
            mixed::next_dilatations(self.problem, u, &self.step, &mut self.next);
        }
        let mut length = 1.0;
        for _ in 0..self.options.line_search_max {
            self.go(u, carried, length);
            let clock = Instant::now();
            let trial = fixed.trial(&self.trial_u, &self.trial_carried, self.penalty);
            let found = evaluate_body(self.problem, fixed.loading, &trial, None, &mut self.trial);
            self.effort.assemble_s += clock.elapsed().as_secs_f64();
            if found.is_ok() {
                let falls = self.trial.potential_mj <= energy + 1e-4 * length * slope;
                let smaller = if carried.is_empty() {
                    self.trial.residual_norm < 0.5 * norm
                } else {
                    self.trial.mixed_norm <= (1.0 - 1e-4 * length) * mixed_norm
                };
                if falls || smaller {
                    if length < 1.0 {
                        tracing::trace!(length, energy, "newton step shortened");
                    }
                    u.copy_from_slice(&self.trial_u);
                    carried.copy_from_slice(&self.trial_carried);
                    std::mem::swap(&mut self.current, &mut self.trial);
                    return Ok(());
                }
            }
            self.effort.backtracks += 1;
            length *= 0.5;
        }
        Err(StepError::LineSearch { residual: norm / self.current.reference_norm })
    }
}

/// A force typical of the body: its soft tissue's shear modulus times its extent squared.
fn force_scale_n(problem: &Problem) -> f64 {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for p in &problem.mesh.nodes {
        for i in 0..3 {
            low[i] = low[i].min(p[i]);
            high[i] = high[i].max(p[i]);
        }
    }
    let extent = (0..3).map(|i| high[i] - low[i]).fold(0.0, f64::max);
    problem.soft_mpa() * extent * extent
}
