//! How much of a tap the tissues keep: the shares of relaxation.

use crate::people::PeopleError;
use crate::people::measured::{Figure, Quantity};
use crate::people::press::Subject;
use crate::people::tap::Tap;
use papilla_fingertip::materials::{Moduli, PronySpec};
use papilla_fingertip::scene::TissueTable;
use serde::Serialize;
use std::path::Path;

/// Taps solved at most.
const TAPS_MAX: usize = 6;
/// How near the energy lost is met, %: it differs by less than 3 from one of the source's
/// conditions to the next.
const NEAR_PERCENT: f64 = 0.5;
/// Least and largest share of the first term that is looked at.
const BETWEEN: [f64; 2] = [0.5, 0.95];

/// A tap with shares.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Tapped {
    /// Share of the shortest time; the rest goes alike to the other times and to what stays.
    pub first_share: f64,
    /// Energy lost, %.
    pub lost_percent: f64,
    /// Largest force, N.
    pub force_n_max: f64,
    /// Processor time, s.
    pub solve_s: f64,
}

/// The relaxation that was found.
#[derive(Clone, Debug, Serialize)]
pub struct Shares {
    /// Times, s, people's.
    pub time_s: Vec<f64>,
    /// Shares, one a time.
    pub share: Vec<f64>,
    /// Energy lost that was looked for, %.
    pub people_percent: f64,
    /// Every tap, the nearest last.
    pub taps: Vec<Tapped>,
}

/// Times that people relax in and the tap that people make, of `figures` that have both.
pub(crate) fn asked(figures: &[Figure]) -> Option<(Vec<f64>, f64, f64, f64)> {
    let mut times: Vec<(usize, f64)> = Vec::new();
    let mut tap = None;
    for f in figures {
        match (f.quantity, f.value) {
            (Quantity::RelaxationTime { rank }, Some(time_s)) => times.push((rank, time_s)),
            (Quantity::EnergyLost { depth_mm, time_s }, Some(percent)) => {
                tap = Some((depth_mm, time_s, percent));
            }
            _ => {}
        }
    }
    times.sort_by_key(|t| t.0);
    let (depth_mm, time_s, percent) = tap.filter(|_| !times.is_empty())?;
    Some((times.into_iter().map(|t| t.1).collect(), depth_mm, time_s, percent))
}

/// One figure settles one number: the share of the shortest time, by the rule of false position.
pub(crate) fn found(
    subject: &Subject,
    (time_s, depth_mm, tap_s, percent): (Vec<f64>, f64, f64, f64),
    folder: &Path,
    told: &mut dyn FnMut(f64),
) -> Result<Shares, PeopleError> {
    let mut taps: Vec<Tapped> = Vec::new();
    let mut lost = |first_share: f64| {
        told(first_share);
        let series = series(&time_s, first_share);
        let subject = Subject { table: relaxing(&subject.table, &series), ..subject.clone() };
        let tap = Tap::found_or_solved(&subject, true, depth_mm, tap_s, folder)?;
        let Tap { lost_percent, force_n_max, solve_s, .. } = tap;
        taps.push(Tapped { first_share, lost_percent, force_n_max, solve_s });
        Ok::<_, PeopleError>(lost_percent - percent)
    };
    let [mut low, mut high] = BETWEEN;
    let (mut under, mut over) = (lost(low)?, lost(high)?);
    if under < 0.0 && over > 0.0 {
        for _ in 2..TAPS_MAX {
            let part = (under / (under - over)).clamp(0.1, 0.9);
            let at = thousandths(low + part * (high - low));
            let off = lost(at)?;
            if off.abs() < NEAR_PERCENT {
                break;
            }
            if off < 0.0 {
                (low, under) = (at, off);
            } else {
                (high, over) = (at, off);
            }
        }
    }
    let off = |t: &Tapped| (t.lost_percent - percent).abs();
    taps.sort_by(|a, b| off(b).total_cmp(&off(a)));
    let first = taps.last().map_or(low, |t| t.first_share);
    let share = series(&time_s, first).share;
    Ok(Shares { time_s, share, people_percent: percent, taps })
}

/// A thousandth of a share changes less than people are known.
fn thousandths(v: f64) -> f64 {
    (1e3 * v).round() / 1e3
}

/// The series of a first share: what is left is the other times' and the long term's, alike. The
/// law's constants are those of the long term, for people's plates were pressed slowly.
pub(crate) fn series(time_s: &[f64], first_share: f64) -> PronySpec {
    let rest = (1.0 - first_share) / time_s.len() as f64;
    let share = (0..time_s.len()).map(|k| if k == 0 { first_share } else { rest }).collect();
    PronySpec { share, time_s: time_s.to_vec(), moduli: Moduli::LongTerm }
}

/// The series of what relaxes with each time over what stays.
pub(crate) fn over_stays(time_s: &[f64], over_stays: &[f64]) -> PronySpec {
    let all = 1.0 + over_stays.iter().sum::<f64>();
    let share = over_stays.iter().map(|a| a / all).collect();
    PronySpec { share, time_s: time_s.to_vec(), moduli: Moduli::LongTerm }
}

/// The same tissues, the soft ones relaxing.
pub(crate) fn relaxing(table: &TissueTable, series: &PronySpec) -> TissueTable {
    let mut table = table.clone();
    for tissue in [&mut table.epidermis, &mut table.dermis, &mut table.subcutaneous] {
        tissue.prony = Some(series.clone());
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::people::measured::Measured;

    #[test]
    fn times_and_tap_are_people_s() {
        let measured = Measured::shipped().unwrap();
        let (times, depth, time, percent) = asked(&measured.figures).unwrap();
        assert_eq!(times, [0.004, 0.07, 1.4]);
        assert_eq!([depth, time, percent], [2.0, 0.05, 81.0]);
        assert!(asked(&[]).is_none());
    }

    #[test]
    fn what_the_first_term_leaves_is_shared_alike() {
        let series = series(&[0.004, 0.07, 1.4], 0.7);
        let (law, scale) = series.series().unwrap();
        assert!((law.long_term_share() - 0.1).abs() < 1e-12 && (scale - 10.0).abs() < 1e-9);
        assert!((series.share[1] - 0.1).abs() < 1e-12 && series.share[1] == series.share[2]);
        // Seven times as much as stays relaxes first, as much as stays with either other time.
        let same = over_stays(&series.time_s, &[7.0, 1.0, 1.0]);
        assert!(same.share.iter().zip(&series.share).all(|(a, b)| (a - b).abs() < 1e-12));
    }
}
