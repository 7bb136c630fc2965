//! The length of a Newton step: backtracking until the potential or the residual falls.

use super::{Fixed, Newton};
use crate::element::Dilatation;
use crate::linear::DofMap;
use crate::solve::evaluate::evaluate_body;
use crate::solve::{Problem, StepError, mixed};
use std::time::Instant;

/// Sets `trial_u` to `length` of a step (mm, one an unknown) from `u`.
pub(super) fn move_along(
    problem: &Problem,
    u: &[[f64; 3]],
    step: &[f64],
    length: f64,
    trial_u: &mut Vec<[f64; 3]>,
) {
    trial_u.clear();
    trial_u.extend_from_slice(u);
    for (v, &e) in trial_u.as_flattened_mut().iter_mut().zip(&problem.system.dofs.of_dof) {
        if e != DofMap::FIXED {
            *v += length * step[e as usize];
        }
    }
    problem.mesh.follow(trial_u);
}

impl Newton<'_> {
    /// Sets the trial to `length` of the step from `u` and the independent dilatations.
    fn go(&mut self, u: &[[f64; 3]], independent: &[Dilatation], length: f64) {
        move_along(self.problem, u, &self.step, length, &mut self.trial_u);
        self.trial_independent.clear();
        for (c, n) in independent.iter().zip(&self.next) {
            self.trial_independent.push(std::array::from_fn(|r| c[r] + length * (n[r] - c[r])));
        }
    }

    /// Evaluates the trial.
    pub(super) fn try_trial(&mut self, fixed: Fixed<'_>) -> Result<(), StepError> {
        let clock = Instant::now();
        let trial = fixed.trial(&self.trial_u, &self.trial_independent, self.penalty);
        let found = evaluate_body(self.problem, fixed.loading, &trial, None, &mut self.trial);
        self.effort.assemble_s += clock.elapsed().as_secs_f64();
        found
    }

    /// Backtracks along `step` until potential or residual falls; with independent dilatations,
    /// which go the same way, until the potential or the residual of both fields does.
    pub(super) fn line_search(
        &mut self,
        fixed: Fixed<'_>,
        u: &mut [[f64; 3]],
        independent: &mut [Dilatation],
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
        if !independent.is_empty() {
            mixed::next_dilatations(self.problem, u, &self.step, &mut self.next);
        }
        let mut length = 1.0;
        for _ in 0..self.options.line_search_max {
            self.go(u, independent, length);
            if self.try_trial(fixed).is_ok() {
                let falls = self.trial.potential_mj <= energy + 1e-4 * length * slope;
                let smaller = if independent.is_empty() {
                    self.trial.residual_norm < 0.5 * norm
                } else {
                    self.trial.mixed_norm <= (1.0 - 1e-4 * length) * mixed_norm
                };
                if falls || smaller {
                    if length < 1.0 {
                        tracing::trace!(length, energy, "newton step shortened");
                    }
                    u.copy_from_slice(&self.trial_u);
                    independent.copy_from_slice(&self.trial_independent);
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
