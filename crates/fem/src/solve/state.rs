//! Equilibria: what makes one and how one is told of.

use super::effort::Effort;
use super::fluid::FluidState;
use super::work::Work;
use crate::contact::FrictionTrial;
use crate::element::Dilatation;
use serde::{Deserialize, Serialize};

/// An equilibrium, or the start of the search for one.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct State {
    pub fraction: f64,
    pub u: Vec<[f64; 3]>,
    /// Dilatation of each element that is kept as an unknown of its own; empty if none is.
    pub independent: Vec<Dilatation>,
    pub multipliers: Vec<f64>,
    /// History of viscoelastic materials; empty if there are none.
    pub history: Vec<f64>,
    /// Tangential contact; no points without friction.
    pub friction: FrictionTrial,
    /// The fluid's pressure; `None` without fluid.
    pub fluid: Option<FluidState>,
}

/// A place to go back to, see [`Solver::mark`].
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Mark {
    pub(super) state: State,
    pub(super) before: Option<State>,
    pub(super) work: Work,
}

/// One equilibrium.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct StepReport {
    /// Load fraction.
    pub load_fraction: f64,
    /// Out-of-balance force over the reference norm.
    pub residual_relative: f64,
    /// Largest |gap| of a point in contact, mm.
    pub gap_error_mm: f64,
    /// Energy that can be got back, mJ.
    pub stored_mj: f64,
    /// Energy that viscoelastic materials and friction have turned into heat, mJ.
    pub dissipated_mj: f64,
    /// Smallest `J`.
    pub j_min: f64,
    /// Block of the mesh and element in it where it is.
    pub j_min_at: [usize; 2],
    /// The tangent's condition number is at least this, by the diagonal of its last
    /// Cholesky factor; not a number if there has been none.
    pub condition_at_least: f64,
    /// Work since the last report.
    pub effort: Effort,
    /// What of it found equilibria for the indenter's work alone ([`super::Solver::mend_work`]).
    pub mending: Effort,
    /// What of it was on a coarser mesh ([`super::Solver::advance_from`]).
    pub guiding: Effort,
}
