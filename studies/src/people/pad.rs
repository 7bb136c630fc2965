//! Figures of the pad under a plate, read off a press.

use crate::people::PeopleError;
use crate::people::measured::Quantity;
use crate::people::press::{Cells, Press, Subject, plate_radius_mm};
use crate::people::rates::r_squared;
use crate::people::solution::{Reads, Solution, State, until};
use std::path::Path;

/// The plate that presses until a force, N, or as far as it comes.
pub(crate) fn pressed(
    pitch_deg: f64,
    until_n: f64,
    subject: Subject,
    cells: Cells,
    folder: &Path,
) -> Result<Solution, PeopleError> {
    until(&Press::plate(pitch_deg, subject), until_n, cells, Reads::Contact, folder)
}

/// A figure of a finger, or why there is none.
pub(crate) fn figure(
    quantity: &Quantity,
    subject: &Subject,
    press: &Solution,
) -> Result<f64, PeopleError> {
    let Some((pitch_deg, most_n)) = quantity.plate() else { return Ok(f64::NAN) };
    let path = &press.path;
    if !path.reaches(most_n) {
        let (reached_n, depth_mm) = path.deepest();
        return Err(PeopleError::Force {
            press: format!("plate at {pitch_deg} degrees"),
            wanted_n: most_n,
            reached_n,
            depth_mm,
            why: press.ended.clone(),
        });
    }
    let at = |force_n: f64, values: &[f64]| path.value_at(force_n, values, 0.0).unwrap_or(f64::NAN);
    let of = |read: fn(&State) -> f64| press.states.iter().map(read).collect::<Vec<f64>>();
    let area = |s: &State| s.contact.map_or(f64::NAN, |c| c.area_mm2);
    let stiffness = path.stiffness_n_per_mm();
    Ok(match *quantity {
        Quantity::Stiffness { force_n, .. } => at(force_n, &stiffness),
        Quantity::Stiffening { from_n, to_n, .. } => at(to_n, &stiffness) / at(from_n, &stiffness),
        Quantity::Exponential { to_n, .. } => {
            let low = path.force_n.iter().take_while(|f| **f <= to_n).count();
            straightness(&path.force_n[..low], &stiffness[..low])
        }
        Quantity::AreaRatio { from_n, to_n, .. } => at(from_n, &of(area)) / at(to_n, &of(area)),
        Quantity::PeakOverMean { force_n, .. } => {
            at(force_n, &of(|s| s.contact.map_or(f64::NAN, |c| c.peak_over_mean)))
        }
        Quantity::HertzModulus { force_n, pitch_deg } => {
            let radius_mm = plate_radius_mm(pitch_deg, subject)?;
            let depth_mm = path.depth_at(force_n).unwrap_or(f64::NAN);
            hertz_modulus_mpa(force_n, depth_mm, radius_mm)
        }
        Quantity::VolumeLost { .. } => {
            -of(|s| s.volume_change_percent).into_iter().fold(0.0, f64::min)
        }
        _ => f64::NAN,
    })
}

/// Young's modulus, MPa, of an incompressible half-space that a sphere presses:
/// `F = 4/3 E / (1 - nu^2) R^(1/2) d^(3/2)`, nu = 1/2.
fn hertz_modulus_mpa(force_n: f64, depth_mm: f64, radius_mm: f64) -> f64 {
    0.75 * 0.75 * force_n / (radius_mm.sqrt() * depth_mm.powf(1.5))
}

/// R2 of the line of least squares.
fn straightness(x: &[f64], y: &[f64]) -> f64 {
    let n = x.len() as f64;
    let mean = |v: &[f64]| v.iter().sum::<f64>() / n;
    let (mx, my) = (mean(x), mean(y));
    let xy: f64 = x.iter().zip(y).map(|(a, b)| (a - mx) * (b - my)).sum();
    let slope = xy / x.iter().map(|a| (a - mx).powi(2)).sum::<f64>();
    let line: Vec<f64> = x.iter().map(|a| my + slope * (a - mx)).collect();
    r_squared(y, &line)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::people::contact::ContactRead;
    use crate::people::force_path::steps_mm;
    use crate::people::press::Materials;

    /// A sphere of 10 mm and 0.1 MPa as Hertz has it: area `pi R d`, pressure an ellipsoid.
    fn hertz() -> Solution {
        let mut found = Solution::default();
        for d in steps_mm(0.05, 3.0) {
            let force_n = 4.0 / 3.0 * 0.1 / 0.75 * 10f64.sqrt() * d.powf(1.5);
            found.path.push(d, force_n);
            let area_mm2 = std::f64::consts::PI * 10.0 * d;
            found.states.push(State {
                contact: Some(ContactRead { area_mm2, peak_over_mean: 1.5 }),
                volume_change_percent: -d,
                felt: Vec::new(),
                energy_vs_work: 0.0,
            });
        }
        found
    }

    #[test]
    fn figures_of_a_hertzian_finger_are_those_of_hertz() {
        let press = hertz();
        let pitch_deg = 0.0;
        let subject = Materials::NeoHookean.subject();
        let figure = |q| figure(&q, &subject, &press).unwrap();
        // Area goes as F^(2/3), stiffness as F^(1/3).
        let ratio = figure(Quantity::AreaRatio { from_n: 0.2, to_n: 2.0, pitch_deg });
        assert!((ratio - 0.1f64.powf(2.0 / 3.0)).abs() < 2e-3, "{ratio}");
        let stiffening = figure(Quantity::Stiffening { from_n: 0.25, to_n: 2.0, pitch_deg });
        assert!((stiffening - 2.0).abs() < 5e-3, "{stiffening}");
        let peak = figure(Quantity::PeakOverMean { force_n: 1.0, pitch_deg });
        assert!((peak - 1.5).abs() < 1e-12);
        assert!(
            (hertz_modulus_mpa(1.0, press.path.depth_at(1.0).unwrap(), 10.0) - 0.1).abs() < 1e-6
        );
        assert!((figure(Quantity::VolumeLost { to_n: 2.0, pitch_deg }) - 3.0).abs() < 1e-12);
    }

    #[test]
    fn a_force_that_is_not_reached_is_an_error_with_what_is() {
        let wanted = Quantity::Stiffness { force_n: 10.0, pitch_deg: 0.0 };
        let subject = Materials::NeoHookean.subject();
        let error = figure(&wanted, &subject, &hertz()).unwrap_err().to_string();
        assert!(error.contains("short of 10 N") && error.contains("3.00 mm"), "{error}");
    }

    #[test]
    fn a_line_is_straight() {
        let x = [1.0, 2.0, 4.0];
        assert!((straightness(&x, &x.map(|v| 3.0 - v)) - 1.0).abs() < 1e-12);
        assert!(straightness(&x, &[1.0, 9.0, 1.0]) < 0.2);
    }

    /// The set `people` presses an inclined plate as it did when it was fitted.
    #[test]
    #[ignore = "long"]
    fn the_set_people_is_as_stiff_as_it_was_fitted() {
        const HERTZ_MPA: f64 = 0.0651;
        let folder = tempfile::tempdir().unwrap();
        let subject = Materials::People.subject();
        let press = pressed(30.0, 0.5, subject.clone(), Cells::COARSE, folder.path()).unwrap();
        let hertz = Quantity::HertzModulus { force_n: 0.5, pitch_deg: 30.0 };
        let found = figure(&hertz, &subject, &press).unwrap();
        assert!((found / HERTZ_MPA - 1.0).abs() < 0.02, "{found}");
    }
}
