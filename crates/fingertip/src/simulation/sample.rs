//! What a dataset takes of an equilibrium, and whether it is good enough for one.

use super::record::IncrementRecord;
use papilla_dataset::Sample;

/// What a dataset holds of a record.
#[must_use]
pub fn of(record: &IncrementRecord) -> Sample {
    Sample {
        cells: None,
        depth_mm: record.depth_mm,
        slide_mm: [0.0; 2],
        force_n: record.force_n,
        pressure_mpa: record.pressure_mpa.clone(),
        sed_dermis_mpa: record.sed_dermis_mpa.clone(),
        sed_epidermis_mpa: record.sed_epidermis_mpa.clone(),
        shear_mpa: record.shear_mpa.clone(),
        outside_calibration: record.outside_calibration,
        checks: record.checks,
    }
}

/// Why a record must not enter a dataset of `vertex_count` vertices; `None` when it is fit.
#[must_use]
pub fn fault(record: &IncrementRecord, vertex_count: usize) -> Option<String> {
    papilla_dataset::fault(&of(record), vertex_count)
}
