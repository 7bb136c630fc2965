//! Load stepping: equilibria at increasing load fractions, cutting steps that fail.

use super::effort::Effort;
use super::evaluate::Evaluation;
use super::history::{self, EnergySplit};
use super::loading::Loading;
use super::newton::{Fixed, Newton};
use super::problem::Problem;
use super::state::{Mark, State, StepReport};
use super::work::Work;
use super::{Options, SolveError, StepError, fluid, friction, mixed};
use crate::contact::{FrictionPoint, FrictionTrial};
use crate::element::HistoryVariables;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Solves one loading of a [`Problem`]; re-usable for the next.
pub struct Solver<'a> {
    pub(super) newton: Newton<'a>,
    pub(super) loading: Loading,
    pub(super) state: State,
    /// Equilibrium before the last, for extrapolation.
    pub(super) before: Option<State>,
    pub(super) work: Work,
    /// Load fraction that a time step may take; `None` for elastic bodies.
    pub(super) time_step: Option<f64>,
}

impl<'a> Solver<'a> {
    /// Buffers for solving `problem`.
    ///
    /// # Errors
    /// [`SolveError::Factor`] if the factor does not fit in memory,
    /// [`SolveError::RigidBodyMode`] if a part of the body is not held.
    pub fn new(problem: &'a Problem, options: Options) -> Result<Self, SolveError> {
        problem.is_held()?;
        let mut solver = Self {
            newton: Newton::new(problem, options)?,
            loading: Loading::default(),
            state: State::default(),
            before: None,
            work: Work::default(),
            time_step: None,
        };
        solver.start(Loading::default());
        Ok(solver)
    }

    /// From now on every search for an equilibrium ends with [`SolveError::Stopped`] once `stop` is
    /// true, within an iteration of Newton's method.
    pub fn stop_when(&mut self, stop: Option<Arc<AtomicBool>>) {
        self.newton.stop = stop;
    }

    /// What [`Self::stop_when`] was told.
    #[must_use]
    pub fn stops_when(&self) -> Option<Arc<AtomicBool>> {
        self.newton.stop.clone()
    }

    /// Puts the body at rest and takes a new loading.
    pub fn start(&mut self, loading: Loading) {
        let problem = self.newton.problem;
        self.loading = loading;
        let rule = self.loading.contact();
        let contact_points = problem.contact.as_ref().map_or(0, |c| c.points(rule).len());
        self.state = State {
            fraction: 0.0,
            u: vec![[0.0; 3]; problem.mesh.nodes.len()],
            independent: mixed::at_rest(problem),
            multipliers: vec![0.0; contact_points],
            history: vec![0.0; problem.history_layout.as_ref().map_or(0, |m| m.len)],
            friction: FrictionTrial::default(),
            fluid: fluid::at_rest(problem),
        };
        if self.loading.friction > 0.0 {
            self.state.friction = FrictionTrial {
                coefficient: self.loading.friction,
                points: vec![FrictionPoint::default(); contact_points],
                heat_mj: 0.0,
            };
            let at_rest = self.state.friction.clone();
            let State { u, friction, .. } = &mut self.state;
            friction::anchor(problem, &self.loading, 0.0, u, &at_rest, friction);
        }
        self.before = None;
        self.work = Work::default();
        self.time_step = self.first_time_step();
        self.newton.forget(rule);
    }

    /// Forgets how the last equilibria followed each other, because the load is
    /// about to turn.
    pub fn turn(&mut self) {
        self.before = None;
        self.time_step = self.first_time_step();
    }

    /// The present equilibrium, to come back to with [`Self::restore`].
    #[must_use]
    pub fn mark(&self) -> Mark {
        Mark { state: self.state.clone(), before: self.before.clone(), work: self.work.clone() }
    }

    /// Goes back to an earlier equilibrium of the same loading.
    pub fn restore(&mut self, mark: &Mark) {
        self.state = mark.state.clone();
        self.before = mark.before.clone();
        self.work = mark.work.clone();
    }

