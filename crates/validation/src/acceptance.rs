//! Whether an equilibrium is good enough for a dataset.

use papilla_dataset::{Checks, Sample};
use papilla_fingertip::simulation::record::IncrementRecord;

/// What a dataset holds of a record.
#[must_use]
pub fn sample(record: &IncrementRecord) -> Sample {
    let c = record.checks;
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
        checks: Checks {
            residual_relative: c.residual_relative,
            contact_force_vs_pressure_integral: c.contact_force_vs_pressure_integral,
            plate_vs_support_reaction: c.plate_vs_support_reaction,
            energy_vs_work: c.energy_vs_work,
            j_min: c.j_min,
            penetration_mm_max: c.penetration_mm_max,
            newton_iterations: c.newton_iterations,
            step_cuts: c.step_cuts,
            augmentations: c.augmentations,
            factorizations: c.factorizations,
            cg_iterations: c.cg_iterations,
        },
    }
}

/// Why a record must not enter a dataset of `vertex_count` vertices; `None` when it is fit.
#[must_use]
pub fn fault(record: &IncrementRecord, vertex_count: usize) -> Option<String> {
    papilla_dataset::fault(&sample(record), vertex_count)
}
