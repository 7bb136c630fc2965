//! Constants of the tissues that come closest to people's fingers.
//!
//! First the slow presses with plates settle three elastic constants between printed values, each
//! row weighted by its spread over people; then the energy lost in a tap settles how the tissues
//! relax. Every press is stored, and a run that was killed goes on where it stopped.

pub mod least_squares;
mod objective;
mod page;
pub mod parameters;
mod sets;
mod shares;

pub use crate::people::maps::MapChange;
pub use sets::Sets;
pub use shares::{Shares, Tapped};

use crate::people::PeopleError;
use crate::people::measured::{Measured, Quantity};
use crate::people::pad;
use crate::people::press::{Materials, Tissues};
use crate::people::report::words;
use crate::people::solution::Solution;
use crate::people::study::plates;
use least_squares::{Ended, Found, Tried, cost, search};
use objective::{Target, targets};
use papilla_fingertip::scene::TissueTable;
use papilla_output::atomic;
use papilla_progress::processor::today_here;
use parameters::{PARAMETERS, Parameter, start, table, values};
use serde::Serialize;
use std::path::Path;

/// A constant that was found.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Identified {
    /// Which, and between what.
    pub parameter: Parameter,
    /// Its value.
    pub value: f64,
    /// Whether it stands at a printed bound: people's rows ask for more than is printed.
    pub at_bound: bool,
    /// Its standard error as a share of the way between the bounds, if the rows missed as they do
    /// by chance; one of 1 says that the rows do not tell it.
    pub uncertainty: f64,
}

/// A row that was fitted.
#[derive(Clone, Debug, Serialize)]
pub struct Fitted {
    /// What it is.
    pub quantity: String,
    /// People's: one figure, or least and largest.
    pub people: String,
    /// With the constants of the start and of the end.
    pub here: [f64; 2],
    /// Weighted residual at the end.
    pub residual: f64,
}

/// The fit.
#[derive(Clone, Debug, Serialize)]
pub struct Fit {
    /// Date and processor.
    pub made: String,
    /// Parts that were not asked for.
    pub left_out: Vec<&'static str>,
    /// The constants.
    pub constants: Vec<Identified>,
    /// Half the sum of squared residuals at the start and at the end.
    pub cost: [f64; 2],
    /// Rows.
    pub rows: Vec<Fitted>,
    /// Every evaluation.
    pub tried: Vec<Tried>,
    /// Why the search ended.
    pub ended: Ended,
    /// Relaxation, if the measurements have a tap and times.
    pub shares: Option<Shares>,
    /// Processor time of all presses of the search, s.
    pub solve_s: f64,
    /// Every row and the maps, beside the default set.
    pub sets: Sets,
    /// The tissues, as a scene has them.
    pub tissues: TissueTable,
}

/// What is fitted to, and how far.
#[derive(Clone, Debug)]
pub struct Options {
    /// Evaluations at most; those of the first Jacobian are made in any case.
    pub evaluations: usize,
    /// Some of [`PARTS`]; empty is all.
    pub only: Vec<String>,
}

/// Parts of a fit, as the command line names them: the elastic constants, relaxation, maps.
pub const PARTS: [&str; 3] = ["plates", "taps", "maps"];

/// Two plates of one finger.
type Presses = Vec<(f64, Solution)>;

/// Fits the constants to `measured`. Writes `fit.json`, `fit.md` and `materials.toml` (tables for a
/// scene) into `folder`, and a file a press.
///
/// `told` hears what is solved, and of how many evaluations how many are behind.
///
/// # Errors
/// [`PeopleError`]; a force that a plate does not reach is read at the largest that it does.
pub fn run(
    measured: &Measured,
    options: &Options,
    folder: &Path,
    told: &mut dyn FnMut(&str, usize, usize),
) -> Result<Fit, PeopleError> {
    atomic::create_folder(folder)?;
    let (plates, targets) = (plates(measured), targets(&measured.figures));
    let pressed = |values: &[f64]| {
        let tissues = Tissues { table: table(values), hyperelastic: true };
        pad::pressed_together(&plates, &tissues, folder)
    };
    let (mut done, mut solve_s) = (0, 0.0);
    let mut residuals = |at: &[f64]| {
        told("plates", done, options.evaluations);
        let presses = pressed(&values(at))?;
        done += 1;
        solve_s += presses.iter().map(|(_, s)| s.solve_s).sum::<f64>();
        let residual = |t: &Target<'_>| Ok(t.residual(t.here(&presses)?));
        targets.iter().map(residual).collect::<Result<Vec<f64>, PeopleError>>()
    };
    let found = search(&start(), options.evaluations, &mut residuals)?;
    let best = values(&found.at);
    let states = [pressed(&values(&start()))?, pressed(&best)?];
    let tissues = table(&best);
    let wanted = |part: &str| options.only.is_empty() || options.only.iter().any(|o| o == part);
    let shares = shares::asked(&measured.figures)
        .filter(|_| wanted("taps"))
        .map(|asked| {
            let told = &mut |_| told("taps", done, options.evaluations);
            shares::found(&tissues, asked, folder, told)
        })
        .transpose()?;
    let rows = rows(&targets, &found, &states)?;
    let tissues = match &shares {
        Some(s) => shares::relaxing(&tissues, &shares::series(&s.time_s, s.share[0])),
        None => tissues,
    };
    let fitted = Tissues { table: tissues.clone(), hyperelastic: true };
    let both = [&Materials::NeoHookean.tissues(), &fitted];
    let told_sets = &mut |what: &str| told(what, done, options.evaluations);
    let sets = Sets::new(measured, both, [shares.is_some(), wanted("maps")], folder, told_sets)?;
    let fit = Fit {
        made: today_here(),
        left_out: PARTS.into_iter().skip(1).filter(|p| !wanted(p)).collect(),
        constants: constants(&found, &best),
        cost: [found.tried[0].cost, cost(&found.residuals)],
        rows,
        tissues,
        sets,
        tried: found.tried,
        ended: found.ended,
        shares,
        solve_s,
    };
    fit.write(folder)?;
    told("done", 1, 1);
    Ok(fit)
}

