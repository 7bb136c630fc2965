//! The comparison: every press, every figure.

use crate::people::PeopleError;
use crate::people::afferents::Afferents;
use crate::people::measured::{Figure, Measured, Quantity};
use crate::people::mesh_error::mesh_errors;
use crate::people::pad;
pub use crate::people::press::Materials;
use crate::people::press::{Cells, Subject};
use crate::people::report::{Plate, Report, Row};
use crate::people::solution::Solution;
use crate::people::tangential::Tangential;
use crate::people::tap::{self, Tap};
use crate::people::{profile_turn, shear};
use papilla_fingertip::mesh::fingertip::Density;
use papilla_fingertip::scene::{Finger, TissueTable};
use papilla_output::atomic;
use std::path::Path;

/// Parts of the comparison, as the command line names them.
pub const PARTS: [&str; 8] =
    ["sa1", "mesh", "cylinders", "plates", "shear", "tangential", "tap", "relaxation"];

/// What is compared, and on what.
#[derive(Clone, Debug)]
pub struct Options {
    /// Laws and constants of the tissues.
    pub materials: Materials,
    /// The finger, with its own constants, by its name; the default one if not given.
    pub finger: Option<(String, Finger)>,
    /// Mesh of the spheres' states; plates press the coarse one.
    pub density: Density,
    /// Some of [`PARTS`]; empty is all.
    pub only: Vec<String>,
}

impl Options {
    /// The finger that is pressed. Of a finger's own constants `materials` says which laws take them,
    /// unless they were fitted with Ogden's.
    fn subject(&self) -> Subject {
        let usual = self.materials.subject();
        match &self.finger {
            Some((_, own)) => {
                let hyperelastic = usual.hyperelastic || own.tissue.needs("hyperelastic");
                Subject { shape: own.shape.clone(), table: own.tissue.clone(), hyperelastic }
            }
            None => usual,
        }
    }
}

/// Compares the finger with `measured`. Writes `human.json`, `human.md` and plots into `folder`, and a
/// file a press, by which a later run goes on.
///
/// `told` hears what is done now, and of how many presses how many are behind.
///
/// # Errors
/// [`PeopleError`]; a figure that a plate does not reach is in the report instead.
pub fn run(
    measured: &Measured,
    options: &Options,
    folder: &Path,
    told: &mut dyn FnMut(&str, usize, usize),
) -> Result<Report, PeopleError> {
    atomic::create_folder(folder)?;
    let wanted = |part: &str| options.only.is_empty() || options.only.iter().any(|o| o == part);
    let plates = if wanted("plates") { plates(measured) } else { Vec::new() };
    let spheres = if wanted("sa1") { measured.sa1.curvature_per_m.len() } else { 0 };
    let all = plates.len() + spheres;
    let mut done = 0;
    let subject = options.subject();
    let mut report = Report::new(
        options.materials,
        options.finger.as_ref().map(|f| f.0.clone()),
        options.density,
    );
    if wanted("sa1") {
        let found =
            Afferents::new(&measured.sa1, &subject, options.density, folder, &mut |press| {
                told(press, done, all);
                done += 1;
            })?;
        report.take_afferents(found, measured);
    }
    if wanted("mesh")
        && let Some(finer) = finer(options.density)
    {
        let pair = [options.density, finer];
        let told = &mut |press: &str| told(press, done, all);
        report.mesh_errors = mesh_errors(&measured.sa1, &subject, pair, folder, told)?;
    }
    let mut pressed = Vec::new();
    let coarse = Cells::graded(Density::Coarse);
    for &(pitch_deg, until_n) in &plates {
        told(&format!("plate at {pitch_deg} degrees"), done, all);
        let found = pad::pressed(pitch_deg, until_n, subject.clone(), coarse, folder)?;
        pressed.push((pitch_deg, found));
        done += 1;
    }
    for figure in &measured.figures {
        if wanted(part(&figure.quantity)) {
            told(part(&figure.quantity), done, all);
            report.rows.push(row(figure, &pressed, &subject, folder)?);
        }
    }
    report.plates = pressed.into_iter().map(|(pitch_deg, s)| Plate::new(pitch_deg, s)).collect();
    report.write(folder)?;
    told("done", done, all);
    Ok(report)
}

