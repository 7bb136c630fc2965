//! Newton's method for displacement and fluid pressure together.
//!
//! The equilibrium of a step is a saddle point, so no potential falls on the way: the line search
//! asks the norm of both residuals to fall below the largest of the last few (Grippo, Lampariello
//! & Lucidi 1986), since contact that opens and closes makes it rise now and then.

use super::line_search::move_along;
use super::{Fixed, Newton};
use crate::biphasic::{Flow, FluidPhase};
use crate::linear::{FactorError, SaddleSolver, SymmetricMatrix};
use crate::solve::StepError;
use crate::solve::fluid::FluidState;
use std::time::Instant;

/// Norms that a new one is measured by.
const REMEMBERED: usize = 3;

/// Memory for the system of displacement and fluid pressure.
pub(super) struct Saddle {
    matrix: SymmetricMatrix,
    solver: SaddleSolver,
    right: Vec<f64>,
    step: Vec<f64>,
    trial_mpa: Vec<f64>,
}

impl Saddle {
    pub(super) fn new(phase: &FluidPhase) -> Result<Self, FactorError> {
        let vector = || vec![0.0; phase.system.len()];
        Ok(Self {
            matrix: phase.system.zeros(),
            solver: SaddleSolver::new(&phase.system)?,
            right: vector(),
            step: vector(),
            trial_mpa: vec![0.0; phase.unknowns()],
        })
    }
}

impl Newton<'_> {
    /// [`Self::equilibrate`] of a body full of fluid.
    pub(super) fn equilibrate_with_fluid(
        &mut self,
        tolerance: f64,
        fixed: Fixed<'_>,
        u: &mut [[f64; 3]],
        fluid: &mut FluidState,
    ) -> Result<(), StepError> {
        self.evaluate(Fixed { fluid: Some(fluid.flow()), ..fixed }, u, &[])?;
        let mut norms = Vec::with_capacity(self.options.newton_max as usize);
        for iteration in 0..=self.options.newton_max {
            let (norm, reference) = (self.current.residual_norm, self.current.reference_norm);
            let load_fraction = fixed.load_fraction;
            tracing::trace!(iteration, load_fraction, residual = norm, reference, "newton, fluid");
            if norm <= tolerance * reference || norm <= self.rounding_force_n {
                return Ok(());
            }
            let stalls = norms.last().is_some_and(|last| norm > 0.5 * last);
            if stalls && norm <= self.rounding_n(u) {
                return Ok(());
            }
            if iteration == self.options.newton_max {
                break;
            }
            norms.push(norm);
            let Some(mut saddle) = self.saddle.take() else { break };
            let found = self.saddle_step(fixed, u, fluid.flow(), &mut saddle).and_then(|()| {
                let bound = norms.iter().rev().take(REMEMBERED).fold(0.0, |m: f64, n| m.max(*n));
                self.go_along(fixed, u, fluid, &mut saddle, bound)
            });
            self.saddle = Some(saddle);
            match found {
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

    /// Solves for the step of both.
    fn saddle_step(
        &mut self,
        fixed: Fixed<'_>,
        u: &[[f64; 3]],
        flow: Flow<'_>,
        saddle: &mut Saddle,
    ) -> Result<(), StepError> {
        let problem = self.problem;
        let Some(phase) = &problem.fluid else { return Ok(()) };
        self.assemble(Fixed { fluid: Some(flow), ..fixed }, u, &[])?;
        let clock = Instant::now();
        let own = (&problem.system, &self.tangent);
        let dt_s = fixed.variables.dt_s;
        phase
            .assemble(problem.solid(), u, flow, dt_s, own, &mut saddle.matrix)
            .map_err(|(block, element, i)| StepError::Inverted { block, element, j: i.j })?;
        self.effort.assemble_s += clock.elapsed().as_secs_f64();
        let clock = Instant::now();
        let Saddle { matrix, solver, right, step, .. } = saddle;
        solver.factorize(&phase.system, matrix).map_err(|_| StepError::Singular)?;
        self.effort.factorizations += 1;
        self.effort.indefinite_factorizations += 1;
        self.effort.factor_s += clock.elapsed().as_secs_f64();
        let clock = Instant::now();
        let displacements = problem.system.dofs.count;
        right[..displacements].copy_from_slice(&self.right);
        for (r, s) in right[displacements..].iter_mut().zip(&self.current.surplus_mm3) {
            *r = -s;
        }
        let residual = solver.solve(&phase.system, matrix, right, step);
        self.effort.solve_s += clock.elapsed().as_secs_f64();
        tracing::trace!(residual, "displacement and pressure solved for");
        if step.iter().all(|s| s.is_finite()) { Ok(()) } else { Err(StepError::Singular) }
    }

    /// Goes along the step as far as the norm of both residuals is below `bound`.
    fn go_along(
        &mut self,
        fixed: Fixed<'_>,
        u: &mut [[f64; 3]],
        fluid: &mut FluidState,
        saddle: &mut Saddle,
        bound: f64,
    ) -> Result<(), StepError> {
        let Saddle { step, trial_mpa, .. } = saddle;
        let mut length = 1.0;
        for _ in 0..self.options.line_search_max {
            move_along(self.problem, u, step, length, &mut self.trial_u);
            let pressure_step = &step[self.problem.system.dofs.count..];
            for ((t, p), s) in trial_mpa.iter_mut().zip(&fluid.pressure_mpa).zip(pressure_step) {
                *t = p + length * s;
            }
            let flow = Flow { pressure_mpa: trial_mpa, ..fluid.flow() };
            let fixed = Fixed { fluid: Some(flow), ..fixed };
            if self.try_trial(fixed).is_ok()
                && self.trial.residual_norm <= (1.0 - 1e-4 * length) * bound
            {
                u.copy_from_slice(&self.trial_u);
                fluid.pressure_mpa.copy_from_slice(trial_mpa);
                std::mem::swap(&mut self.current, &mut self.trial);
                return Ok(());
            }
            self.effort.backtracks += 1;
            length *= 0.5;
        }
        let Newton { current, .. } = self;
        Err(StepError::LineSearch { residual: current.residual_norm / current.reference_norm })
    }
}
