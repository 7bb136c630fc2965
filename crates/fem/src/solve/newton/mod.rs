//! Newton's method at one load fraction.

mod biphasic;
mod direction;
mod line_search;
mod preconditioner;

pub(super) use preconditioner::Preconditioner;

use super::effort::Effort;
use super::evaluate::{Evaluation, Trial, evaluate_body};
use super::fluid::FluidState;
use super::loading::Loading;
use super::problem::Problem;
use super::{Options, SolveError, StepError};
use crate::biphasic::Flow;
use crate::contact::{ContactRule, FrictionTrial};
use crate::element::{Dilatation, HistoryVariables};
use crate::linear::{CgWorkspace, DofMap, FactorMemory, NumericFactor, SymmetricMatrix};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// What stays fixed while an equilibrium is sought.
#[derive(Clone, Copy)]
pub(super) struct Fixed<'a> {
    pub loading: &'a Loading,
    pub load_fraction: f64,
    pub multipliers: &'a [f64],
    pub variables: HistoryVariables<'a>,
    pub friction: Option<&'a FrictionTrial>,
    pub fluid: Option<Flow<'a>>,
}

impl<'a> Fixed<'a> {
    fn trial(&self, u: &'a [[f64; 3]], independent: &'a [Dilatation], penalty: f64) -> Trial<'a> {
        Trial {
            u,
            independent,
            multipliers_mpa: self.multipliers,
            penalty,
            load_fraction: self.load_fraction,
            variables: self.variables,
            friction: self.friction,
            fluid: self.fluid,
        }
    }
}

/// A factor of an earlier tangent, or memory for one.
enum Held {
    Memory(FactorMemory),
    Factor(NumericFactor),
}

impl Held {
    /// Leaves nothing in its place.
    fn take(&mut self) -> Self {
        std::mem::replace(self, Self::Memory(FactorMemory::default()))
    }

    fn release(self) -> FactorMemory {
        match self {
            Self::Memory(memory) => memory,
            Self::Factor(factor) => factor.release(),
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
    /// A search ends where more indefinite factorizations than this have been counted.
    pub indefinite_end: u32,
    /// A search ends once this is true.
    pub stop: Option<Arc<AtomicBool>>,
    held: Held,
    tangent: SymmetricMatrix,
    /// Renew the factor at the next linear solve.
    stale: bool,
    /// See [`NumericFactor::condition_at_least`]; of the last Cholesky factor.
    pub condition: f64,
    cg: CgWorkspace,
    /// The system of displacement and fluid pressure.
    saddle: Option<biphasic::Saddle>,
    right: Vec<f64>,
    step: Vec<f64>,
    trial_u: Vec<[f64; 3]>,
    /// Dilatations at the end of a full step, and of the one that is tried.
    next: Vec<Dilatation>,
    trial_independent: Vec<Dilatation>,
    pub current: Evaluation,
    trial: Evaluation,
}

impl<'a> Newton<'a> {
    pub(super) fn new(problem: &'a Problem, options: Options) -> Result<Self, SolveError> {
        let n = problem.system.dofs.count;
        let saddle = problem.fluid.as_ref().map(biphasic::Saddle::new).transpose()?;
        // With fluid its system is factorized, not the displacements' own.
        let memory = match saddle {
            Some(_) => FactorMemory::default(),
            None => FactorMemory::new(&problem.system)?,
        };
        Ok(Self {
            problem,
            options,
            penalty: 0.0,
            rounding_force_n: 1e-13 * force_scale_n(problem),
            effort: Effort::default(),
            indefinite_end: u32::MAX,
            stop: None,
            held: Held::Memory(memory),
            tangent: problem.system.zeros(),
            stale: true,
            condition: f64::NAN,
            cg: CgWorkspace::default(),
            saddle,
            right: vec![0.0; n],
            step: vec![0.0; n],
            trial_u: Vec::new(),
            next: Vec::new(),
            trial_independent: Vec::new(),
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

    /// Brings `u`, the dilatations that elements keep as unknowns of their own and the fluid, if any, to
    /// equilibrium with everything else `fixed`, to a residual of `tolerance` times the reference
    /// force.
    pub(super) fn equilibrate(
        &mut self,
        tolerance: f64,
        fixed: Fixed<'_>,
        u: &mut [[f64; 3]],
        independent: &mut [Dilatation],
        fluid: Option<&mut FluidState>,
    ) -> Result<(), StepError> {
        if let Some(fluid) = fluid {
            return self.equilibrate_with_fluid(tolerance, fixed, u, fluid);
        }
        self.evaluate(fixed, u, independent)?;
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
            self.assemble(fixed, u, independent)?;
            let mixed = !independent.is_empty();
            let mut forcing = Self::forcing(norm, previous, tolerance * reference, mixed);
            if mixed {
                let share = self.current.mixed_norm / norm;
                forcing = super::mixed::forcing(forcing, share, tolerance * reference / norm);
            }
            previous = norm;
            self.solve_step(fixed.loading, forcing, mixed);
            if self.effort.indefinite_factorizations > self.indefinite_end {
                return Err(StepError::Indefinite { residual: norm / reference });
            }
            match self.line_search(fixed, u, independent) {
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
        for (v, &e) in u.as_flattened().iter().zip(&self.problem.system.dofs.of_dof) {
            if e != DofMap::FIXED {
                unknowns[e as usize] = *v;
            }
        }
        f64::EPSILON * self.problem.system.absolute_product_norm(&self.tangent, &unknowns)
    }

    /// How exactly to solve the linear system: no more than its model of the
    /// body is worth (Eisenstat & Walker 1996, choice 2), nor than is asked of
    /// the residual in the end. With dilatations as unknowns of their own what a step misses is
    /// mostly contact, and less exact steps get as far.
    fn forcing(norm: f64, previous: f64, target: f64, mixed: bool) -> f64 {
        let (first, gamma) = if mixed { (1e-2, 0.5) } else { (1e-3, 0.1) };
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
        independent: &[Dilatation],
    ) -> Result<(), StepError> {
        self.evaluate_with(fixed, u, independent, false)
    }

    /// Evaluates at `u` into `current`, with the tangent if it is wanted.
    fn evaluate_with(
        &mut self,
        fixed: Fixed<'_>,
        u: &[[f64; 3]],
        independent: &[Dilatation],
        with_tangent: bool,
    ) -> Result<(), StepError> {
        if self.stop.as_ref().is_some_and(|stop| stop.load(Ordering::Relaxed)) {
            return Err(StepError::Stopped);
        }
        let clock = Instant::now();
        let trial = fixed.trial(u, independent, self.penalty);
        let tangent = with_tangent.then_some(&mut self.tangent);
        let result = evaluate_body(self.problem, fixed.loading, &trial, tangent, &mut self.current);
        self.effort.assemble_s += clock.elapsed().as_secs_f64();
        result
    }
}

/// A force typical of the body: its soft regions' shear modulus times its extent squared.
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
    problem.reference_modulus_mpa() * extent * extent
}