    /// Goes on to `target` (in `[0, 1]`, above the fraction reached) through as
    /// many equilibria as it takes.
    ///
    /// # Errors
    /// [`SolveError::CutsExhausted`] and [`SolveError::StepsExhausted`]; the state is then
    /// the last equilibrium.
    pub fn advance_to(&mut self, target: f64) -> Result<StepReport, SolveError> {
        let first = self.newton.effort;
        let found = self.steps_to(target);
        let report = self.report(&first);
        let StepReport { load_fraction, j_min, condition_at_least, effort, .. } = report;
        if let Err(error @ SolveError::Stopped { .. }) = found {
            return Err(error);
        }
        if let Err(error) = found {
            let [block, element] = report.j_min_at;
            tracing::warn!(
                reached = load_fraction, target, %error, j_min, block, element, condition_at_least,
                cuts = effort.cuts, iterations = effort.newton_iterations, "solve given up"
            );
            return Err(error);
        }
        tracing::debug!(
            load_fraction,
            steps = effort.steps,
            cuts = effort.cuts,
            iterations = effort.newton_iterations,
            j_min,
            condition_at_least,
            "increment done"
        );
        Ok(report)
    }

    /// Makes the work of a straight indenter more exact: equilibria are found between those of
    /// the path since `known` (the first where it began) until energy and work part by no more
    /// than `relative`, a dozen at most. The present equilibrium stays as it is.
    ///
    /// Does nothing where work is lost (friction, viscosity), since the way there matters then.
    pub fn mend_work(&mut self, known: Vec<Mark>, relative: f64) -> Effort {
        const PROBES_MAX: usize = 12;
        let first = self.newton.effort;
        let problem = self.newton.problem;
        let is_lost = self.loading.friction > 0.0
            || problem.history_layout.is_some()
            || problem.fluid.is_some();
        let (Some(indenter), Some(start), false) = (&self.loading.indenter, known.first(), is_lost)
        else {
            return Effort::default();
        };
        let (indenter, from) = (indenter.clone(), start.state.fraction);
        let doubtful = |work: &Work| {
            work.doubtful(&indenter, from).filter(|d| d.relative > relative).map(|d| d.fraction)
        };
        if doubtful(&self.work).is_none() {
            return Effort::default();
        }
        let (end, current) = (self.mark(), self.newton.current.clone());
        let mut known: Vec<State> = known.into_iter().map(|m| m.state).collect();
        known.push(end.state.clone());
        for _ in 0..PROBES_MAX {
            let Some(fraction) = doubtful(&self.work) else { break };
            let right = known.partition_point(|s| s.fraction < fraction);
            self.before = Some(known[right - 1].clone());
            self.state = known[right].clone();
            if let Err(cause) = self.try_step(fraction) {
                tracing::debug!(fraction, %cause, "no equilibrium to mend the work with");
                break;
            }
            known.insert(right, self.state.clone());
        }
        (self.state, self.before, self.newton.current) = (end.state, end.before, current);
        self.newton.effort.since(&first)
    }

    fn steps_to(&mut self, target: f64) -> Result<(), SolveError> {
        let mut step = self.within_time_step(target - self.state.fraction);
        let (mut cuts, mut steps) = (0, 0);
        while self.state.fraction < target {
            let reached = self.state.fraction;
            if steps == self.newton.options.steps_max {
                self.settle();
                return Err(SolveError::StepsExhausted { reached, steps });
            }
            let end = reached + 1.000_001 * step >= target;
            let next = if end { target } else { reached + step };
            match self.try_step(next) {
                Ok(()) => {
                    steps += 1;
                    self.newton.effort.steps += 1;
                    step = self.within_time_step(1.5 * step);
                }
                Err(StepError::Stopped) => return Err(SolveError::Stopped { reached }),
                Err(cause) => {
                    cuts += 1;
                    self.newton.effort.cuts += 1;
                    tracing::debug!(reached, next, %cause, "load step cut");
                    if cuts > self.newton.options.cuts_max {
                        self.settle();
                        return Err(SolveError::CutsExhausted { reached, cuts: cuts - 1, cause });
                    }
                    step = 0.5 * (next - reached);
                }
            }
        }
        Ok(())
    }

