//! How far the profile of SA1 rates under a cylinder is turned.

use crate::people::PeopleError;
use crate::people::press::{Press, Subject};
use crate::people::receptors::{Stimulus, population_mm};
use crate::people::solution::{Reads, held_at};
use papilla_fingertip::mesh::fingertip::Density;
use std::path::Path;

/// Farthest that a profile is looked for from across the finger, degrees.
const TURN_MAX_DEG: f64 = 45.0;
/// Least and largest `b` of [`Profile`], 1/mm2: widths of 7 and of .2 mm.
const SHARPNESS_PER_MM2: [f64; 2] = [0.01, 10.0];
/// Steps of a search by the golden section: the last bracket is 3e-9 of the first.
const STEPS: usize = 40;

/// `a exp(-b (x cos t + y sin t)^2)`, `x` along the finger and `y` across it: what the source fits.
/// Its crest is the line `(0, 1)` turned by `t`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Profile {
    /// Turn `t` of its crest, degrees.
    pub turn_deg: f64,
    /// `b`, 1/mm2.
    pub sharpness_per_mm2: f64,
    /// Share of the variance of the values that it explains.
    pub r2: f64,
}

impl Profile {
    /// The profile of least squares through values at places (mm along the finger and across it);
    /// values that are not numbers do not count.
    pub(crate) fn fitted(at_mm: &[[f64; 2]], values: &[f64]) -> Self {
        let known: Vec<([f64; 2], f64)> =
            at_mm.iter().copied().zip(values.iter().copied()).filter(|k| k.1.is_finite()).collect();
        let [low, high] = SHARPNESS_PER_MM2.map(f64::ln);
        let sharpest =
            |turn_deg: f64| golden([low, high], &|ln_b| missed(&known, turn_deg, ln_b.exp()));
        let best = |turn_deg: f64| sharpest(turn_deg).1;
        let (turn_deg, least) = golden([-TURN_MAX_DEG, TURN_MAX_DEG], &best);
        let mean = known.iter().map(|k| k.1).sum::<f64>() / known.len() as f64;
        let all: f64 = known.iter().map(|k| (k.1 - mean).powi(2)).sum();
        let sharpness_per_mm2 = sharpest(turn_deg).0.exp();
        Self { turn_deg, sharpness_per_mm2, r2: 1.0 - least / all }
    }
}

/// Sum of squares that the best height leaves of a profile.
fn missed(known: &[([f64; 2], f64)], turn_deg: f64, sharpness: f64) -> f64 {
    let (sin, cos) = turn_deg.to_radians().sin_cos();
    let unit = |[x, y]: [f64; 2]| (-sharpness * (x * cos + y * sin).powi(2)).exp();
    let (mut gv, mut gg) = (0.0, 0.0);
    for &(at, v) in known {
        let g = unit(at);
        gv += g * v;
        gg += g * g;
    }
    known.iter().map(|&(at, v)| (v - gv / gg * unit(at)).powi(2)).sum()
}

/// Where a function with one minimum is least between two places, and its value there.
fn golden([mut a, mut b]: [f64; 2], f: &dyn Fn(f64) -> f64) -> (f64, f64) {
    let ratio = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut x, mut y) = (b - ratio * (b - a), a + ratio * (b - a));
    let (mut fx, mut fy) = (f(x), f(y));
    for _ in 0..STEPS {
        if fx < fy {
            (b, y, fy) = (y, x, fx);
            x = b - ratio * (b - a);
            fx = f(x);
        } else {
            (a, x, fx) = (x, y, fy);
            y = a + ratio * (b - a);
            fy = f(y);
        }
    }
    if fx < fy { (x, fx) } else { (y, fy) }
}

/// The profile of SED at the interface under a cylinder across the finger that is turned about the
/// pad's normal. SED is as good as the rate here: [the law](crate::people::rates::Law) that fits it to
/// the rates has no threshold.
pub(crate) fn under_cylinder(
    subject: &Subject,
    (curvature_per_m, turn_deg, force_n): (f64, f64, f64),
    folder: &Path,
) -> Result<Profile, PeopleError> {
    let press = Press::cylinder(curvature_per_m, turn_deg, subject.clone());
    let held = held_at(&press, &[force_n], Density::Coarse, Reads::Population, folder)?;
    let sed = &held.states[0].felt[0][Stimulus::Sed as usize];
    let found = Profile::fitted(&population_mm(), sed);
    // A cylinder turned the other way round has a profile that is: its turn is the same size.
    Ok(Profile { turn_deg: press.turned_side() * found.turn_deg, ..found })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_profile_that_was_drawn_is_found() {
        let at = population_mm();
        for (turn_deg, sharpness) in [(0.0, 0.4), (9.0, 2.0), (-17.3, 0.1)] {
            let (sin, cos) = f64::to_radians(turn_deg).sin_cos();
            let values: Vec<f64> = at
                .iter()
                .map(|[x, y]| 70.0 * (-sharpness * (x * cos + y * sin).powi(2)).exp())
                .collect();
            let found = Profile::fitted(&at, &values);
            assert!((found.turn_deg - turn_deg).abs() < 1e-3, "{found:?}");
            assert!((found.sharpness_per_mm2 / sharpness - 1.0).abs() < 1e-4, "{found:?}");
            assert!(found.r2 > 1.0 - 1e-9, "{found:?}");
        }
    }

    /// A cylinder on a pad that is more curved across than along turns the profile farther than
    /// itself: of the sum of both curvatures the crest is turned by half of
    /// `atan(k sin 2a / (k cos 2a - (across - along)))`.
    #[test]
    fn curvatures_of_the_pad_turn_the_profile_on() {
        let (k, across, along, a) = (172.0, 140.0, 61.0, 9.0_f64.to_radians());
        let exact =
            0.5 * (k * (2.0 * a).sin()).atan2(k * (2.0 * a).cos() - (across - along)).to_degrees();
        let at = population_mm();
        let depth = |[x, y]: [f64; 2]| {
            let off = x * a.cos() + y * a.sin();
            5e-4 * (k * off * off + along * x * x + across * y * y)
        };
        let values: Vec<f64> = at.iter().map(|p| (-3.0 * depth(*p)).exp()).collect();
        let found = Profile::fitted(&at, &values);
        assert!(found.turn_deg > 1.3 * 9.0, "{found:?}");
        assert!((found.turn_deg / exact - 1.0).abs() < 0.05, "{found:?} {exact}");
    }

    /// On the finger itself a profile turns with the cylinder, and by nothing with one that is not
    /// turned.
    #[test]
    #[ignore = "long"]
    fn the_profile_turns_with_the_cylinder() {
        let folder = tempfile::tempdir().unwrap();
        let subject = crate::people::press::Materials::NeoHookean.subject();
        let turn = |turn_deg| {
            under_cylinder(&subject, (521.0, turn_deg, 0.05), folder.path()).unwrap().turn_deg
        };
        assert!(turn(0.0).abs() < 0.3, "{}", turn(0.0));
        let turned = turn(9.0);
        assert!((5.0..15.0).contains(&turned), "{turned}");
    }
}
