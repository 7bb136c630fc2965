//! What was simulated at some points of the unit box, interpolated between them.
//!
//! Radial basis functions `|x - x_i|^3` and a linear tail: the choice for few and costly evaluations
//! that has no constant to set (Powell 1992; Regis & Shoemaker 2007). A feature that a simulation did
//! not reach is left out at its point.

use faer::Mat;
use faer::prelude::Solve as _;

/// Interpolates several features.
#[derive(Clone, Debug)]
pub struct Surrogate {
    points: Vec<Vec<f64>>,
    features: Vec<Feature>,
}

/// One feature.
#[derive(Clone, Debug)]
struct Feature {
    /// Weight of each point; 0 where the feature is not known.
    weights: Vec<f64>,
    /// Constant, then slopes; not numbers where too few points know the feature.
    tail: Vec<f64>,
}

fn cubed(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y).powi(2)).sum::<f64>().powf(1.5)
}

impl Surrogate {
    /// Through the features (`[point][feature]`) of distinct points.
    #[must_use]
    pub fn new(points: &[Vec<f64>], features: &[Vec<f64>]) -> Self {
        let count = features.first().map_or(0, Vec::len);
        let feature = |k: usize| {
            let known: Vec<usize> =
                (0..points.len()).filter(|&i| features[i][k].is_finite()).collect();
            let values: Vec<f64> = known.iter().map(|&i| features[i][k]).collect();
            let at: Vec<&[f64]> = known.iter().map(|&i| points[i].as_slice()).collect();
            let (few, tail) = solved(&at, &values);
            let mut weights = vec![0.0; points.len()];
            for (&i, w) in known.iter().zip(few) {
                weights[i] = w;
            }
            Feature { weights, tail }
        };
        Self { points: points.to_vec(), features: (0..count).map(feature).collect() }
    }

    /// Every feature at a point.
    #[must_use]
    pub fn at(&self, x: &[f64]) -> Vec<f64> {
        let basis: Vec<f64> = self.points.iter().map(|p| cubed(p, x)).collect();
        let one = |f: &Feature| {
            let bent: f64 = f.weights.iter().zip(&basis).map(|(w, b)| w * b).sum();
            let straight: f64 = f.tail[1..].iter().zip(x).map(|(t, v)| t * v).sum();
            f.tail[0] + straight + bent
        };
        self.features.iter().map(one).collect()
    }

    /// Root mean square of what each feature misses at points that are left out one at a time; not a
    /// number where too few points know it.
    #[must_use]
    pub fn left_out(points: &[Vec<f64>], features: &[Vec<f64>]) -> Vec<f64> {
        let count = features.first().map_or(0, Vec::len);
        let mut sums = vec![(0.0, 0u32); count];
        for i in 0..points.len() {
            let without = |all: &[Vec<f64>]| {
                let mut rest = all.to_vec();
                rest.remove(i);
                rest
            };
            let found = Self::new(&without(points), &without(features)).at(&points[i]);
            for ((sum, f), there) in sums.iter_mut().zip(&found).zip(&features[i]) {
                if (f - there).is_finite() {
                    *sum = (sum.0 + (f - there).powi(2), sum.1 + 1);
                }
            }
        }
        sums.into_iter().map(|(sum, n)| (sum / f64::from(n)).sqrt()).collect()
    }
}

/// Weights and tail through values at points: `[[B, P], [P^T, 0]] [w, t] = [v, 0]`.
fn solved(points: &[&[f64]], values: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (n, tail) = (points.len(), points.first().map_or(1, |p| p.len() + 1));
    if n < tail {
        return (vec![0.0; n], vec![f64::NAN; tail]);
    }
    let linear = |i: usize, j: usize| if j == 0 { 1.0 } else { points[i][j - 1] };
    let matrix = Mat::from_fn(n + tail, n + tail, |i, j| match (i < n, j < n) {
        (true, true) => cubed(points[i], points[j]),
        (true, false) => linear(i, j - n),
        (false, true) => linear(j, i - n),
        (false, false) => 0.0,
    });
    let right = Mat::from_fn(n + tail, 1, |i, _| if i < n { values[i] } else { 0.0 });
    let found = matrix.partial_piv_lu().solve(&right);
    let of = |from: usize, to: usize| (from..to).map(|i| found[(i, 0)]).collect();
    (of(0, n), of(n, n + tail))
}

/// The `k`-th point of a sequence that fills the unit box evenly, whatever its dimension: multiples of
/// powers of `1 / phi`, `phi^(d + 1) = phi + 1` (Roberts 2018). The first is not its middle.
#[must_use]
pub fn spread(k: usize, dimension: usize) -> Vec<f64> {
    let mut phi = 2.0_f64;
    for _ in 0..60 {
        phi = (1.0 + phi).powf(1.0 / (dimension as f64 + 1.0));
    }
    let one = |j: usize| (0.5 + (k as f64 + 1.0) * phi.powi(-(j as i32 + 1))).fract();
    (0..dimension).map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(count: usize, dimension: usize) -> Vec<Vec<f64>> {
        (0..count).map(|k| spread(k, dimension)).collect()
    }

    #[test]
    fn a_plane_is_exact_and_every_point_is_met() {
        let at = points(12, 3);
        let plane = |x: &[f64]| 2.0 - x[0] + 3.0 * x[1] - 0.5 * x[2];
        let bent = |x: &[f64]| (2.0 * x[0]).exp() * (1.0 + x[1] * x[2]);
        let features: Vec<Vec<f64>> = at.iter().map(|x| vec![plane(x), bent(x)]).collect();
        let found = Surrogate::new(&at, &features);
        for (x, f) in at.iter().zip(&features) {
            let here = found.at(x);
            assert!((here[0] - f[0]).abs() < 1e-9 && (here[1] - f[1]).abs() < 1e-9);
        }
        let between = [0.31, 0.62, 0.17];
        assert!((found.at(&between)[0] - plane(&between)).abs() < 1e-9);
    }

    #[test]
    fn more_points_miss_less_and_what_was_not_reached_is_left_out() {
        let bent = |x: &[f64]| (1.5 * x[0]).exp() * (1.0 + x[1]);
        let missed = |count: usize| {
            let at = points(count, 2);
            let mut features: Vec<Vec<f64>> = at.iter().map(|x| vec![bent(x), x[0]]).collect();
            features[1][1] = f64::NAN;
            let found = Surrogate::new(&at, &features).at(&at[1]);
            assert!((found[1] - at[1][0]).abs() < 1e-9, "a plane is known without the point");
            Surrogate::left_out(&at, &features)[0]
        };
        assert!(missed(40) < 0.5 * missed(10), "{} {}", missed(40), missed(10));
        let few = Surrogate::new(&points(3, 4), &vec![vec![1.0]; 3]);
        assert!(few.at(&[0.5; 4])[0].is_nan());
    }

    #[test]
    fn points_are_spread_over_the_box() {
        for dimension in [1, 5, 9] {
            let at = points(64, dimension);
            for j in 0..dimension {
                let mean = at.iter().map(|x| x[j]).sum::<f64>() / 64.0;
                assert!((mean - 0.5).abs() < 0.05, "{dimension} {j}: {mean}");
                for quarter in 0..4 {
                    let inside = at.iter().filter(|x| (4.0 * x[j]) as usize == quarter).count();
                    assert!((8..=26).contains(&inside), "{dimension} {j} {quarter}: {inside}");
                }
            }
        }
    }
}
