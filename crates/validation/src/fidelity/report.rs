//! What `rungs.json` says.

use super::Strain;
use papilla_fingertip::mesh::fingertip::{Density, Order};
use papilla_fingertip::scene::Pose;
use serde::Serialize;

/// Version of the files.
pub(super) const FORMAT: u32 = 1;

/// One state that every fidelity level solved.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StateEntry {
    /// Indentation of the campaign.
    pub press: usize,
    /// Name of its indenter.
    pub indenter: String,
    /// Name of the indenter's shape.
    pub shape: String,
    /// Depth, mm.
    pub depth_mm: f64,
    /// Orientation.
    #[serde(flatten)]
    pub pose: Pose,
}

/// A state that is missing because a fidelity level has no sound solution of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LeftOut {
    /// Indentation of the campaign.
    pub press: usize,
    /// Depth, mm.
    pub depth_mm: f64,
    /// The fidelity level.
    #[serde(rename = "rung")]
    pub level: String,
    /// What happened.
    pub why: String,
}

/// Median and 95th percentile.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Quantiles {
    /// Median.
    pub median: f64,
    /// 95th percentile.
    pub p95: f64,
}

/// How far the reference is from the truth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DiscretisationError {
    /// Median over states of the relative L2 difference of SED from the check.
    pub sed_relative_l2: f64,
    /// 95th percentile of the same.
    pub sed_relative_l2_p95: f64,
    /// The same of pressure.
    pub pressure_relative_l2: f64,
    /// Indentations and states that were checked.
    pub presses: Vec<usize>,
    /// States.
    pub states: usize,
    /// Unknowns of the check, and median seconds a state.
    pub unknowns: usize,
    /// Median processor seconds a state of the check.
    pub seconds_median: f64,
    /// How it was found.
    pub how: String,
}

/// One fidelity level of `rungs.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LevelEntry {
    /// Name.
    pub name: String,
    /// Mesh density.
    pub density: Density,
    /// Order of the elements.
    pub order: Order,
    /// Small or finite strain.
    pub kinematics: Strain,
    /// Unknowns.
    pub unknowns: usize,
    /// Entries of the factor.
    pub factor_entries: usize,
    /// Whether it is what the others are compared with.
    pub reference: bool,
    /// Processor seconds of mesh and symbolic factorization, once a finger.
    pub setup_seconds: f64,
    /// Processor seconds from the start of the indentation to each state.
    pub seconds: Vec<f64>,
    /// Archive beside `rungs.json`.
    pub file: String,
    /// Relative L2 difference of SED from the reference over the vertices.
    pub sed_relative_l2: Quantiles,
    /// The same of pressure.
    pub pressure_relative_l2: Quantiles,
    /// Of the reference only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub discretisation_error: Option<DiscretisationError>,
}

/// `rungs.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Version of this format.
    pub format: u32,
    /// Program and version.
    pub software: &'static str,
    /// Hash of the atlas whose vertices the arrays are over.
    pub atlas_hash: String,
    /// Campaign.
    pub campaign: String,
    /// States, row by row of every archive.
    pub states: Vec<StateEntry>,
    /// Fidelity levels.
    #[serde(rename = "rungs")]
    pub levels: Vec<LevelEntry>,
    /// States that are in no archive.
    pub left_out: Vec<LeftOut>,
}

impl Quantiles {
    /// Of some values, linear between them; not a number if there are none.
    pub(super) fn of(values: impl Iterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = values.collect();
        sorted.sort_by(f64::total_cmp);
        let at = |q: f64| {
            let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
            let place = q * last as f64;
            let (low, part) = (place.floor() as usize, place.fract());
            sorted[low] + part * (sorted[(low + 1).min(last)] - sorted[low])
        };
        Self { median: at(0.5), p95: at(0.95) }
    }
}