    /// After a step that failed: forces and tractions are again those of the last equilibrium.
    pub(super) fn settle(&mut self) {
        let State { fraction, u, independent, multipliers, history, friction, fluid } = &self.state;
        let fixed = Fixed {
            loading: &self.loading,
            load_fraction: *fraction,
            multipliers,
            variables: HistoryVariables { history, dt_s: 0.0 },
            friction: (!friction.points.is_empty()).then_some(friction),
            fluid: fluid.as_ref().map(|f| f.flow()),
        };
        // It was in equilibrium: nothing in it is inverted.
        if let Err(error) = self.newton.evaluate(fixed, u, independent) {
            tracing::warn!(%error, "the last equilibrium cannot be evaluated");
        }
    }

    /// Force that is told from rounding, N: what is small is measured by it where nothing
    /// touches.
    #[must_use]
    pub fn least_force_n(&self) -> f64 {
        self.newton.rounding_force_n / self.newton.options.residual_tolerance
    }

    pub(super) fn report(&self, since: &Effort) -> StepReport {
        let e = &self.newton.current;
        // The potential of an elastic body is its stored energy.
        let energy = if self.newton.problem.history_layout.is_some() {
            history::energies(self.newton.problem, &self.state.history, &self.state.u)
        } else {
            EnergySplit { stored_mj: e.stored_mj, dissipated_mj: 0.0 }
        };
        StepReport {
            load_fraction: self.state.fraction,
            residual_relative: e.residual_norm / e.reference_norm.max(self.least_force_n()),
            gap_error_mm: e.gap_error_mm,
            stored_mj: energy.stored_mj + e.contact_mj,
            dissipated_mj: energy.dissipated_mj
                + self.state.friction.heat_mj
                + self.state.fluid.as_ref().map_or(0.0, |f| f.lost_mj),
            j_min: e.j_min,
            j_min_at: e.j_min_at,
            condition_at_least: self.newton.condition,
            effort: self.newton.effort.since(since),
            mending: Effort::default(),
            guiding: Effort::default(),
        }
    }

    /// One equilibrium at `next`, or the state as it was.
    fn try_step(&mut self, next: f64) -> Result<(), StepError> {
        let mut trial = self.predict(next);
        let mut found = self.augmented(next, &mut trial);
        // The extrapolation may be what failed: once more from the last equilibrium.
        if let (Err(cause), Some(_)) = (&found, &self.before) {
            tracing::debug!(next, %cause, "extrapolated start failed");
            trial = self.unmoved(next);
            found = self.augmented(next, &mut trial);
        }
        // Or the dilatations: downhill on the potential alone, which is slower.
        if let (Err(cause), true) = (&found, !self.state.independent.is_empty()) {
            tracing::debug!(next, %cause, "independent dilatations failed");
            trial = self.unmoved(next);
            trial.independent.clear();
            found = self.augmented(next, &mut trial);
            mixed::dilatations(self.newton.problem, &trial.u, &mut trial.independent);
        }
        found?;
        self.accept(next, trial);
        Ok(())
    }

    /// Makes an equilibrium the present one.
    pub(super) fn accept(&mut self, next: f64, mut trial: State) {
        self.set_time_step(next, &trial.u);
        let problem = self.newton.problem;
        let dt_s = self.seconds(next);
        trial.fraction = next;
        if let Some(layout) = &problem.history_layout {
            history::advance(problem, layout, &trial.u, dt_s, &mut trial.history);
        }
        friction::update(&mut trial.friction, &self.newton.current);
        let before = &self.state.friction;
        friction::anchor(problem, &self.loading, next, &trial.u, before, &mut trial.friction);
        fluid::advance(problem, self.state.fluid.as_ref(), &trial.u, &mut trial.fluid);
        if let Some(pressure) = &self.loading.pressure {
            let shares = [self.state.fraction, next].map(|fraction| self.loading.share(fraction));
            self.work.pressure_mj +=
                pressure.work_mj(&problem.mesh, [&self.state.u, &trial.u], shares);
        }
        self.before = Some(std::mem::replace(&mut self.state, trial));
        if let Some(indenter) = &self.loading.indenter {
            let Evaluation { contact_force_n, stored_mj, contact_mj, .. } = self.newton.current;
            self.work.add(indenter, next, contact_force_n, stored_mj + contact_mj);
        }
    }
}
