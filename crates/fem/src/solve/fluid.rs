//! The fluid of a body over a step: where it starts, where it has come to, what it has lost.

use super::problem::Problem;
use crate::biphasic::{Flow, Older};
use serde::{Deserialize, Serialize};

/// The fluid at an equilibrium, or on the way to the next.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct FluidState {
    /// Pressure, MPa, one a pressure unknown.
    pub pressure_mpa: Vec<f64>,
    /// Displacement of the nodes at the last equilibrium, mm.
    start_mm: Vec<[f64; 3]>,
    /// That at the equilibrium before, and the present step over the last; on the way only.
    older: Option<(Vec<[f64; 3]>, f64)>,
    /// Energy that it has lost by friction as it flowed, mJ.
    pub lost_mj: f64,
}

impl FluidState {
    pub(super) fn flow(&self) -> Flow<'_> {
        let older = self.older.as_ref().map(|(mm, ratio)| Older { start_mm: mm, ratio: *ratio });
        Flow { pressure_mpa: &self.pressure_mpa, start_mm: &self.start_mm, older }
    }
}

/// The fluid of a body at rest; `None` of a body without.
pub(super) fn at_rest(problem: &Problem) -> Option<FluidState> {
    problem.fluid.as_ref().map(|phase| FluidState {
        pressure_mpa: vec![0.0; phase.unknowns()],
        start_mm: vec![[0.0; 3]; problem.mesh.nodes.len()],
        older: None,
        lost_mj: 0.0,
    })
}

/// A step begins from a copy of the last equilibrium: the displacement at the one before it, if the
/// load has not turned since, and the step over the last.
pub(super) fn begin(trial: &mut Option<FluidState>, before: Option<(&[[f64; 3]], f64)>) {
    if let (Some(fluid), Some((u, ratio))) = (trial, before) {
        fluid.older = Some((u.to_vec(), ratio));
    }
}

/// The step from the fluid `last` to the displacement `u` is done.
pub(super) fn advance(
    problem: &Problem,
    last: Option<&FluidState>,
    u: &[[f64; 3]],
    found: &mut Option<FluidState>,
) {
    let (Some(phase), Some(last), Some(fluid)) = (&problem.fluid, last, found) else { return };
    fluid.lost_mj += phase.lost_mj(problem.solid(), u, fluid.flow(), &last.pressure_mpa);
    fluid.start_mm.copy_from_slice(u);
    fluid.older = None;
}
