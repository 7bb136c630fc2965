//! The finger that comes closest to people's, or to a person's own records.
//!
//! Presses settle constants of tissues and of shape between bounds, each row weighted by its spread.
//! What the even coarse mesh says is interpolated ([`adapt`]) and corrected by what the graded mesh
//! says at the best point. [`profile`] says which constants the rows tell, [`halves`] what one half of
//! the rows predicts of the other. Then the energy lost in a tap settles how the tissues relax. Every
//! press is stored, and a run that was killed goes on where it stopped.

pub mod adapt;
mod chart;
pub mod halves;
pub mod judged;
pub mod least_squares;
mod objective;
mod page;
pub mod parameters;
pub mod profile;
pub mod record;
mod shares;
mod simulated;
pub mod surrogate;

pub use shares::{Shares, Tapped};

use crate::people::PeopleError;
use crate::people::measured::Measured;
use crate::people::report::Row;
use adapt::{Evaluated, Landscape, Optimum, best, design, own, plus, refine};
use halves::Half;
use objective::Data;
use papilla_fingertip::scene::Finger;
use papilla_fingertip::scene::finger::Source;
use papilla_output::atomic;
use papilla_processor::today_here;
use parameters::{Moved, Parameter, RELAXATION_TIMES_S, start, values};
use profile::Told;
use record::RecordedPress;
use serde::Serialize;
use simulated::Simulated;
use std::path::Path;
use surrogate::Surrogate;

/// A constant that was found.
#[derive(Clone, Debug, Serialize)]
pub struct Identified {
    /// Which, and between what.
    pub parameter: Parameter,
    /// Its value.
    pub value: f64,
    /// Whether it stands at a bound: the rows ask for more than is allowed.
    pub at_bound: bool,
    /// How well the rows tell it.
    pub told: Told,
}

/// A row that was fitted.
#[derive(Clone, Debug, Serialize)]
pub struct Fitted {
    /// What it is.
    pub name: String,
    /// People's: one figure, or least and largest.
    pub people: String,
    /// With the constants of the start, on the even mesh.
    pub start: f64,
    /// With those of the end, on the even mesh.
    pub even: f64,
    /// The same on the graded mesh; absent if it was not asked for.
    pub graded: Option<f64>,
    /// Weighted residual at the end.
    pub residual: f64,
    /// What the surrogate misses at points that it does not know, %; of a record the mean over the
    /// press.
    pub surrogate_percent: f64,
    /// Whether it lies within the range, or within a record's spread twice over.
    pub met: bool,
}

/// The fit.
#[derive(Clone, Debug, Serialize)]
pub struct Fit {
    /// Date and processor.
    pub made: String,
    /// Files of records; empty if published figures were fitted.
    pub records: Vec<String>,
    /// Parts that were not asked for.
    pub left_out: Vec<&'static str>,
    /// The constants.
    pub constants: Vec<Identified>,
    /// Constants that were not moved.
    pub held: Vec<Parameter>,
    /// Half the sum of squared residuals at the start and at the end.
    pub cost: [f64; 2],
    /// Rows.
    pub rows: Vec<Fitted>,
    /// Every point that was simulated on the even mesh.
    pub evaluated: Vec<Evaluated>,
    /// Points that were simulated on the graded mesh.
    pub graded: usize,
    /// Each half of the rows, fitted alone.
    pub halves: Vec<Half>,
    /// Relaxation, if published measurements have a tap and times.
    pub shares: Option<Shares>,
    /// Every published row with the fitted finger, plates on the graded mesh.
    pub judged: Vec<Row>,
    /// Processor time of all presses on the even and on the graded mesh, s.
    pub solve_s: [f64; 2],
    /// The finger, as its file has it.
    #[serde(skip)]
    pub finger: Finger,
}

/// What is fitted to, and how far.
#[derive(Clone, Debug)]
pub struct Options {
    /// The constants that are moved.
    pub moved: Moved,
    /// Points simulated before the first search.
    pub design: usize,
    /// Points simulated after it at most.
    pub rounds: usize,
    /// Points simulated on the graded mesh at most; 0 leaves the even mesh uncorrected.
    pub graded: usize,
    /// Some of [`PARTS`]; empty is all.
    pub only: Vec<String>,
}