/// The next finer mesh.
const fn finer(density: Density) -> Option<Density> {
    match density {
        Density::Coarse => Some(Density::Medium),
        Density::Medium => Some(Density::Fine),
        Density::Fine => None,
    }
}

/// Which part of the comparison a quantity belongs to.
fn part(quantity: &Quantity) -> &'static str {
    match quantity {
        Quantity::RelaxationTime { .. } => "relaxation",
        Quantity::EnergyLost { .. } => "tap",
        Quantity::EnergyOutside { .. } => "tangential",
        Quantity::ProfileTurn { .. } => "cylinders",
        Quantity::ShearRatio { .. } => "shear",
        _ => "plates",
    }
}

/// Inclinations of the plates that figures ask for, degrees, each with its largest force, N.
pub(crate) fn plates(measured: &Measured) -> Vec<(f64, f64)> {
    let mut plates: Vec<(f64, f64)> = Vec::new();
    for (pitch_deg, force_n) in measured.figures.iter().filter_map(|f| f.quantity.plate()) {
        match plates.iter_mut().find(|p| p.0.total_cmp(&pitch_deg).is_eq()) {
            Some(known) => known.1 = known.1.max(force_n),
            None => plates.push((pitch_deg, force_n)),
        }
    }
    plates
}

/// What the finger has of a figure.
pub(crate) fn row(
    figure: &Figure,
    plates: &[(f64, Solution)],
    subject: &Subject,
    folder: &Path,
) -> Result<Row, PeopleError> {
    let here = match figure.quantity {
        Quantity::RelaxationTime { .. } => {
            Ok(nearest(figure.value.unwrap_or(f64::NAN), &subject.table))
        }
        Quantity::EnergyLost { depth_mm, time_s } => {
            let tap = Tap::found_or_solved(subject, true, depth_mm, time_s, folder)?;
            Ok(tap.lost_percent)
        }
        Quantity::EnergyOutside { force_n, shift_mm, friction } => {
            let asked = (force_n, shift_mm, friction);
            Ok(Tangential::found_or_solved(subject, asked, folder)?.share_outside)
        }
        Quantity::ProfileTurn { curvature_per_m, turn_deg, force_n } => {
            let asked = (curvature_per_m, turn_deg, force_n);
            Ok(profile_turn::under_cylinder(subject, asked, folder)?.turn_deg)
        }
        Quantity::ShearRatio { from_n, to_n } => Ok(shear::ratio(subject, [from_n, to_n], folder)?),
        _ => {
            let pitch = figure.quantity.plate().map(|p| p.0);
            let press = plates.iter().find(|(at, _)| Some(*at) == pitch);
            match press.map(|(_, press)| pad::figure(&figure.quantity, subject, press)) {
                Some(Ok(here)) => Ok(here),
                Some(Err(why @ PeopleError::Force { .. })) => Err(why.to_string()),
                Some(Err(other)) => return Err(other),
                None => Ok(f64::NAN),
            }
        }
    };
    Ok(Row::new(figure, here))
}

/// The relaxation time of the tissues that is nearest by its ratio, s.
fn nearest(people_s: f64, table: &TissueTable) -> f64 {
    let apart = |t: &f64| (t / people_s).ln().abs();
    let times = tap::relaxation_times_s(table);
    times.into_iter().min_by(|a, b| apart(a).total_cmp(&apart(b))).unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plates_press_to_the_largest_force_of_their_figures() {
        assert_eq!(plates(&Measured::shipped().unwrap()), [(0.0, 10.0), (30.0, 10.0)]);
    }

    #[test]
    fn the_nearest_time_is_nearest_by_ratio() {
        assert_eq!(nearest(0.004, &TissueTable::default()), 0.2136);
        assert_eq!(nearest(1.4, &TissueTable::default()), 4.6731);
    }
}
