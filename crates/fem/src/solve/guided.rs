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
        let found = self.augmented(target, &mut trial);
        self.newton.indefinite_end = u32::MAX;
        found?;
        self.accept(target, trial);
        Ok(())
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