/// Parts of a fit, as the command line names them. The constants are fitted in any case.
pub const PARTS: [&str; 4] = ["constants", "halves", "taps", "rows"];

/// Fits constants to `measured`, or to `records` (each file's name and presses) if there are any.
/// Writes `fit.json`, `fit.md` with its plots and `finger.toml` into `folder`, and a file a press.
///
/// `told` hears what is solved, and of how many simulated points how many are behind.
///
/// # Errors
/// [`PeopleError`]; a finger that cannot be meshed or solved is passed by.
pub fn run(
    measured: &Measured,
    records: Vec<(String, Vec<RecordedPress>)>,
    options: &Options,
    folder: &Path,
    told: &mut dyn FnMut(&str, usize, usize),
) -> Result<Fit, PeopleError> {
    atomic::create_folder(folder)?;
    let wanted = |part: &str| options.only.is_empty() || options.only.iter().any(|o| o == part);
    let (names, presses): (Vec<String>, Vec<_>) = records.into_iter().unzip();
    let data = match names.is_empty() {
        true => Data::published(measured),
        false => Data::recorded(presses.into_iter().flatten().collect()),
    };
    let all = options.design + options.rounds + options.graded;
    let moved = &options.moved;
    let parameters = moved.parameters();
    let mut simulated = Simulated::new((&data, moved), folder, told, all);
    let extras = start(data.extras());
    let every: Vec<usize> = (0..data.targets.len()).collect();
    let mut evaluated =
        design(&start(&parameters), options.design, &mut |at: &[f64]| simulated.even(at))?;
    let first = evaluated[0].clone();
    let (optimum, correction, graded) =
        corrected(&data, &mut simulated, &mut evaluated, options, (&every, &extras))?;
    let halves = match wanted("halves") {
        true => halves::new(&data, &mut simulated, &mut evaluated, &correction, &extras)?,
        false => Vec::new(),
    };
    let residuals = |f: &[f64], e: &[f64]| data.residuals(&every, &plus(f, &correction), e);
    let landscape = Landscape::new(&evaluated, &residuals, &extras);
    let constants = constants(&landscape, [&parameters, data.extras()], &optimum);
    let rows = rows(&data, (&evaluated, &first), &optimum, (&correction, graded > 0));
    let cost = [own(&first, &residuals, &extras).cost, optimum.cost];
    let solve_s = simulated.solve_s;
    let mut subject = simulated::subject(moved, &optimum.at);
    let (mut shares, mut judged) = (None, Vec::new());
    if names.is_empty() {
        let told = &mut |what: &str| told(what, all, all);
        if wanted("taps") {
            shares = judged::relaxation(measured, &mut subject, folder, told)?;
        }
        if wanted("rows") {
            judged = judged::rows(measured, &subject, shares.is_some(), folder, told)?;
        }
    } else {
        let over_stays = values(data.extras(), &optimum.extras);
        let series = shares::over_stays(&RELAXATION_TIMES_S, &over_stays);
        subject.table = shares::relaxing(&subject.table, &series);
    }
    let what = if names.is_empty() { "fitted to people's figures" } else { "fitted to records" };
    let finger = Finger {
        source: Source { who: what.into(), file: names.join(", "), ..Source::default() },
        ..simulated::finger(&subject)
    };
    let fit = Fit {
        made: today_here(),
        records: names,
        left_out: PARTS.into_iter().filter(|p| !wanted(p)).collect(),
        constants,
        held: moved.held(),
        cost,
        rows,
        evaluated,
        graded,
        halves,
        shares,
        judged,
        solve_s,
        finger,
    };
    fit.write(folder)?;
    told("done", all, all);
    Ok(fit)
}

