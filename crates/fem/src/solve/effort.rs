//! What a solve costs, in counts and in time.

/// Work and wall time spent, summed over a solve.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Effort {
    /// Newton iterations.
    pub newton_iterations: u32,
    /// Numeric factorizations.
    pub factorizations: u32,
    /// Factorizations of an indefinite tangent among them.
    pub indefinite_factorizations: u32,
    /// Conjugate-gradient iterations.
    pub cg_iterations: u32,
    /// Multiplier updates.
    pub augmentations: u32,
    /// Halved load steps.
    pub cuts: u32,
    /// Equilibria found.
    pub steps: u32,
    /// Halved Newton steps.
    pub backtracks: u32,
    /// Elements and contact, s.
    pub assemble_s: f64,
    /// Numeric factorization, s.
    pub factor_s: f64,
    /// Conjugate gradients and direct solves, s.
    pub solve_s: f64,
}

impl Effort {
    /// The sum with another reading.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            newton_iterations: self.newton_iterations + other.newton_iterations,
            factorizations: self.factorizations + other.factorizations,
            indefinite_factorizations: self.indefinite_factorizations
                + other.indefinite_factorizations,
            cg_iterations: self.cg_iterations + other.cg_iterations,
            augmentations: self.augmentations + other.augmentations,
            cuts: self.cuts + other.cuts,
            steps: self.steps + other.steps,
            backtracks: self.backtracks + other.backtracks,
            assemble_s: self.assemble_s + other.assemble_s,
            factor_s: self.factor_s + other.factor_s,
            solve_s: self.solve_s + other.solve_s,
        }
    }

    /// The difference to an earlier reading.
    #[must_use]
    pub fn since(&self, earlier: &Self) -> Self {
        Self {
            newton_iterations: self.newton_iterations - earlier.newton_iterations,
            factorizations: self.factorizations - earlier.factorizations,
            indefinite_factorizations: self.indefinite_factorizations
                - earlier.indefinite_factorizations,
            cg_iterations: self.cg_iterations - earlier.cg_iterations,
            augmentations: self.augmentations - earlier.augmentations,
            cuts: self.cuts - earlier.cuts,
            steps: self.steps - earlier.steps,
            backtracks: self.backtracks - earlier.backtracks,
            assemble_s: self.assemble_s - earlier.assemble_s,
            factor_s: self.factor_s - earlier.factor_s,
            solve_s: self.solve_s - earlier.solve_s,
        }
    }
}
