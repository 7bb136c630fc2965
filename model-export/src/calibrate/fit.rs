//! Fits laws of errors to some states, and checks them on others.

use super::quantile::{Table, conformal_quantile, dot};
use super::{Case, SETS, Set};
use papilla_engine::error_law::{Fact, Facts, Law, Term};
use std::collections::BTreeMap;

/// Parts into which simulations are dealt: each is checked by a law that was fitted to the others.
pub(crate) const FOLDS: usize = 5;
/// The same within those, to find how far a bound has to be raised.
const INNER_FOLDS: usize = 8;
/// Times the squares of the coefficients of facts that were brought to a standard deviation of 1.
const RIDGE: f64 = 3.0;
/// Room beyond the facts of the calibration, as a share of their range.
const MARGIN: f64 = 0.1;
/// A group raises the bound if it has so many cases.
const GROUP_LEAST: usize = 15;
/// Least error, for the logarithm.
const ERROR_LEAST: f64 = 1e-3;

/// Which facts a law goes by.
#[derive(Debug, Clone)]
pub(super) struct Form {
    /// Those of the median.
    pub(super) median: Vec<Fact>,
    /// Those of the bound over the median; among the former.
    pub(super) bound: Vec<Fact>,
    /// The group of sets in which a bound has to hold.
    pub(super) group: fn(&Set) -> &'static str,
}

/// A case that a law can be fitted to or be checked on, with its set and weight.
#[derive(Debug, Clone, Copy)]
pub(super) struct Weighed<'a> {
    pub(super) case: &'a Case,
    pub(super) set: &'static Set,
    weight: f64,
}

impl Weighed<'_> {
    fn log_error(&self) -> f64 {
        self.case.error.max(ERROR_LEAST).ln()
    }

    /// The part of its simulation.
    fn part(&self, of: usize) -> usize {
        self.case.simulation % of
    }
}

/// The cases with weights: a simulation counts once, however many states it has, and a set at most as
/// much as it may.
pub(super) fn weighed<'a>(cases: impl Iterator<Item = &'a Case>) -> Vec<Weighed<'a>> {
    let with_set = |case: &'a Case| {
        let set = SETS.iter().find(|set| set.folder == case.set)?;
        Some(Weighed { case, set, weight: 1.0 })
    };
    let mut found: Vec<Weighed<'_>> = cases.filter_map(with_set).collect();
    let mut states: BTreeMap<(&str, usize), f64> = BTreeMap::new();
    for of in &found {
        *states.entry((&of.case.set, of.case.simulation)).or_default() += 1.0;
    }
    let mut simulations: BTreeMap<&str, f64> = BTreeMap::new();
    for (set, _) in states.keys() {
        *simulations.entry(set).or_default() += 1.0;
    }
    for of in &mut found {
        let of_set = simulations[of.case.set.as_str()];
        let share = (of.set.simulations_max / of_set).min(1.0);
        of.weight = share / states[&(of.case.set.as_str(), of.case.simulation)];
    }
    let mean = found.iter().map(|of| of.weight).sum::<f64>() / found.len().max(1) as f64;
    found.iter_mut().for_each(|of| of.weight /= mean);
    found
}

