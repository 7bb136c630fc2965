//! What is told of a stored equilibrium.

use super::Pressed;
use crate::simulation::maps::FingerMaps;
use crate::simulation::sample;
use papilla_atlas::PA_PER_MPA;
use papilla_dataset::Checks;
use papilla_fem::contact::ContactRule;
use papilla_fem::solve::Effort;
use serde::Serialize;

/// One stored equilibrium as `summary.json` has it.
#[derive(Clone, Debug, Serialize)]
pub struct Increment {
    /// From first touch, mm.
    pub depth_mm: f64,
    /// Of the indenter on the body, N.
    pub force_n: [f64; 3],
    /// Greatest on the contact surface.
    pub pressure_pa_max: f64,
    /// Absent for a body without an interface between epidermis and dermis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sed_dermis_j_per_m3_max: Option<f64>,
    /// The same of the epidermis side.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sed_epidermis_j_per_m3_max: Option<f64>,
    /// Energy that can be got back.
    pub stored_energy_mj: f64,
    /// Share of the volume beyond the calibrated stretches of its law.
    pub outside_calibration: f64,
    /// Where on the skin contact was found.
    pub contact: ContactRule,
    /// Self-checks.
    pub checks: Checks,
    /// Block of the mesh and element in it where J is smallest.
    pub j_min_at: [usize; 2],
    /// The tangent's condition number is at least this; absent if only an indefinite one was
    /// factorized.
    pub condition_at_least: Option<f64>,
    /// Work of the solver.
    pub effort: Effort,
    /// Wall time.
    pub seconds: f64,
    /// Why this state is none to rely on: it would not enter a dataset, or its contact rests on too few
    /// nodes; absent if it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fault: Option<String>,
}

impl Increment {
    /// Of a state; `maps` are those of its finger.
    #[must_use]
    pub fn of(pressed: &Pressed, maps: Option<&FingerMaps>) -> Self {
        let Pressed { record, report, pressure_mpa_max, doubt } = pressed;
        let own = || sample::fault(record, record.pressure_mpa.len());
        let max = |v: &[f64]| {
            let largest = PA_PER_MPA * v.iter().copied().fold(0.0, f64::max);
            (!v.is_empty()).then_some(largest)
        };
        Self {
            depth_mm: record.depth_mm,
            force_n: record.force_n,
            pressure_pa_max: PA_PER_MPA * pressure_mpa_max,
            sed_dermis_j_per_m3_max: max(&record.sed_dermis_mpa),
            sed_epidermis_j_per_m3_max: max(&record.sed_epidermis_mpa),
            stored_energy_mj: report.stored_mj,
            outside_calibration: record.outside_calibration,
            contact: record.contact,
            checks: record.checks,
            j_min_at: report.j_min_at,
            condition_at_least: Some(report.condition_at_least).filter(|c| c.is_finite()),
            effort: report.effort,
            seconds: record.seconds,
            fault: maps.map_or_else(own, |maps| maps.fault(record)).or_else(|| doubt.clone()),
        }
    }
}