/// The best point of the even mesh, corrected by what the graded mesh says of it as long as that moves
/// it: of the points that the graded mesh has seen the one that it finds best, the correction of each
/// feature there, and how many points it has seen.
fn corrected(
    data: &Data,
    simulated: &mut Simulated<'_>,
    evaluated: &mut Vec<Evaluated>,
    options: &Options,
    (every, extras): (&[usize], &[f64]),
) -> Result<(Optimum, Vec<f64>, usize), PeopleError> {
    let mut correction = vec![0.0; data.feature_count()];
    let mut graded = 0;
    let mut least: Option<(Optimum, Vec<f64>)> = None;
    loop {
        let residuals = |f: &[f64], e: &[f64]| data.residuals(every, &plus(f, &correction), e);
        let rounds = if graded == 0 { options.rounds } else { options.rounds.div_ceil(3) };
        let even = &mut |at: &[f64]| simulated.even(at);
        let found = refine(evaluated, &residuals, extras, rounds, even)?;
        if graded >= options.graded || !found.cost.is_finite() {
            let (found, correction) = least.unwrap_or((found, correction));
            return Ok((found, correction, graded));
        }
        let fine = simulated.graded(&found.at)?;
        graded += 1;
        let Some(coarse) = evaluated.iter().find(|e| e.at == found.at) else {
            return Ok((found, correction, graded));
        };
        let differs = |(f, c): (&f64, &f64)| if (f - c).is_finite() { f - c } else { 0.0 };
        correction = fine.iter().zip(&coarse.features).map(differs).collect();
        let residuals = |f: &[f64], e: &[f64]| data.residuals(every, &plus(f, &correction), e);
        let here = own(coarse, &residuals, extras);
        // What was simulated on the graded mesh is judged by that alone.
        if least.as_ref().is_none_or(|(least, _)| here.cost < least.cost) {
            least = Some((here, correction.clone()));
        }
        let stays = best(evaluated, &residuals, extras).at == found.at;
        if let Some((found, correction)) = least.take_if(|_| graded == options.graded || stays) {
            return Ok((found, correction, graded));
        }
    }
}

fn constants(
    landscape: &Landscape<'_>,
    parameters: [&[Parameter]; 2],
    optimum: &Optimum,
) -> Vec<Identified> {
    let parameters: Vec<&Parameter> = parameters.into_iter().flatten().collect();
    let at: Vec<f64> = optimum.at.iter().chain(&optimum.extras).copied().collect();
    let one = |(k, parameter): (usize, &&Parameter)| Identified {
        parameter: **parameter,
        value: values(std::slice::from_ref(*parameter), &at[k..=k])[0],
        at_bound: at[k] <= 0.0 || at[k] >= 1.0,
        told: Told::new(landscape, parameter, k, optimum),
    };
    parameters.iter().enumerate().map(one).collect()
}

fn rows(
    data: &Data,
    (evaluated, first): (&[Evaluated], &Evaluated),
    optimum: &Optimum,
    (correction, graded): (&[f64], bool),
) -> Vec<Fitted> {
    let points: Vec<Vec<f64>> = evaluated.iter().map(|e| e.at.clone()).collect();
    let features: Vec<Vec<f64>> = evaluated.iter().map(|e| e.features.clone()).collect();
    let missed = Surrogate::left_out(&points, &features);
    let none = Vec::new();
    let last = evaluated.iter().find(|e| e.at == optimum.at).map_or(&none, |e| &e.features);
    let begun = data.here(&first.features, &optimum.extras);
    let even = data.here(last, &optimum.extras);
    let fine = data.here(&plus(last, correction), &optimum.extras);
    let row = |(k, t): (usize, &objective::Target)| Fitted {
        name: t.name.clone(),
        people: t.people.clone(),
        start: begun[k],
        even: even[k],
        graded: graded.then(|| fine[k]),
        residual: t.residual(fine[k]),
        surrogate_percent: 100.0 * data.missed(&missed, k),
        met: t.met(fine[k]),
    };
    data.targets.iter().enumerate().map(row).collect()
}

#[cfg(test)]
mod tests;