/// The law of these cases: two quantile regressions, and a bound that is raised until it holds in
/// each group of sets. None without cases.
pub(super) fn law(cases: &[Weighed<'_>], form: &Form) -> Option<Law> {
    let mut law = regressed(cases, form)?;
    let mut above: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for part in 0..INNER_FOLDS {
        // Another deal than the outer one, so that parts are not whole folds.
        let is_in = |of: &&Weighed<'_>| of.case.simulation / FOLDS % INNER_FOLDS == part;
        let rest: Vec<_> = cases.iter().filter(|of| !is_in(of)).copied().collect();
        let Some(other) = regressed(&rest, form) else { continue };
        for of in cases.iter().filter(is_in) {
            let (_, bound) = logs(&other, &of.case.facts);
            above.entry((form.group)(of.set)).or_default().push(of.log_error() - bound);
        }
    }
    let raise = above
        .values()
        .filter(|values| values.len() >= GROUP_LEAST)
        .filter_map(|values| conformal_quantile(values, 0.9))
        .fold(0.0, f64::max);
    law.bound += raise as f32;
    Some(law)
}

fn regressed(cases: &[Weighed<'_>], form: &Form) -> Option<Law> {
    if cases.is_empty() {
        return None;
    }
    let scales: Vec<Scale> = form.median.iter().map(|fact| Scale::of(cases, *fact)).collect();
    let row = |of: &Weighed<'_>, facts: &[Fact]| {
        let scaled = |scale: &Scale| scale.apply(&of.case.facts);
        let wanted = scales.iter().filter(|scale| facts.contains(&scale.fact)).map(scaled);
        std::iter::once(1.0).chain(wanted).collect::<Vec<f64>>()
    };
    let table = |facts: &[Fact], value: &dyn Fn(&Weighed<'_>) -> f64| Table {
        rows: cases.iter().map(|of| row(of, facts)).collect(),
        values: cases.iter().map(value).collect(),
        weights: cases.iter().map(|of| of.weight).collect(),
    };
    let median = table(&form.median, &|of| of.log_error()).quantile(0.5, RIDGE);
    let rest = |of: &Weighed<'_>| of.log_error() - dot(&row(of, &form.median), &median);
    let bound = table(&form.bound, &rest).quantile(0.9, RIDGE);
    let mut law = Law { median: median[0] as f32, bound: bound[0] as f32, terms: Vec::new() };
    let mut bounds = bound[1..].iter();
    for (scale, of_median) in scales.iter().zip(&median[1..]) {
        let has_bound = form.bound.contains(&scale.fact);
        let of_bound = if has_bound { bounds.next().copied() } else { None }.unwrap_or(0.0);
        let term = scale.term(*of_median, of_bound);
        law.median -= (of_median * scale.mean / scale.deviation) as f32;
        law.bound -= (of_bound * scale.mean / scale.deviation) as f32;
        law.terms.push(term);
    }
    Some(law)
}

/// Mean and standard deviation of a fact, and what it is at least and at most.
struct Scale {
    fact: Fact,
    mean: f64,
    deviation: f64,
    range: [f64; 2],
}

impl Scale {
    fn of(cases: &[Weighed<'_>], fact: Fact) -> Self {
        let values = || cases.iter().map(|of| f64::from(of.case.facts.get(fact)));
        let count = cases.len() as f64;
        let mean = values().sum::<f64>() / count;
        let variance = values().map(|v| (v - mean).powi(2)).sum::<f64>() / count;
        let range =
            [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)];
        Self { fact, mean, deviation: variance.sqrt() + 1e-9, range }
    }

    fn apply(&self, facts: &Facts) -> f64 {
        (f64::from(facts.get(self.fact)) - self.mean) / self.deviation
    }

    fn term(&self, median: f64, bound: f64) -> Term {
        let [least, most] = self.range;
        let room = MARGIN * (most - least) + 1e-6;
        Term {
            fact: self.fact,
            least: (least - room) as f32,
            most: (most + room) as f32,
            median: (median / self.deviation) as f32,
            bound: (bound / self.deviation) as f32,
        }
    }
}

/// Logarithms of median and bound, in range or not.
fn logs(law: &Law, facts: &Facts) -> (f64, f64) {
    let sum = |start: f32, of: fn(&Term) -> f32| {
        let add = |sum: f64, term: &Term| sum + f64::from(of(term) * facts.get(term.fact));
        law.terms.iter().fold(f64::from(start), add)
    };
    let median = sum(law.median, |term| term.median);
    let least = f64::from(papilla_engine::error_law::BOUND_LEAST);
    (median, median + sum(law.bound, |term| term.bound).max(least))
}

/// What a law that did not see a case states of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Checked<'a> {
    pub(super) of: Weighed<'a>,
    /// Median and bound; none where nothing is stated.
    pub(super) stated: Option<[f64; 2]>,
}

impl Checked<'_> {
    fn by<'a>(law: Option<&Law>, of: Weighed<'a>) -> Checked<'a> {
        let likely = law.map(|law| law.at(&of.case.facts)).filter(|likely| likely.is_stated());
        let likely = likely.filter(|_| !of.case.is_flagged);
        Checked { of, stated: likely.map(|of| [of.median, of.p90].map(f64::from)) }
    }
}

/// Cases that a law may be fitted to: of sets that are not set aside, without a flag, with all facts.
pub(super) fn usable<'a>(cases: &[Weighed<'a>], form: &Form) -> Vec<Weighed<'a>> {
    let is_known = |of: &Weighed<'_>| {
        let facts = &of.case.facts;
        !of.case.is_flagged && form.median.iter().all(|fact| facts.get(*fact).is_finite())
    };
    cases.iter().filter(|of| !of.set.is_final && is_known(of)).copied().collect()
}

/// Every case by a law of simulations that are not its own: of other folds, and of all where its set
/// is set aside.
pub(super) fn checked<'a>(cases: &[Weighed<'a>], form: &Form) -> Vec<Checked<'a>> {
    let usable = usable(cases, form);
    let mut found = Vec::with_capacity(cases.len());
    for part in 0..=FOLDS {
        let is_out = |of: &Weighed<'_>| of.part(FOLDS) == part;
        let fit: Vec<_> = usable.iter().filter(|of| !is_out(of)).copied().collect();
        let law = law(&fit, form);
        let mine = |of: &&Weighed<'_>| match part {
            FOLDS => of.set.is_final,
            _ => !of.set.is_final && is_out(of),
        };
        found.extend(cases.iter().filter(mine).map(|of| Checked::by(law.as_ref(), *of)));
    }
    found
}

/// Every case by a law that saw nothing of its set.
pub(super) fn checked_without_its_set<'a>(cases: &[Weighed<'a>], form: &Form) -> Vec<Checked<'a>> {
    let usable = usable(cases, form);
    let mut found = Vec::with_capacity(cases.len());
    for set in SETS.iter().filter(|set| !set.is_final) {
        let is_of = |of: &Weighed<'_>| of.set.folder == set.folder;
        let fit: Vec<_> = usable.iter().filter(|of| !is_of(of)).copied().collect();
        let law = law(&fit, form);
        let of_set = cases.iter().filter(|of| is_of(of));
        found.extend(of_set.map(|of| Checked::by(law.as_ref(), *of)));
    }
    found
}
