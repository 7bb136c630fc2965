//! The way to a state on a coarse mesh, so that the fine one starts beside its equilibrium.
//!
//! A press on the fine mesh alone spends most of its time on the way: equilibria between stored
//! states, Newton iterations in which the contact grows. The guide has the layers of the fine mesh
//! and larger cells along the skin; it goes that way at a tenth of the price.

use super::body::{Guide, SimulationError};
use crate::mesh::Transfer;
use papilla_fem::solve::{Effort, Guess, Loading, MovingIndenter, Options, Solver};

/// A guide on its way.
pub(super) struct Guided<'a> {
    pub solver: Solver<'a>,
    transfer: &'a Transfer,
    /// From the state before to the present one.
    pub effort: Effort,
}

impl<'a> Guided<'a> {
    /// About to press.
    pub(super) fn new(guide: &'a Guide, indenter: MovingIndenter) -> Result<Self, SimulationError> {
        let mut solver = guide.body.solver(Options::default())?;
        solver.start(Loading { indenter: Some(indenter), ..Loading::default() });
        Ok(Self { solver, transfer: &guide.transfer, effort: Effort::default() })
    }

    /// Where the body's own mesh goes, by the guide's equilibrium.
    pub(super) fn guess(&self) -> Guess {
        Guess {
            displacement_mm: self.transfer.nodal(self.solver.displacement_mm()),
            dilatation: self.transfer.linear(self.solver.independent_dilatation()),
        }
    }
}