fn constants(found: &Found, values: &[f64]) -> Vec<Identified> {
    let uncertain = uncertainties(found);
    let one = |(k, parameter): (usize, &Parameter)| Identified {
        parameter: *parameter,
        value: values[k],
        at_bound: found.at[k] <= 0.0 || found.at[k] >= 1.0,
        uncertainty: uncertain[k],
    };
    PARAMETERS.iter().enumerate().map(one).collect()
}

/// Root of the diagonal of `s^2 (J^T J + 1)^-1`, `s^2` the residuals' variance. The 1 is what is
/// known without the rows: that the constant lies between its bounds.
fn uncertainties(found: &Found) -> Vec<f64> {
    let n = found.at.len();
    let rows = found.residuals.len().saturating_sub(n).max(1) as f64;
    let variance = (2.0 * cost(&found.residuals) / rows).max(f64::MIN_POSITIVE);
    let normal = |i: usize, j: usize| {
        let sum: f64 = found.jacobian.iter().map(|row| row[i] * row[j]).sum();
        sum / variance + f64::from(u8::from(i == j))
    };
    let matrix: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| normal(i, j)).collect()).collect();
    let unit = |k: usize| (0..n).map(|i| f64::from(u8::from(i == k))).collect();
    (0..n).map(|k| least_squares::solved(matrix.clone(), unit(k))[k].sqrt()).collect()
}

fn rows(
    targets: &[Target<'_>],
    found: &Found,
    states: &[Presses; 2],
) -> Result<Vec<Fitted>, PeopleError> {
    let row = |(t, &residual): (&Target<'_>, &f64)| {
        let mut here = [f64::NAN; 2];
        for (value, presses) in here.iter_mut().zip(states) {
            *value = t.here(presses)?;
        }
        let quantity: &Quantity = &t.figure.quantity;
        let people = t.figure.people();
        Ok(Fitted { quantity: words::quantity(quantity), people, here, residual })
    };
    targets.iter().zip(&found.residuals).map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A parameter that no row feels is known by its bounds alone, one that a row feels better.
    #[test]
    fn uncertainty_is_small_where_rows_feel_a_constant() {
        let found = Found {
            at: vec![0.5, 0.5],
            residuals: vec![0.1, -0.1, 0.0, 0.1],
            jacobian: vec![vec![10.0, 0.0], vec![5.0, 0.0], vec![0.0, 0.0], vec![1.0, 0.0]],
            tried: Vec::new(),
            ended: Ended::Converged,
        };
        let [felt, unfelt] = uncertainties(&found)[..] else { panic!("two") };
        assert!(felt < 0.05 && (unfelt - 1.0).abs() < 1e-12, "{felt} {unfelt}");
    }

    /// The shipped set is what this module makes of three values within their bounds, and relaxes as
    /// [`shares`] has it.
    #[test]
    fn the_set_people_is_a_fit() {
        let set = Materials::People.tissues().table;
        let term = |spec: &papilla_fingertip::materials::MaterialSpec| {
            let ogden = spec.ogden.clone().unwrap();
            (ogden.mu_mpa[0], ogden.alpha[0])
        };
        let ((fat, exponent), (dermis, _)) = (term(&set.subcutaneous), term(&set.dermis));
        let values = [fat, exponent, dermis];
        for (p, v) in PARAMETERS.iter().zip(values) {
            assert!((p.low..=p.high).contains(&v), "{}: {v}", p.name);
        }
        let prony = set.dermis.prony.clone().unwrap();
        let series = shares::series(&prony.time_s, prony.share[0]);
        let fitted = shares::relaxing(&table(&values), &series);
        for (a, b) in [&set.epidermis, &set.dermis, &set.subcutaneous].into_iter().zip([
            &fitted.epidermis,
            &fitted.dermis,
            &fitted.subcutaneous,
        ]) {
            assert_eq!((&a.ogden, a.poissons_ratio), (&b.ogden, b.poissons_ratio));
            assert!((a.youngs_modulus_mpa / b.youngs_modulus_mpa - 1.0).abs() < 1e-12);
            let (a, b) = (a.prony.as_ref().unwrap(), b.prony.as_ref().unwrap());
            assert!(a.share.iter().zip(&b.share).all(|(x, y)| (x - y).abs() < 1e-4), "{a:?} {b:?}");
            assert_eq!((&a.time_s, a.moduli), (&b.time_s, b.moduli));
        }
        assert_eq!(prony.time_s, [0.004, 0.070, 1.4]);
    }

    /// Its plate, inclined, to half a newton: Hertz' modulus of the page.
    #[test]
    #[ignore = "long"]
    fn the_set_people_is_as_stiff_as_the_page_says() {
        let folder = tempfile::tempdir().unwrap();
        let tissues = Materials::People.tissues();
        let presses = pad::pressed_together(&[(30.0, 0.5)], &tissues, folder.path()).unwrap();
        let hertz = Quantity::HertzModulus { force_n: 0.5, pitch_deg: 30.0 };
        let found = pad::figure(&hertz, &presses[0].1).unwrap();
        assert!((found / HERTZ_MPA - 1.0).abs() < 0.02, "{found}");
    }

    const HERTZ_MPA: f64 = 0.0651;
}
