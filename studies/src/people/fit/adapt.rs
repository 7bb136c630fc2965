//! The least sum of squares with few simulations: what was simulated is interpolated, the least of
//! that is simulated next, and so on.

use super::least_squares::{cost, search};
use super::surrogate::{Surrogate, spread};
use serde::Serialize;

/// Evaluations of the surrogate in one search.
const SURROGATE_MOST: usize = 400;
/// Points from which the surrogate is searched.
const STARTS: usize = 5;
/// A point nearer to one that was simulated, in every constant, is not simulated again.
const NEAR: f64 = 0.01;
/// A round that gains less than this share of the cost is the last but one.
const GAIN_MIN: f64 = 2e-3;

/// A point that was simulated.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Evaluated {
    /// Where, each in 0 to 1.
    pub at: Vec<f64>,
    /// What was found; not a number where it was not reached.
    pub features: Vec<f64>,
}

/// Where a sum of squares is least.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Optimum {
    /// Constants that need a simulation, each in 0 to 1.
    pub at: Vec<f64>,
    /// The others.
    pub extras: Vec<f64>,
    /// Half the sum of squares.
    pub cost: f64,
}

/// Weighted differences from features, and from constants that need no simulation.
pub type Residuals<'a> = dyn Fn(&[f64], &[f64]) -> Vec<f64> + 'a;
/// Features at a point of the unit box.
pub type Evaluate<'a, E> = dyn FnMut(&[f64]) -> Result<Vec<f64>, E> + 'a;

/// A surrogate and what is asked of it.
pub struct Landscape<'a> {
    surrogate: Surrogate,
    residuals: &'a Residuals<'a>,
    /// Where searches begin, the constants without simulation at the end.
    starts: Vec<Vec<f64>>,
    dimension: usize,
}

impl<'a> Landscape<'a> {
    /// Of the points that were simulated; `extras` is where the other constants begin.
    #[must_use]
    pub fn new(evaluated: &[Evaluated], residuals: &'a Residuals<'a>, extras: &[f64]) -> Self {
        let points: Vec<Vec<f64>> = evaluated.iter().map(|e| e.at.clone()).collect();
        let features: Vec<Vec<f64>> = evaluated.iter().map(|e| e.features.clone()).collect();
        let mut order: Vec<(f64, Vec<f64>)> = evaluated
            .iter()
            .map(|e| own(e, residuals, extras))
            .map(|o| (o.cost, joined(&o)))
            .collect();
        order.retain(|o| o.0.is_finite());
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let starts = order.into_iter().take(STARTS).map(|o| o.1).collect();
        let dimension = points.first().map_or(0, Vec::len);
        Self { surrogate: Surrogate::new(&points, &features), residuals, starts, dimension }
    }

    /// Where the sum of squares is least, from the best points and from `also`; one constant may be
    /// held at a place.
    #[must_use]
    pub fn least(&self, held: Option<(usize, f64)>, also: &[Vec<f64>]) -> Optimum {
        let mut best: Option<(f64, Vec<f64>)> = None;
        for start in self.starts.iter().chain(also) {
            let free: Vec<usize> =
                (0..start.len()).filter(|k| held.is_none_or(|h| h.0 != *k)).collect();
            let whole = |part: &[f64]| {
                let mut x = start.clone();
                free.iter().zip(part).for_each(|(&k, v)| x[k] = *v);
                if let Some((k, v)) = held {
                    x[k] = v;
                }
                x
            };
            let from: Vec<f64> = free.iter().map(|&k| start[k]).collect();
            let found = search(&from, SURROGATE_MOST, &mut |part: &[f64]| {
                Ok::<_, std::convert::Infallible>(self.residuals(&whole(part)))
            });
            let Ok(found) = found;
            let cost = cost(&found.residuals);
            if cost.is_finite() && best.as_ref().is_none_or(|b| cost < b.0) {
                best = Some((cost, whole(&found.at)));
            }
        }
        let (cost, x) =
            best.unwrap_or_else(|| (f64::NAN, self.starts.first().cloned().unwrap_or_default()));
        let (at, extras) = x.split_at(self.dimension.min(x.len()));
        Optimum { at: at.to_vec(), extras: extras.to_vec(), cost }
    }

    fn residuals(&self, x: &[f64]) -> Vec<f64> {
        let (at, extras) = x.split_at(self.dimension);
        (self.residuals)(&self.surrogate.at(at), extras)
    }
}

/// Features with a correction.
#[must_use]
pub fn plus(features: &[f64], correction: &[f64]) -> Vec<f64> {
    features.iter().zip(correction).map(|(f, c)| f + c).collect()
}

fn joined(o: &Optimum) -> Vec<f64> {
    o.at.iter().chain(&o.extras).copied().collect()
}

/// A simulated point with the best of the constants that need no simulation.
#[must_use]
pub fn own(point: &Evaluated, residuals: &Residuals<'_>, extras: &[f64]) -> Optimum {
    let at = point.at.clone();
    let here = cost(&residuals(&point.features, extras));
    if extras.is_empty() || !here.is_finite() {
        return Optimum { at, extras: extras.to_vec(), cost: here };
    }
    let found = search(extras, SURROGATE_MOST, &mut |e: &[f64]| {
        Ok::<_, std::convert::Infallible>(residuals(&point.features, e))
    });
    let Ok(found) = found;
    Optimum { at, cost: cost(&found.residuals), extras: found.at }
}

