//! What a dataset holds of one equilibrium.

use ndarray::Array2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Self-checks of one equilibrium; dimensionless unless the name says otherwise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Checks {
    /// Norm of the out-of-balance force over the norm of contact, dead and support forces.
    pub residual_relative: f64,
    /// |integral of the recorded p dA - plate reaction| over the plate reaction: the contact beyond
    /// the recorded skin. Where all of it is recorded the two are equal by construction.
    pub contact_force_vs_pressure_integral: f64,
    /// |plate reaction - support reaction| over the plate reaction.
    pub plate_vs_support_reaction: f64,
    /// |stored energy - external work| over the largest external work so far.
    pub energy_vs_work: f64,
    /// Smallest volume ratio J at any quadrature point.
    pub j_min: f64,
    /// Deepest penetration of the skin into the indenter, mm.
    pub penetration_mm_max: f64,
    /// Newton iterations spent on this increment.
    pub newton_iterations: u32,
    /// How often the load step was halved on the way.
    pub step_cuts: u32,
    /// Augmentations of the contact multipliers.
    pub augmentations: u32,
    /// Numeric factorizations of the tangent.
    pub factorizations: u32,
    /// Iterations of conjugate gradients, summed over all solves.
    pub cg_iterations: u32,
}

/// Cells of the skin on a fixed lattice ([`crate`]), with nodes at which a field is known:
/// within a cell SED is the quadratic through its nine nodes, pressure linear between
/// neighbouring ones.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cells {
    /// Side of the half cube, first row, first column, rows, columns.
    pub place: Vec<[u32; 5]>,
    /// Nodes row by row.
    pub nodes: Vec<[u32; 9]>,
}

impl Cells {
    /// From arrays \[L, 5\] and \[L, 9\]; `None` of other shapes.
    #[must_use]
    pub fn from_arrays(place: &Array2<u32>, nodes: &Array2<u32>) -> Option<Self> {
        let fit = place.ncols() == 5 && nodes.dim() == (place.nrows(), 9);
        fit.then(|| Self {
            place: place.outer_iter().map(|row| std::array::from_fn(|k| row[k])).collect(),
            nodes: nodes.outer_iter().map(|row| std::array::from_fn(|k| row[k])).collect(),
        })
    }

    /// Nodes S: one more than the greatest number.
    #[must_use]
    pub fn node_count(&self) -> usize {
        self.nodes.iter().flatten().max().map_or(0, |n| *n as usize + 1)
    }
}

/// One equilibrium on its way into a shard: values at the atlas' vertices, or at nodes of cells.
///
/// MPa = N/mm2 = mJ/mm3, as finite elements have them; a shard stores Pa and J/m3.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Sample {
    /// Where values are known; `None`: at the atlas' vertices. Below, V is their number. Not
    /// serialised: all samples of an indentation share it.
    #[serde(skip)]
    pub cells: Option<Arc<Cells>>,
    /// Indentation depth from first touch, mm.
    pub depth_mm: f64,
    /// Where the indenter has slid to, mm along its own x and y.
    #[serde(default)]
    pub slide_mm: [f64; 2],
    /// Force of the plate on the finger in the finger's frame, N.
    pub force_n: [f64; 3],
    /// True contact pressure at the skin patch's vertices, MPa; length V.
    pub pressure_mpa: Vec<f64>,
    /// SED on the dermis side at the interface patch's vertices, MPa; length V.
    pub sed_dermis_mpa: Vec<f64>,
    /// SED on the epidermis side at the interface patch's vertices, MPa; length V.
    pub sed_epidermis_mpa: Vec<f64>,
    /// True shear traction of the indenter on the skin patch's vertices in the
    /// finger's frame, MPa per deformed area; length V, empty without friction.
    pub shear_mpa: Vec<[f64; 3]>,
    /// Share of the volume that has left the stretches to which its law was fitted;
    /// 0 for laws that hold anywhere.
    pub outside_calibration: f64,
    /// Self-checks of this equilibrium.
    pub checks: Checks,
}

/// Orientation of the plate relative to the finger.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Pose {
    /// Pitch about y (lateral), degrees; tip first is positive.
    pub pitch_deg: f64,
    /// Roll about x (the finger's axis), degrees.
    pub roll_deg: f64,
    /// Yaw about the plate's normal, degrees.
    pub yaw_deg: f64,
}
