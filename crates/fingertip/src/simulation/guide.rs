//! The way to a state on a coarse mesh, so that the fine one starts beside its equilibrium.
//!
//! A press on the fine mesh alone spends most of its time on the way: equilibria between stored
//! states, Newton iterations in which the contact grows. The guide has the layers of the fine mesh
//! and larger cells along the skin; it goes that way at a tenth of the price.

use super::body::{Guide, SimulationError};
use crate::mesh::Transfer;
use papilla_fem::solve::{Effort, Guess, Loading, MovingIndenter, Options, Solver};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// A guide on its way.
pub(super) struct Guided<'a> {
    pub solver: Solver<'a>,
    transfer: &'a Transfer,
    /// From the state before to the present one.
    pub effort: Effort,
    /// The present state on the body's own mesh, and the one before.
    states: [Guess; 2],
}

impl<'a> Guided<'a> {
    /// About to press.
    pub(super) fn new(
        guide: &'a Guide,
        indenter: MovingIndenter,
        stop: Option<Arc<AtomicBool>>,
    ) -> Result<Self, SimulationError> {
        let mut solver = guide.body.solver(Options::default())?;
        solver.stop_when(stop);
        solver.start(Loading { indenter: Some(indenter), ..Loading::default() });
        let transfer = &guide.transfer;
        let at_rest = on_own_mesh(&solver, transfer);
        let states = [at_rest.clone(), at_rest];
        Ok(Self { solver, transfer, effort: Effort::default(), states })
    }

    /// Takes notice of the state that the guide has come to.
    pub(super) fn arrive(&mut self, effort: Effort) {
        self.effort = effort;
        self.states.swap(0, 1);
        self.states[0] = on_own_mesh(&self.solver, self.transfer);
    }

    /// Where the body, which was beside the guide before, goes: a part of the guide's way. What
    /// its own mesh resolved stays; the guide's whole displacement would lose it, and on a mesh much
    /// finer than its own turns elements inside out where an edge presses.
    pub(super) fn guess(&self, body: &Solver<'_>, part: f64) -> Guess {
        let [now, before] = &self.states;
        let mut displacement_mm = body.displacement_mm().to_vec();
        let moved = now.displacement_mm.iter().zip(&before.displacement_mm);
        for (u, (now, before)) in displacement_mm.iter_mut().zip(moved) {
            *u = [0, 1, 2].map(|i| u[i] + part * (now[i] - before[i]));
        }
        let mut dilatation = body.independent_dilatation().to_vec();
        let moved = now.dilatation.iter().zip(&before.dilatation);
        for (t, (now, before)) in dilatation.iter_mut().zip(moved) {
            *t = [0, 1, 2, 3].map(|i| t[i] + part * (now[i] - before[i]));
        }
        Guess { displacement_mm, dilatation }
    }
}

fn on_own_mesh(guide: &Solver<'_>, transfer: &Transfer) -> Guess {
    Guess {
        displacement_mm: transfer.nodal(guide.displacement_mm()),
        dilatation: transfer.linear(guide.independent_dilatation()),
    }
}
