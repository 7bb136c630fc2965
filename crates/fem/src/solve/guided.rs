//! Equilibria sought from a displacement that a coarser mesh found.
//!
//! What a path of small steps is for, to bring the skin to the indenter and the contact to its
//! size, a coarse mesh does as well. Newton's method on the fine one then starts beside the
//! equilibrium. Only where no state depends on the way to it: no viscosity, no friction.

use super::state::{State, StepReport};
use super::stepping::Solver;
use super::{Effort, StepError, mixed};
use crate::element::Dilatation;

/// Indefinite tangents on the way from a guess at most: beside a stable equilibrium there are none,
/// and each costs three factorizations.
const INDEFINITE_MAX: u32 = 5;

/// Where an equilibrium may be.
#[derive(Clone, Debug)]
pub struct Guess {
    /// Displacement, mm, one a node.
    pub displacement_mm: Vec<[f64; 3]>,
    /// Dilatation of each element, in its own basis, if it is known apart from the displacement:
    /// what is interpolated between nodes changes the volume of nearly incompressible elements,
    /// and the pressure of that would make the tangent indefinite.
    pub dilatation: Vec<Dilatation>,
    /// Pressure that is expected, MPa, one a node; empty if nothing is known of it.
    pub pressure_mpa: Vec<f64>,
}

impl Solver<'_> {
    /// Goes on to `target` in one step from what is close to the equilibrium there.
    ///
    /// # Errors
    /// What was spent where no equilibrium is found beside the guess; the state is then the one
    /// before, and [`Self::advance_to`] goes on by small steps.
    pub fn advance_from(&mut self, target: f64, guess: Guess) -> Result<StepReport, Effort> {
        let first = self.newton.effort;
        match self.try_guess(target, guess) {
            Ok(()) => {
                self.newton.effort.steps += 1;
                Ok(self.report(&first))
            }
            Err(cause) => {
                tracing::debug!(target, %cause, "no equilibrium beside the guess");
                self.newton.effort.cuts += 1;
                self.settle();
                Err(self.newton.effort.since(&first))
            }
        }
    }

    fn try_guess(&mut self, target: f64, guess: Guess) -> Result<(), StepError> {
        let mut trial = State { u: guess.displacement_mm, ..self.state.clone() };
        // What is held is so on this mesh, whatever the guess has there.
        for (v, held) in trial.u.as_flattened_mut().iter_mut().zip(&self.newton.problem.fixed) {
            if *held {
                *v = 0.0;
            }
        }
        self.prescribe(target, &mut trial.u);
        if trial.independent.len() == guess.dilatation.len() {
            trial.independent = guess.dilatation;
        } else if !trial.independent.is_empty() {
            trial.independent.clear();
            mixed::dilatations(self.newton.problem, &trial.u, &mut trial.independent);
        }
        self.newton.indefinite_end = self.newton.effort.indefinite_factorizations + INDEFINITE_MAX;
        self.expected = known(target).or_else(|| self.expected_at_points(&guess.pressure_mpa));
        if let (Some(expected), Some(real)) = (&self.expected, read(target, "PAPILLA_COMPARE")) {
            let count = |f: &dyn Fn(bool, bool) -> bool| expected.iter().zip(&real).filter(|(e, r)| f(**e > 0.0, **r > 0.0)).count();
            tracing::info!(both = count(&|e, r| e && r), too_many = count(&|e, r| e && !r), missing = count(&|e, r| !e && r), "expected contact");
        }
        let before = self.newton.effort;
        let found = self.augmented(target, &mut trial);
        let spent = self.newton.effort.since(&before);
        tracing::info!(target, ok = found.is_ok(), newton = spent.newton_iterations, factorizations = spent.factorizations,
            indefinite = spent.indefinite_factorizations, cg = spent.cg_iterations, assemble_s = spent.assemble_s,
            factor_s = spent.factor_s, solve_s = spent.solve_s, "beside a guess");
        if found.is_ok() { store(target, &self.newton.current.traction_mpa); }
        self.newton.indefinite_end = u32::MAX;
        found?;
        self.accept(target, trial);
        Ok(())
    }

    fn expected_at_points(&self, nodal_mpa: &[f64]) -> Option<Vec<f64>> {
        let tau: f64 = std::env::var("PAPILLA_TAU").ok()?.parse().ok()?;
        let surface = self.newton.problem.contact.as_ref()?;
        if nodal_mpa.is_empty() || self.contact_rule().has_multipliers() {
            return None;
        }
        let least = tau * nodal_mpa.iter().copied().fold(0.0, f64::max);
        let at = |(support, _): (crate::contact::Support<'_>, f64)| {
            let [p, ..] = support.of(|n| [nodal_mpa[n], 0.0, 0.0]);
            if p > least { p } else { 0.0 }
        };
        Some(surface.points(self.contact_rule()).iter().map(at).collect())
    }

    /// The dilatation of each element where it is an unknown of its own; else empty.
    #[must_use]
    pub fn independent_dilatation(&self) -> &[Dilatation] {
        &self.state.independent
    }

    /// Gives the force between the last two equilibria (the first is at rest) the course that it
    /// has in `guide`, which found both load fractions too: force and energy of the guide's
    /// equilibria in between, times what this body's are over the guide's at the ends.
    pub fn take_course(&mut self, guide: &Solver<'_>) {
        self.work.take_course(&guide.work);
    }
}

/// A trial: tractions that another run of the same scene ended with.
fn known(target: f64) -> Option<Vec<f64>> {
    read(target, "PAPILLA_EXPECTED")
}

fn read(target: f64, variable: &str) -> Option<Vec<f64>> {
    let folder = std::env::var_os(variable)?;
    let bytes = std::fs::read(std::path::Path::new(&folder).join(format!("{target:.12}"))).ok()?;
    Some(bytes.chunks_exact(8).map(|c| f64::from_le_bytes(c.try_into().unwrap_or_default())).collect())
}

fn store(target: f64, traction_mpa: &[f64]) {
    let Some(folder) = std::env::var_os("PAPILLA_STORE_EXPECTED") else { return };
    let bytes: Vec<u8> = traction_mpa.iter().flat_map(|t| t.to_le_bytes()).collect();
    if let Err(error) = std::fs::write(std::path::Path::new(&folder).join(format!("{target:.12}")), bytes) {
        tracing::warn!(%error, "not stored");
    }
}
