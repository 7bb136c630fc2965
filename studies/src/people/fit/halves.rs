//! What one half of the rows predicts of the other.

use super::adapt::{Evaluated, plus, refine};
use super::objective::{Data, Target};
use super::parameters::values;
use super::simulated::Simulated;
use crate::people::PeopleError;
use serde::Serialize;

/// Points simulated for a half at most.
const ROUNDS: usize = 4;

/// One half, fitted alone.
#[derive(Clone, Debug, Serialize)]
pub struct Half {
    /// Constants that were moved.
    pub constants: Vec<f64>,
    /// Every row.
    pub rows: Vec<HalfRow>,
}

/// A row with the constants of a half.
#[derive(Clone, Debug, Serialize)]
pub struct HalfRow {
    /// What it is.
    pub name: String,
    /// People's.
    pub people: String,
    /// The finger's.
    pub here: f64,
    /// Whether it was fitted, or is predicted.
    pub fitted: bool,
    /// Whether it lies within people's range, or a record's spread twice over.
    pub met: bool,
}

impl Half {
    /// Of the rows that were fitted, or of those that were left out: how many are met, and how many
    /// there are.
    #[must_use]
    pub fn met(&self, fitted: bool) -> [usize; 2] {
        let of = self.rows.iter().filter(|r| r.fitted == fitted);
        [of.clone().filter(|r| r.met).count(), of.count()]
    }
}

/// Fits each half alone.
pub(crate) fn new(
    data: &Data,
    simulated: &mut Simulated<'_>,
    evaluated: &mut Vec<Evaluated>,
    correction: &[f64],
    extras: &[f64],
) -> Result<Vec<Half>, PeopleError> {
    let (mut halves, parameters) = (Vec::new(), simulated.moved.parameters());
    for fitted in data.halves() {
        let residuals = |f: &[f64], e: &[f64]| data.residuals(&fitted, &plus(f, correction), e);
        let even = &mut |at: &[f64]| simulated.even(at);
        let found = refine(evaluated, &residuals, extras, ROUNDS, even)?;
        let Some(point) = evaluated.iter().find(|e| e.at == found.at) else { continue };
        let here = data.here(&plus(&point.features, correction), &found.extras);
        let row = |(k, t): (usize, &Target)| HalfRow {
            name: t.name.clone(),
            people: t.people.clone(),
            here: here[k],
            fitted: fitted.contains(&k),
            met: t.met(here[k]),
        };
        halves.push(Half {
            constants: values(&parameters, &found.at),
            rows: data.targets.iter().enumerate().map(row).collect(),
        });
    }
    Ok(halves)
}
