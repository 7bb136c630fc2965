//! The way to a state on a coarse mesh, so that the fine one starts beside its equilibrium.
//!
//! A press on the fine mesh alone spends most of its time on the way: equilibria between stored
//! states, Newton iterations in which the contact grows. The guide has the layers of the fine mesh
//! and larger cells along the skin; it goes that way at a tenth of the price.

use super::body::{Body, SimulationError};
use super::drive::{Approach, Drive};
use crate::mesh::Transfer;
use papilla_fem::solve::{Effort, Guess, Loading, Options, Solver};

/// A coarser mesh of a body.
pub(super) struct Guide {
    pub body: Body,
    pub transfer: Transfer,
}

impl Body {
    /// The guide of this body, about to press; `None` if there is none or states depend on the
    /// way to them.
    pub(super) fn guided<'a>(
        &'a self,
        approach: &Approach,
        drive: &Drive,
    ) -> Result<Option<Guided<'a>>, SimulationError> {
        let depends = approach.friction > 0.0
            || self.problem.history_layout.is_some()
            || self.problem.fluid.is_some();
        let Some(guide) = self.guide.as_ref().filter(|_| !depends) else { return Ok(None) };
        let mut solver = guide.body.solver(Options::default())?;
        let indenter = Some(guide.body.indenter(approach, drive)?);
        solver.start(Loading { indenter, ..Loading::default() });
        Ok(Some(Guided { solver, transfer: &guide.transfer, effort: Effort::default() }))
    }
}

/// A guide on its way.
pub(super) struct Guided<'a> {
    pub solver: Solver<'a>,
    transfer: &'a Transfer,
    /// From the state before to the present one.
    pub effort: Effort,
}

impl Guided<'_> {
    /// Where the body's own mesh goes, by the guide's equilibrium.
    pub(super) fn guess(&self) -> Guess {
        Guess {
            displacement_mm: self.transfer.nodal(self.solver.displacement_mm()),
            dilatation: self.transfer.linear(self.solver.independent_dilatation()),
        }
    }
}
