//! Static equilibrium: Newton with line search, augmented contact, load steps.

mod augmented;
mod effort;
pub mod evaluate;
mod fluid;
mod friction;
mod guided;
mod history;
mod history_layout;
mod loading;
mod mixed;
mod newton;
mod prediction;
mod pressure;
mod problem;
mod results;
mod rigid_modes;
mod sides;
mod snapshot;
mod state;
mod stepping;
mod tension;
mod time_step;
mod work;

pub use crate::element::Materials;
pub use effort::Effort;
pub use evaluate::Balance;
pub use guided::Guess;
pub use history::EnergySplit;
pub use history_layout::HistoryLayout;
pub use loading::{Loading, MovingIndenter};
pub use pressure::{SurfacePressure, SurfacePressureError};
pub use problem::{Problem, ProblemError};
pub use rigid_modes::{FreeMode, FreePart};
pub use snapshot::{Snapshot, SnapshotError};
pub use state::{Mark, StepReport};
pub use stepping::Solver;
pub use tension::{SurfaceTension, SurfaceTensionError};

use crate::linear::FactorError;

/// Tolerances and limits; every loop is bounded by one of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Out-of-balance force over the norm of external and support forces.
    pub residual_tolerance: f64,
    /// Largest |gap| of a node in contact, mm.
    pub gap_tolerance_mm: f64,
    /// Contact penalty, MPa/mm; chosen from the material and mesh if `None`.
    pub penalty_mpa_per_mm: Option<f64>,
    /// Newton iterations per contact multiplier update.
    pub newton_max: u32,
    /// Updates of the contact multipliers per load step.
    pub augmentations_max: u32,
    /// Halvings of one load increment before the solve is given up.
    pub cuts_max: u32,
    /// Load steps of one increment before the solve is given up.
    pub steps_max: u32,
    /// Iterations of conjugate gradients after which the tangent is factorized afresh.
    pub cg_max: u32,
    /// A linear solve that needed more than this makes the next one refactorize.
    pub refactor_after_cg: u32,
    /// Backtracking steps of the line search.
    pub line_search_max: u32,
    /// Updates of normal and tangential multipliers per load step with friction.
    pub friction_updates_max: u32,
    /// Change of tangential traction between two updates over the largest bound,
    /// below which friction has settled.
    pub friction_tolerance: f64,
    /// How far linear extrapolation over a time step may miss, over the largest
    /// displacement; viscoelastic and biphasic bodies only. Infinite: biphasic bodies take the
    /// steps that are asked for.
    pub time_error: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            residual_tolerance: 1e-6,
            gap_tolerance_mm: 1e-4,
            penalty_mpa_per_mm: None,
            newton_max: 40,
            augmentations_max: 12,
            cuts_max: 10,
            steps_max: 10_000,
            cg_max: 60,
            refactor_after_cg: 8,
            line_search_max: 12,
            friction_updates_max: 40,
            friction_tolerance: 1e-3,
            time_error: 2e-3,
        }
    }
}

/// Why one load step did not converge; the stepper cuts the step on it.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum StepError {
    /// An element turns inside out already at the start of the iteration.
    #[error("element {element} of block {block} turned inside out (J = {j:.3e})")]
    Inverted {
        /// Mesh block.
        block: usize,
        /// Element of the block.
        element: usize,
        /// Volume ratio.
        j: f64,
    },
    /// Newton ran out of iterations.
    #[error("Newton stopped after {iterations} iterations at relative residual {residual:.3e}")]
    Newton {
        /// Iterations done.
        iterations: u32,
        /// Relative residual reached.
        residual: f64,
    },
    /// Tangent after tangent is indefinite: the start is beside no stable equilibrium.
    #[error("tangents stay indefinite at relative residual {residual:.3e}")]
    Indefinite {
        /// Relative residual where it was given up.
        residual: f64,
    },
    /// The line search found no acceptable step.
    #[error("line search failed at relative residual {residual:.3e}")]
    LineSearch {
        /// Relative residual where it failed.
        residual: f64,
    },
    /// Contact multipliers did not settle.
    #[error(
        "contact did not settle in {augmentations} augmentations: gap error {gap_mm:.3e} mm. Where the \
         indenter is sharper than the mesh is fine, nodes jump from one of its sides to the other: \
         refine the mesh or round the indenter"
    )]
    Contact {
        /// Augmentations done.
        augmentations: u32,
        /// Largest |gap| of a node in contact, mm.
        gap_mm: f64,
    },
    /// Friction did not settle.
    #[error(
        "friction did not settle in {updates} updates: the last changed traction by {change:.1e} of its bound"
    )]
    Friction {
        /// Updates done.
        updates: u32,
        /// Last change of traction or bound over the largest bound.
        change: f64,
    },
    /// Displacement and fluid pressure do not follow from each other.
    #[error("the system of displacement and fluid pressure is singular")]
    Singular,
    /// Energy or force is not a finite number.
    #[error("energy or force is not finite")]
    NotFinite,
    /// See [`Solver::stop_when`].
    #[error("stopped from outside")]
    Stopped,
}

/// Why a solve was given up.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum SolveError {
    /// The load step was cut as often as allowed.
    #[error(
        "no equilibrium beyond load fraction {reached:.6} after {cuts} cuts of the step: {cause}"
    )]
    CutsExhausted {
        /// Last load fraction in equilibrium.
        reached: f64,
        /// Cuts done.
        cuts: u32,
        /// Error of the last try.
        cause: StepError,
    },
    /// Viscoelastic materials asked for ever more and shorter time steps.
    #[error("no end in sight at load fraction {reached:.6} after {steps} load steps")]
    StepsExhausted {
        /// Last load fraction in equilibrium.
        reached: f64,
        /// Steps done.
        steps: u32,
    },
    /// Whoever watches the solve wants no more of it, see [`Solver::stop_when`].
    #[error("stopped from outside at load fraction {reached:.6}")]
    Stopped {
        /// Last load fraction in equilibrium.
        reached: f64,
    },
    /// The factor does not fit in memory.
    #[error(transparent)]
    Factor(#[from] FactorErrorText),
    /// A part of the body can move freely.
    #[error(transparent)]
    RigidBodyMode(#[from] FreePart),
}

/// [`FactorError`] as a value that can be cloned and compared.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
#[error("{0}")]
pub struct FactorErrorText(String);

impl From<FactorError> for SolveError {
    fn from(e: FactorError) -> Self {
        Self::Factor(FactorErrorText(e.to_string()))
    }
}
