//! What one indentation hands to those who store it: checks, pose and vertex values.

use papilla_dataset::Checks;
use papilla_fem::contact::ContactRule;

/// One stored equilibrium of an indentation: values at the atlas' vertices.
///
/// MPa = N/mm2 = mJ/mm3 inside the FE code; the dataset stores Pa and J/m3.
#[derive(Clone, Debug)]
pub struct IncrementRecord {
    /// Indentation depth from first touch, mm.
    pub depth_mm: f64,
    /// Time since first touch, s; 0 where time plays no part.
    pub time_s: f64,
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
    /// Where on the skin contact was found.
    pub contact: ContactRule,
    /// Self-checks of this equilibrium.
    pub checks: Checks,
    /// Wall time of this increment, s.
    pub seconds: f64,
}

/// Relative L2 difference of a field from a reference, `|a - b| / |b|`; not a number
/// for fields of different lengths.
#[must_use]
pub fn relative_l2(a: &[f64], b: &[f64]) -> f64 {
    if a.len() != b.len() {
        return f64::NAN;
    }
    let square: f64 = a.iter().zip(b).map(|(x, y)| (x - y).powi(2)).sum();
    (square / b.iter().map(|y| y * y).sum::<f64>()).sqrt()
}