/// The best of the points that were simulated.
#[must_use]
pub fn best(evaluated: &[Evaluated], residuals: &Residuals<'_>, extras: &[f64]) -> Optimum {
    let all = evaluated.iter().map(|e| own(e, residuals, extras));
    let least = all.filter(|o| o.cost.is_finite()).min_by(|a, b| a.cost.total_cmp(&b.cost));
    let none = || Optimum { at: Vec::new(), extras: extras.to_vec(), cost: f64::NAN };
    least.unwrap_or_else(none)
}

/// Simulates `start`, and points spread over the box until there are `count`.
///
/// # Errors
/// What `evaluate` returns.
pub fn design<E>(
    start: &[f64],
    count: usize,
    evaluate: &mut Evaluate<'_, E>,
) -> Result<Vec<Evaluated>, E> {
    let others = (0..count.saturating_sub(1)).map(|k| spread(k, start.len()));
    let point = |at: Vec<f64>| Ok(Evaluated { features: evaluate(&at)?, at });
    std::iter::once(start.to_vec()).chain(others).map(point).collect()
}

/// Simulates the least of the surrogate, at most `rounds` times, and gives the best point of all.
///
/// # Errors
/// What `evaluate` returns.
pub fn refine<E>(
    evaluated: &mut Vec<Evaluated>,
    residuals: &Residuals<'_>,
    extras: &[f64],
    rounds: usize,
    evaluate: &mut Evaluate<'_, E>,
) -> Result<Optimum, E> {
    let mut slow = 0;
    for _ in 0..rounds {
        let before = best(evaluated, residuals, extras).cost;
        let aim = Landscape::new(evaluated, residuals, extras).least(None, &[]);
        let apart = |e: &Evaluated| {
            e.at.iter().zip(&aim.at).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        if evaluated.iter().any(|e| apart(e) < NEAR) {
            break;
        }
        let features = evaluate(&aim.at)?;
        evaluated.push(Evaluated { at: aim.at, features });
        let after = best(evaluated, residuals, extras).cost;
        slow = if before - after < GAIN_MIN * before { slow + 1 } else { 0 };
        if slow == 2 {
            break;
        }
    }
    Ok(best(evaluated, residuals, extras))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    /// Logarithms of stiffness and modulus of a layered pad in closed form: `a b` and `a^2 + c` are
    /// felt, `d` is not.
    fn features(x: &[f64]) -> Vec<f64> {
        let [a, b, c] = [0, 1, 2].map(|k| (1.5 * x[k]).exp());
        vec![(a * b).ln(), (a * a + c).ln(), (a * b * b).ln(), (c + b).ln()]
    }

    #[test]
    fn the_point_that_made_the_features_is_found_with_few_evaluations() {
        let truth = [0.35, 0.62, 0.2, 0.5];
        let wanted = features(&truth);
        let mut count = 0;
        let mut evaluate = |x: &[f64]| {
            count += 1;
            Ok::<_, Infallible>(features(x))
        };
        let residuals = |f: &[f64], _: &[f64]| -> Vec<f64> {
            f.iter().zip(&wanted).map(|(a, b)| (a - b) / 0.1).collect()
        };
        let Ok(mut evaluated) = design(&[0.5; 4], 20, &mut evaluate);
        let before = best(&evaluated, &residuals, &[]).cost;
        let Ok(found) = refine(&mut evaluated, &residuals, &[], 12, &mut evaluate);
        assert!(found.cost < 0.02 && found.cost < 0.05 * before, "{before} {found:?}");
        for k in 0..3 {
            assert!((found.at[k] - truth[k]).abs() < 0.08, "{found:?}");
        }
        assert_eq!(count, evaluated.len());
        assert!(count <= 32, "{count}");
    }

    #[test]
    fn constants_without_a_simulation_are_found_too_and_failed_points_are_passed_by() {
        let mut evaluate = |x: &[f64]| {
            let fails = x[0] > 0.8;
            Ok::<_, Infallible>(if fails { vec![f64::NAN; 2] } else { vec![x[0], x[0] * x[1]] })
        };
        let residuals = |f: &[f64], e: &[f64]| {
            vec![10.0 * (f[0] - 0.4), f[1] - 0.2, 5.0 * (e[0] * f[0] - 0.28)]
        };
        let Ok(mut evaluated) = design(&[0.9, 0.9], 14, &mut evaluate);
        assert!(evaluated[0].features[0].is_nan());
        let Ok(found) = refine(&mut evaluated, &residuals, &[0.5], 8, &mut evaluate);
        assert!(
            (found.at[0] - 0.4).abs() < 0.02 && (found.extras[0] - 0.7).abs() < 0.05,
            "{found:?}"
        );
        // Held elsewhere, the cost is greater and the constant stays.
        let landscape = Landscape::new(&evaluated, &residuals, &[0.5]);
        let held = landscape.least(Some((0, 0.6)), &[]);
        assert!(held.at[0] == 0.6 && held.cost > 1.5, "{held:?}");
    }
}
