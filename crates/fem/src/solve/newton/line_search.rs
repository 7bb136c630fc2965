//! The length of a Newton step: backtracking until the potential or the residual falls.

use super::{Fixed, Newton};
use crate::element::Dilatation;
use crate::linear::DofMap;
use crate::solve::evaluate::evaluate_body;
use crate::solve::{StepError, mixed};
use std::time::Instant;

impl Newton<'_> {
    /// Sets the trial to `length` of the step from `u` and the independent dilatations.
    fn go(&mut self, u: &[[f64; 3]], independent: &[Dilatation], length: f64) {
        self.trial_u.clear();
        self.trial_u.extend_from_slice(u);
        for (node, v) in self.trial_u.iter_mut().enumerate() {
            for i in 0..3 {
                let e = self.problem.system.dofs.of_dof[3 * node + i];
                if e != DofMap::FIXED {
                    v[i] += length * self.step[e as usize];
                }
            }
        }
        self.problem.mesh.follow(&mut self.trial_u);
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
