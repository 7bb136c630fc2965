//! One equilibrium: Newton's method between updates of contact's multipliers.

use super::newton::Fixed;
use super::state::State;
use super::stepping::Solver;
use super::{StepError, friction};
use crate::element::HistoryVariables;

/// Least share of its way that the friction bound goes in one update.
const RELAX_MIN: f64 = 0.1;

impl Solver<'_> {
    /// Equilibrium with contact multipliers updated until gaps close and, with
    /// friction, tangential tractions settle. Where a penalty takes the multipliers' place it does
    /// for tractions too: what sticks gives way by traction over penalty, and bounds alone are
    /// updated, which settle in a few rounds where tractions took more than forty.
    pub(super) fn augmented(&mut self, fraction: f64, trial: &mut State) -> Result<(), StepError> {
        let options = self.newton.options;
        let dt_s = self.seconds(fraction);
        let rubs = !trial.friction.points.is_empty();
        let problem = self.newton.problem;
        let bound = |relax: f64, trial: &mut State| {
            let State { u, multipliers, friction, .. } = trial;
            friction::bound(problem, &self.loading, fraction, u, multipliers, relax, friction);
        };
        bound(1.0, trial);
        let (mut relax, mut last_change) = (1.0f64, f64::INFINITY);
        let updates = if rubs { options.friction_updates_max } else { options.augmentations_max };
        let by_penalty = !self.loading.contact().has_multipliers();
        // The first equilibrium only serves to update the multipliers.
        let mut tolerance = match by_penalty && !rubs {
            true => options.residual_tolerance,
            false => 1e-3f64.max(options.residual_tolerance),
        };
        for update in 0..=updates {
            let (multipliers, u, independent, fluid) =
                (&trial.multipliers, &mut trial.u, &mut trial.independent, &mut trial.fluid);
            let fixed = Fixed {
                loading: &self.loading,
                load_fraction: fraction,
                multipliers,
                variables: HistoryVariables { history: &trial.history, dt_s },
                friction: rubs.then_some(&trial.friction),
                fluid: None,
            };
            self.newton.equilibrate(tolerance, fixed, u, independent, fluid.as_mut())?;
            let e = &self.newton.current;
            let exact = e.residual_norm <= options.residual_tolerance * e.reference_norm;
            let closes = |gap_mm: f64| by_penalty || gap_mm <= options.gap_tolerance_mm;
            if closes(e.gap_error_mm) && !exact {
                let tolerance = options.residual_tolerance;
                self.newton.equilibrate(tolerance, fixed, u, independent, fluid.as_mut())?;
            }
            let closed = closes(self.newton.current.gap_error_mm);
            let change = friction::change(&trial.friction, &self.newton.current, by_penalty);
            if closed && change <= options.friction_tolerance {
                return Ok(());
            }
            if update < updates {
                tolerance = options.residual_tolerance;
                let e = &self.newton.current;
                trial.multipliers.copy_from_slice(&e.traction_mpa);
                if !by_penalty {
                    friction::update(&mut trial.friction, e);
                }
                if change > 0.9 * last_change {
                    relax = (0.5 * relax).max(RELAX_MIN);
                }
                last_change = change;
                bound(relax, trial);
                self.newton.effort.augmentations += 1;
            }
        }
        let gap_mm = self.newton.current.gap_error_mm;
        Err(if rubs && (by_penalty || gap_mm <= options.gap_tolerance_mm) {
            StepError::Friction { updates, change: last_change }
        } else {
            StepError::Contact { augmentations: updates, gap_mm }
        })
    }
}
