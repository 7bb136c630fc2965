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
        let pressure_mpa = if part < 1.0 { Vec::new() } else { now.pressure_mpa.clone() };
        Guess { displacement_mm, dilatation, pressure_mpa }
    }
}

fn on_own_mesh(guide: &Solver<'_>, transfer: &Transfer) -> Guess {
    let pressure = edge_field(guide);
    Guess {
        displacement_mm: transfer.nodal(guide.displacement_mm()),
        dilatation: transfer.linear(guide.independent_dilatation()),
        pressure_mpa: transfer.nodal(&pressure).iter().map(|p| if std::env::var_os("PAPILLA_BY_P").is_some() { p[1] } else { p[0] }).collect(),
    }
}

/// What is positive where the guide touches and negative where it does not, about linear across the
/// edge of contact: pressure grows as the root of the distance to the edge, the gap as its power 3/2.
fn edge_field(guide: &Solver<'_>) -> Vec<[f64; 3]> {
    let mut field = vec![[0.0; 3]; guide.displacement_mm().len()];
    let problem = guide.problem();
    let Some(contact) = &problem.contact else { return field };
    let x = guide.deformed();
    let mut known = vec![false; field.len()];
    for (&n, p) in contact.nodes().iter().zip(guide.traction_mpa()) {
        let n = n as usize;
        known[n] = true;
        field[n][1] = p;
        field[n][0] = if p > 0.0 {
            p * p
        } else {
            -guide.distance(x[n]).map_or(0.0, |d| d.gap_mm.max(0.0).powf(2.0 / 3.0))
        };
    }
    let Some(surface) = problem.mesh.surfaces.get("skin") else { return field };
    let per = surface.kind.nodes();
    let (mut inside, mut outside) = ((0.0, 0.0), (0.0, 0.0));
    for face in surface.connectivity.chunks_exact(per) {
        let values = || face.iter().map(|&n| field[n as usize][0]);
        if values().any(|v| v > 0.0) && values().any(|v| v < 0.0) {
            for v in values() {
                let of = if v > 0.0 { &mut inside } else { &mut outside };
                *of = (of.0 + v.abs(), of.1 + 1.0);
            }
        }
    }
    let scale = (inside.0 / inside.1) / (outside.0 / outside.1);
    tracing::info!(scale, edge = inside.1 + outside.1, "edge of the guide's contact");
    for v in &mut field {
        if v[0] < 0.0 {
            v[0] *= scale;
        }
    }
    let most = field.iter().map(|v| v[0]).fold(0.0, f64::max);
    field.iter_mut().for_each(|v| v[0] /= most);
    field
}
