//! Which constants the rows tell: how far each can be moved before the others cannot make up for it.

use super::adapt::{Landscape, Optimum};
use super::parameters::Parameter;
use serde::Serialize;

/// Places at which a constant is held.
const PLACES: usize = 21;
/// Rise of half the sum of squares at the ends of the interval: a row's spread counts as one standard
/// deviation, so that the interval holds the truth 68 times in 100.
const RISE: f64 = 0.5;
/// Share of the bounds within which a constant is told.
const TOLD: f64 = 0.5;
/// Share of the bounds from which on it is not.
const NOT_TOLD: f64 = 0.9;

/// How well the rows tell a constant.
#[derive(Clone, Debug, Serialize)]
pub struct Told {
    /// Least value that is as good, within [`RISE`].
    pub low: f64,
    /// Largest.
    pub high: f64,
    /// The interval as a share of the bounds.
    pub share: f64,
    /// Half the sum of squares over its least, at each place from bound to bound.
    pub rise: Vec<f64>,
}

impl Told {
    /// In a word.
    #[must_use]
    pub fn word(&self) -> &'static str {
        if self.share <= TOLD {
            "told"
        } else if self.share < NOT_TOLD {
            "partly told"
        } else {
            "not told"
        }
    }

    /// Of one constant, the `k`-th, around an optimum.
    #[must_use]
    pub fn new(
        landscape: &Landscape<'_>,
        parameter: &Parameter,
        k: usize,
        optimum: &Optimum,
    ) -> Self {
        let around: Vec<f64> = optimum.at.iter().chain(&optimum.extras).copied().collect();
        let place = |i: usize| i as f64 / (PLACES - 1) as f64;
        let costs: Vec<f64> = (0..PLACES)
            .map(|i| landscape.least(Some((k, place(i))), std::slice::from_ref(&around)).cost)
            .collect();
        let free = landscape.least(None, std::slice::from_ref(&around)).cost;
        let least = costs.iter().copied().fold(free, f64::min);
        let rise: Vec<f64> = costs.iter().map(|c| c - least).collect();
        let [low, high] = interval(&rise);
        let (low, high, share) = (parameter.value(low), parameter.value(high), high - low);
        Self { low, high, share, rise }
    }
}

/// Where a profile lies below [`RISE`], each in 0 to 1, along lines between places.
fn interval(rise: &[f64]) -> [f64; 2] {
    let last = rise.len() - 1;
    let inside = |i: &usize| rise[*i] <= RISE;
    let least = (0..=last).min_by(|&a, &b| rise[a].total_cmp(&rise[b])).unwrap_or(0);
    let first = (0..=last).find(inside).unwrap_or(least);
    let end = (0..=last).rev().find(inside).unwrap_or(least);
    // The part of the way from a place inside to its neighbour outside.
    let part = |a: usize, b: usize| ((RISE - rise[a]) / (rise[b] - rise[a])).clamp(0.0, 1.0);
    let low = if first == 0 { 0.0 } else { first as f64 - part(first, first - 1) };
    let high = if end == last { last as f64 } else { end as f64 + part(end, end + 1) };
    [low / last as f64, high / last as f64]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::people::fit::adapt::{design, refine};
    use crate::people::fit::parameters::PARAMETERS;
    use std::convert::Infallible;

    #[test]
    fn a_parabola_has_the_interval_of_its_curvature() {
        // (x - .4)^2 / 2 s^2 rises by a half at .4 -+ s.
        let rise = |s: f64| -> Vec<f64> {
            (0..PLACES).map(|i| 0.5 * ((0.05 * i as f64 - 0.4) / s).powi(2)).collect()
        };
        let [low, high] = interval(&rise(0.2));
        assert!((low - 0.2).abs() < 0.01 && (high - 0.6).abs() < 0.01, "{low} {high}");
        assert_eq!(interval(&rise(3.0)), [0.0, 1.0]);
        let [low, high] = interval(&rise(0.01));
        assert!(high - low < 0.06 && low <= 0.4 && high >= 0.4, "{low} {high}");
    }

    /// Two constants of which only the product is felt are not told, however well it is; one that is
    /// felt alone is, and one that nothing feels is not.
    #[test]
    fn a_product_is_told_and_its_factors_are_not() {
        let mut evaluate =
            |x: &[f64]| Ok::<_, Infallible>(vec![x[0] + x[1], x[2], x[0] + x[1] + 0.3 * x[2]]);
        let residuals = |f: &[f64], _: &[f64]| -> Vec<f64> {
            [1.0, 0.3, 1.09].iter().zip(f).map(|(w, f)| (f - w) / 0.05).collect()
        };
        let Ok(mut evaluated) = design(&[0.2; 4], 24, &mut evaluate);
        let Ok(optimum) = refine(&mut evaluated, &residuals, &[], 6, &mut evaluate);
        let landscape = Landscape::new(&evaluated, &residuals, &[]);
        let told = |k: usize| Told::new(&landscape, &PARAMETERS[k], k, &optimum);
        let all: Vec<Told> = (0..4).map(told).collect();
        let words: Vec<&str> = all.iter().map(Told::word).collect();
        assert_eq!(words, ["not told", "not told", "told", "not told"], "{all:?}");
        // Its standard deviation is .05 / root(1 + .3^2 ...), about a twentieth on either side.
        assert!((0.05..0.15).contains(&all[2].share), "{:?}", all[2]);
        let truth = PARAMETERS[2].value(0.3);
        assert!(all[2].low < truth && truth < all[2].high);
    }
}
