//! Compares the engine of the service with another engine on the same model.

use crate::{ExportError, read};
use ndarray::{Array3, Ix3};
use papilla_engine::{MAP_LEN, MAP_SIDE_PX, Session};
use papilla_output::OutputError;
use papilla_output::npz::NpzArrays;
use std::path::Path;

/// Difference allowed between two engines, relative to a map's maximum: what rounding
/// makes of sums over some hundred terms.
pub const TOLERANCE: f64 = 1e-5;

/// Inputs and outputs of a model that another engine recorded.
#[derive(Debug)]
pub struct Recorded {
    /// Pressure maps, Pa; `[n, 224, 224]`.
    pub pressure_pa: Array3<f32>,
    /// The other engine's answers, J/m3; `[n, 224, 224]`.
    pub sed_j_per_m3: Array3<f32>,
}

impl Recorded {
    /// Reads an `.npz` with `pressure_pa` and `sed_j_per_m3`, both float32 `[n, 224, 224]`.
    ///
    /// # Errors
    /// [`ExportError::Io`], [`ExportError::Reference`].
    pub fn read(path: &Path) -> Result<Self, ExportError> {
        let bad = |reason: String| ExportError::Reference { path: path.to_owned(), reason };
        let unreadable = |error: OutputError| bad(format!("unreadable: {error}"));
        let bytes = read(path)?;
        let mut npz = NpzArrays::new(path, &bytes).map_err(unreadable)?;
        let recorded = Self {
            pressure_pa: npz.get::<f32, Ix3>("pressure_pa").map_err(unreadable)?,
            sed_j_per_m3: npz.get::<f32, Ix3>("sed_j_per_m3").map_err(unreadable)?,
        };
        let (n, rows, columns) = recorded.pressure_pa.dim();
        if n == 0
            || (rows, columns) != (MAP_SIDE_PX, MAP_SIDE_PX)
            || recorded.sed_j_per_m3.dim() != (n, rows, columns)
        {
            return Err(bad(format!(
                "pressure_pa is {:?} and sed_j_per_m3 {:?}; both must be [n, 224, 224]",
                recorded.pressure_pa.dim(),
                recorded.sed_j_per_m3.dim()
            )));
        }
        if !recorded.sed_j_per_m3.iter().all(|v| v.is_finite()) {
            return Err(bad("sed_j_per_m3 is not finite".to_owned()));
        }
        Ok(recorded)
    }

    /// Greatest difference of `session` from the record over all samples, each relative to
    /// the record's maximum there.
    ///
    /// # Errors
    /// What the session reports, as [`ExportError::Engine`] with `model` as its path.
    pub fn difference(&self, session: &mut dyn Session, model: &Path) -> Result<f64, ExportError> {
        let mut answer = vec![0.0; MAP_LEN];
        let mut greatest = 0.0f64;
        for (pressure, expected) in
            self.pressure_pa.outer_iter().zip(self.sed_j_per_m3.outer_iter())
        {
            let pressure: Vec<f32> = pressure.iter().copied().collect();
            session.infer(&pressure, &mut answer).map_err(ExportError::engine(model))?;
            let expected: Vec<f32> = expected.iter().copied().collect();
            greatest = greatest.max(relative_difference(&answer, &expected));
        }
        Ok(greatest)
    }
}

/// `max abs(a - b) / max abs(b)`; 0 where both are zero, infinite where only `b` is.
#[must_use]
pub fn relative_difference(a: &[f32], b: &[f32]) -> f64 {
    let greatest =
        |values: &mut dyn Iterator<Item = f32>| values.fold(0.0f32, |m, v| m.max(v.abs()));
    let difference = greatest(&mut a.iter().zip(b).map(|(a, b)| a - b));
    if difference > 0.0 {
        f64::from(difference) / f64::from(greatest(&mut b.iter().copied()))
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::relative_difference;

    #[test]
    fn differences_are_relative_to_the_second_maximum() {
        assert!((relative_difference(&[1.0, 4.5], &[1.0, 5.0]) - 0.1).abs() < 1e-7);
        assert!(relative_difference(&[0.0], &[0.0]).abs() < 1e-12);
        assert!(relative_difference(&[1.0], &[0.0]).is_infinite());
    }
}
