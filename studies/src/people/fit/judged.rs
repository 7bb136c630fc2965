//! Every published row with the fitted finger.

use super::shares::{Shares, asked, found, relaxing, series};
use crate::people::PeopleError;
use crate::people::measured::{Figure, Measured, Quantity};
use crate::people::pad;
use crate::people::press::{Cells, Subject};
use crate::people::report::{Row, Verdict};
use crate::people::study::{plates, row};
use papilla_fingertip::mesh::fingertip::Density;
use std::path::Path;

/// How far a single figure may be missed, as a share of it.
const THIRD: f64 = 1.0 / 3.0;

/// How the tissues relax, if the measurements have a tap and times; `subject` relaxes so from then on.
pub(crate) fn relaxation(
    measured: &Measured,
    subject: &mut Subject,
    folder: &Path,
    told: &mut dyn FnMut(&str),
) -> Result<Option<Shares>, PeopleError> {
    let Some(asked) = asked(&measured.figures) else { return Ok(None) };
    let shares = found(subject, asked, folder, &mut |_| told("taps"))?;
    subject.table = relaxing(&subject.table, &series(&shares.time_s, shares.share[0]));
    Ok(Some(shares))
}

/// Rows of plates and taps, plates on the graded mesh; `taps` says whether the tissues' relaxation is
/// fitted.
pub(crate) fn rows(
    measured: &Measured,
    subject: &Subject,
    taps: bool,
    folder: &Path,
    told: &mut dyn FnMut(&str),
) -> Result<Vec<Row>, PeopleError> {
    let cells = Cells::graded(Density::Coarse);
    let mut presses = Vec::new();
    for (pitch_deg, until_n) in plates(measured) {
        told("plates on the graded mesh");
        let found = pad::pressed(pitch_deg, until_n, subject.clone(), cells, folder)?;
        presses.push((pitch_deg, found));
    }
    let timed =
        |q: &Quantity| matches!(q, Quantity::RelaxationTime { .. } | Quantity::EnergyLost { .. });
    let known = |f: &&Figure| f.quantity.plate().is_some() || (taps && timed(&f.quantity));
    measured.figures.iter().filter(known).map(|f| row(f, &presses, subject, folder)).collect()
}

/// Whether a row lies within people's range, or within a third of a single figure.
#[must_use]
pub fn near(verdict: &Verdict) -> bool {
    match verdict {
        Verdict::Ok => true,
        Verdict::TimesPeople(t) => (t - 1.0).abs() <= THIRD,
        Verdict::Failed | Verdict::NotReached(_) => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_third_is_near() {
        assert!(near(&Verdict::Ok) && !near(&Verdict::Failed));
        assert!(near(&Verdict::TimesPeople(0.67)) && near(&Verdict::TimesPeople(1.33)));
        assert!(!near(&Verdict::TimesPeople(0.66)) && !near(&Verdict::TimesPeople(1.34)));
        assert!(!near(&Verdict::NotReached("stuck".into())));
    }
}
