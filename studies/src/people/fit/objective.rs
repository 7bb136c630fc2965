//! How far a finger is from people's, row by row.

use crate::people::PeopleError;
use crate::people::measured::{Figure, Quantity};
use crate::people::pad;
use crate::people::solution::Solution;
use std::mem::discriminant;

/// Half the width of what a figure without a spread may be, as a logarithm: that of Dzidek et al.'s
/// moduli, .07 to .2 MPa, the only range over people that a source here prints.
const SPREAD: f64 = 0.524_911_062_249_340_4;

/// A row that is fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Target<'a> {
    pub figure: &'a Figure,
    /// People's, or the middle of their range by its logarithm.
    middle: f64,
    /// Half the width of the range, as a logarithm.
    spread: f64,
    /// Root of one over the number of rows of the same quantity, so that each quantity counts once.
    weight: f64,
}

/// The rows of `figures` that a slow press with a plate decides: not the ratio of two others, nor a
/// coefficient of determination, nor what takes time, nor peak over mean pressure, which on the even
/// coarse mesh tells of the mesh.
pub(crate) fn targets(figures: &[Figure]) -> Vec<Target<'_>> {
    let fits = |f: &&Figure| {
        use Quantity as Q;
        let left = matches!(
            f.quantity,
            Q::Stiffening { .. } | Q::Exponential { .. } | Q::PeakOverMean { .. }
        );
        f.quantity.plate().is_some() && !left
    };
    let rows: Vec<&Figure> = figures.iter().filter(fits).collect();
    let alike = |f: &Figure| {
        let same = |o: &&&Figure| discriminant(&o.quantity) == discriminant(&f.quantity);
        rows.iter().filter(same).count() as f64
    };
    rows.iter()
        .map(|figure| {
            let (middle, spread) = match (figure.range, figure.value.or(figure.at_most)) {
                (Some([low, high]), _) => ((low * high).sqrt(), 0.5 * (high / low).ln()),
                (None, value) => (value.unwrap_or(f64::NAN), SPREAD),
            };
            Target { figure, middle, spread, weight: alike(figure).powf(-0.5) }
        })
        .collect()
}

impl Target<'_> {
    /// What the finger has, at the force of the row or the largest that its press reached.
    pub(crate) fn here(&self, presses: &[(f64, Solution)]) -> Result<f64, PeopleError> {
        let quantity = &self.figure.quantity;
        let pitch = quantity.plate().map(|p| p.0);
        match presses.iter().find(|(at, _)| Some(*at) == pitch) {
            Some((_, press)) => pad::figure(&quantity.at_most_n(press.path.deepest().0), press),
            None => Ok(f64::NAN),
        }
    }

    /// Logarithm of the finger's over people's, over the spread: within 1 it lies in people's range.
    pub(crate) fn residual(&self, here: f64) -> f64 {
        let off = (here / self.middle).ln() / self.spread;
        self.weight * if self.figure.at_most.is_some() { off.max(0.0) } else { off }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::people::measured::Measured;

    #[test]
    fn every_quantity_counts_once_and_its_range_is_one() {
        let measured = Measured::shipped().unwrap();
        let targets = targets(&measured.figures);
        // Stiffness, area, Hertz' modulus, volume.
        let weights: f64 = targets.iter().map(|t| t.weight * t.weight).sum();
        assert!((weights - 4.0).abs() < 1e-12, "{weights}");
        let hertz = targets.iter().find(|t| t.figure.range.is_some()).unwrap();
        let [low, high] = hertz.figure.range.unwrap();
        assert!((hertz.residual(low) / hertz.weight + 1.0).abs() < 1e-12);
        assert!((hertz.residual(high) / hertz.weight - 1.0).abs() < 1e-12);
        assert!((SPREAD - 0.5 * (high / low).ln()).abs() < 1e-12);
        let volume = targets.iter().find(|t| t.figure.at_most.is_some()).unwrap();
        assert_eq!(volume.residual(1.0), 0.0);
        assert!(volume.residual(6.0) > 0.0);
    }
}
