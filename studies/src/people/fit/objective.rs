//! What a finger is fitted to: rows of published figures, or of a person's own records.

use super::parameters::{Parameter, RELAXATION, RELAXATION_TIMES_S, values};
use super::record::{RecordedPress, RecordedSample, relaxed_n};
use crate::people::PeopleError;
use crate::people::force_path::{ForcePath, steps_mm};
use crate::people::measured::{Figure, Measured, Quantity};
use crate::people::pad;
use crate::people::press::{Cells, Press, Subject};
use crate::people::report::words;
use crate::people::solution::{Course, Reads, Solution};
use crate::people::study::plates;
use std::mem::discriminant;
use std::path::Path;

/// Half the width of what a figure without a spread may be, as a logarithm: that of Dzidek et al.'s
/// moduli, .07 to .2 MPa, the only range over people that a source here prints.
const SPREAD: f64 = 0.524_911_062_249_340_4;
/// What a recorded force is believed to miss, as a logarithm: a tenth.
const RECORD_SPREAD: f64 = 0.1;
/// Samples of one press that count as many rows; more of them lie too near to each other to tell more.
const SAMPLES_COUNTED: f64 = 8.0;
/// Presses that are simulated at a time.
const TOGETHER: usize = 2;
/// Least loss of volume that is told from none, %.
const VOLUME_LEAST_PERCENT: f64 = 1e-3;
/// Largest distance of stored states of a recorded press, mm, and their least number.
const STEP_MAX_MM: f64 = 0.25;
const STATES_MIN: f64 = 6.0;

/// A row that is fitted.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Target {
    /// What it is.
    pub name: String,
    /// People's, or the recorded force.
    pub people: String,
    /// The press that it is read from.
    pub press: usize,
    /// People's, or the middle of their range by its logarithm.
    middle: f64,
    /// Half the width of the range, as a logarithm.
    spread: f64,
    /// Root of one over the number of rows that count as one.
    weight: f64,
    /// How far it may be missed, as a logarithm.
    allowed: f64,
    /// Whether less is as good.
    at_most: bool,
}

/// Rows, and the presses that they are read from.
pub(crate) struct Data {
    /// The rows.
    pub targets: Vec<Target>,
    source: Source,
}

enum Source {
    /// Inclination, degrees, and largest force, N, of each plate; the figure of each row.
    Published { plates: Vec<(f64, f64)>, figures: Vec<Quantity> },
    /// Each press with the depths, mm, at which it is simulated.
    Recorded(Vec<(RecordedPress, Vec<f64>)>),
}

impl Data {
    /// The rows of figures that a slow press with a plate decides: not the ratio of two others, nor a
    /// coefficient of determination, nor what takes time, nor peak over mean pressure, which on the
    /// even coarse mesh tells of the mesh.
    pub(crate) fn published(measured: &Measured) -> Self {
        use Quantity as Q;
        let plates = plates(measured);
        let fits = |f: &&Figure| {
            let left = matches!(
                f.quantity,
                Q::Stiffening { .. } | Q::Exponential { .. } | Q::PeakOverMean { .. }
            );
            f.quantity.plate().is_some() && !left
        };
        let rows: Vec<&Figure> = measured.figures.iter().filter(fits).collect();
        let alike = |f: &Figure| {
            let same = |o: &&&Figure| discriminant(&o.quantity) == discriminant(&f.quantity);
            rows.iter().filter(same).count() as f64
        };
        let target = |f: &&Figure| {
            let (middle, spread) = match (f.range, f.value.or(f.at_most)) {
                (Some([low, high]), _) => ((low * high).sqrt(), 0.5 * (high / low).ln()),
                (None, value) => (value.unwrap_or(f64::NAN), SPREAD),
            };
            let pitch = f.quantity.plate().map(|p| p.0);
            Target {
                name: words::quantity(&f.quantity),
                people: f.people(),
                press: plates.iter().position(|p| Some(p.0) == pitch).unwrap_or(0),
                middle,
                spread,
                weight: alike(f).powf(-0.5),
                allowed: spread,
                at_most: f.at_most.is_some(),
            }
        };
        let targets = rows.iter().map(target).collect();
        let figures = rows.iter().map(|f| f.quantity).collect();
        Self { targets, source: Source::Published { plates, figures } }
    }

    /// The rows of a person's own records.
    pub(crate) fn recorded(presses: Vec<RecordedPress>) -> Self {
        let mut targets = Vec::new();
        for (press, recorded) in presses.iter().enumerate() {
            let rows: Vec<&RecordedSample> =
                recorded.samples.iter().filter(|s| counts(s)).collect();
            let weight = (SAMPLES_COUNTED / rows.len() as f64).min(1.0).sqrt();
            targets.extend(rows.iter().map(|s| Target {
                name: format!("{}: force at {} mm, {} s, N", recorded.name, s.depth_mm, s.time_s),
                people: s.force_n.to_string(),
                press,
                middle: s.force_n,
                spread: RECORD_SPREAD,
                weight,
                allowed: 2.0 * RECORD_SPREAD,
                at_most: false,
            }));
        }
        let depths = |press: RecordedPress| {
            let deepest = press.deepest_mm();
            let count = (deepest / STEP_MAX_MM).ceil().max(STATES_MIN);
            let depths = steps_mm(deepest / count, deepest);
            (press, depths)
        };
        Self { targets, source: Source::Recorded(presses.into_iter().map(depths).collect()) }
    }

    /// Constants beyond those that need a simulation.
    pub(crate) fn extras(&self) -> &'static [Parameter] {
        match self.source {
            Source::Published { .. } => &[],
            Source::Recorded(_) => &RELAXATION,
        }
    }

    /// Every press, side by side.
    pub(crate) fn solved(
        &self,
        subject: &Subject,
        cells: Cells,
        folder: &Path,
    ) -> Result<Vec<Solution>, PeopleError> {
        let plate = |&(pitch_deg, until_n): &(f64, f64)| {
            pad::pressed(pitch_deg, until_n, subject.clone(), cells, folder)
        };
        let record = |(press, depths_mm): &(RecordedPress, Vec<f64>)| {
            let RecordedPress { indenter, pitch_deg, .. } = press;
            let own = Press {
                name: format!("record-{}", indenter.name()),
                indenter: indenter.clone(),
                ..Press::plate(*pitch_deg, subject.clone())
            };
            let depths_mm = depths_mm.clone();
            let course = Course { cells, depths_mm, until_n: f64::INFINITY, reads: Reads::Force };
            Solution::found_or_solved(&own, &course, folder)
        };
        match &self.source {
            Source::Published { plates, .. } => side_by_side(plates, &plate),
            Source::Recorded(presses) => side_by_side(presses, &record),
        }
    }

    /// Logarithms of what a simulation says: of each row's figure, or of the force at each depth. Not a
    /// number where a press did not come so far.
    pub(crate) fn features(
        &self,
        subject: &Subject,
        solutions: &[Solution],
    ) -> Result<Vec<f64>, PeopleError> {
        match &self.source {
            Source::Published { figures, .. } => {
                let one = |(target, quantity): (&Target, &Quantity)| match pad::figure(
                    quantity,
                    subject,
                    &solutions[target.press],
                ) {
                    Ok(v) => Ok(v.max(VOLUME_LEAST_PERCENT).ln()),
                    Err(PeopleError::Force { .. }) => Ok(f64::NAN),
                    Err(e) => Err(e),
                };
                self.targets.iter().zip(figures).map(one).collect()
            }
            Source::Recorded(presses) => {
                let path = |(s, (_, depths)): (&Solution, &(RecordedPress, Vec<f64>))| {
                    let at = |k: usize| s.path.force_n.get(k).map_or(f64::NAN, |f| f.ln());
                    (0..depths.len()).map(at).collect::<Vec<f64>>()
                };
                Ok(solutions.iter().zip(presses).flat_map(path).collect())
            }
        }
    }

    /// Number of features.
    pub(crate) fn feature_count(&self) -> usize {
        match &self.source {
            Source::Published { figures, .. } => figures.len(),
            Source::Recorded(presses) => presses.iter().map(|p| p.1.len()).sum(),
        }
    }

    /// What each row is with these features, and with constants of [`Self::extras`] at a place of the
    /// unit box.
    pub(crate) fn here(&self, features: &[f64], extras: &[f64]) -> Vec<f64> {
        let Source::Recorded(presses) = &self.source else {
            return features.iter().map(|f| f.exp()).collect();
        };
        let over_stays = values(&RELAXATION, extras);
        let (mut from, mut rows) = (0, Vec::with_capacity(self.targets.len()));
        for (press, depths) in presses {
            let mut path = ForcePath::default();
            for (&d, f) in depths.iter().zip(&features[from..from + depths.len()]) {
                path.push(d, f.exp());
            }
            from += depths.len();
            let elastic: Vec<f64> =
                press.samples.iter().map(|s| path.force_at(s.depth_mm)).collect();
            let time: Vec<f64> = press.samples.iter().map(|s| s.time_s).collect();
            let forces = relaxed_n(&elastic, &time, &RELAXATION_TIMES_S, &over_stays);
            let kept = press.samples.iter().zip(forces).filter(|(s, _)| counts(s));
            rows.extend(kept.map(|(_, f)| f));
        }
        rows
    }

    /// Of what the surrogate misses of each feature, what concerns a row: its own, or the mean of its
    /// press.
    pub(crate) fn missed(&self, features: &[f64], row: usize) -> f64 {
        let Source::Recorded(presses) = &self.source else { return features[row] };
        let press = self.targets[row].press;
        let from: usize = presses[..press].iter().map(|p| p.1.len()).sum();
        let own = &features[from..from + presses[press].1.len()];
        own.iter().sum::<f64>() / own.len() as f64
    }

    /// Weighted differences of some rows.
    pub(crate) fn residuals(&self, rows: &[usize], features: &[f64], extras: &[f64]) -> Vec<f64> {
        let here = self.here(features, extras);
        rows.iter().map(|&k| self.targets[k].residual(here[k])).collect()
    }

    /// All rows in two halves: whole presses where there are several, else what comes first and what
    /// comes last of the one.
    pub(crate) fn halves(&self) -> [Vec<usize>; 2] {
        let presses = 1 + self.targets.iter().map(|t| t.press).max().unwrap_or(0);
        let second = |k: usize| match presses {
            1 => 2 * k >= self.targets.len(),
            _ => self.targets[k].press % 2 == 1,
        };
        let half = |side: bool| (0..self.targets.len()).filter(|&k| second(k) == side).collect();
        [half(false), half(true)]
    }
}

/// Whether a sample is a row: the first of a press may be its start.
fn counts(sample: &RecordedSample) -> bool {
    sample.force_n > 0.0 && sample.depth_mm > 0.0
}

fn side_by_side<T: Sync>(
    asked: &[T],
    solve: &(dyn Fn(&T) -> Result<Solution, PeopleError> + Sync),
) -> Result<Vec<Solution>, PeopleError> {
    let join = |t: std::thread::ScopedJoinHandle<'_, Result<_, PeopleError>>| {
        t.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    };
    let mut found = Vec::with_capacity(asked.len());
    for some in asked.chunks(TOGETHER) {
        let solved: Result<Vec<_>, PeopleError> = std::thread::scope(|scope| {
            let threads: Vec<_> = some.iter().map(|one| scope.spawn(move || solve(one))).collect();
            threads.into_iter().map(join).collect()
        });
        found.extend(solved?);
    }
    Ok(found)
}

impl Target {
    /// Logarithm of the finger's over people's, over the spread: within 1 it lies in people's range.
    pub(crate) fn residual(&self, here: f64) -> f64 {
        let off = (here / self.middle).ln() / self.spread;
        self.weight * if self.at_most { off.max(0.0) } else { off }
    }

    /// Whether a figure lies in people's range, or a recorded force within its spread twice over.
    pub(crate) fn met(&self, here: f64) -> bool {
        let off = (here / self.middle).ln();
        let far = if self.at_most { off } else { off.abs() };
        far <= self.allowed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use papilla_sdf::IndenterSpec;

    #[test]
    fn every_quantity_counts_once_and_its_range_is_one() {
        let data = Data::published(&Measured::shipped().unwrap());
        // Stiffness, area, Hertz' modulus, volume.
        let weights: f64 = data.targets.iter().map(|t| t.weight * t.weight).sum();
        assert!((weights - 4.0).abs() < 1e-12, "{weights}");
        let hertz = data.targets.iter().find(|t| t.people == "0.07 to 0.2").unwrap();
        assert!((hertz.residual(0.07) / hertz.weight + 1.0).abs() < 1e-12);
        assert!((hertz.residual(0.2) / hertz.weight - 1.0).abs() < 1e-12);
        assert!((SPREAD - 0.5 * (0.2_f64 / 0.07).ln()).abs() < 1e-12);
        assert!(hertz.met(0.071) && !hertz.met(0.069) && !hertz.met(0.21));
        let volume = data.targets.iter().find(|t| t.at_most).unwrap();
        assert_eq!(volume.residual(1.0), 0.0);
        assert!(volume.residual(6.0) > 0.0);
    }

    #[test]
    fn halves_are_whole_presses_or_the_ends_of_one() {
        let published = Data::published(&Measured::shipped().unwrap());
        let [flat, inclined] = published.halves();
        assert_eq!(flat.len() + inclined.len(), published.targets.len());
        let press = |rows: &[usize]| rows.iter().map(|&k| published.targets[k].press).max();
        assert_eq!((press(&flat), press(&inclined)), (Some(0), Some(1)));
        let sample = |k: u32| RecordedSample {
            time_s: f64::from(k),
            depth_mm: 0.1 * f64::from(k),
            force_n: 0.01 * f64::from(k),
        };
        let press = RecordedPress {
            name: "one".into(),
            indenter: IndenterSpec::default(),
            pitch_deg: 0.0,
            samples: (0..=6).map(sample).collect(),
        };
        // The start is no row.
        let [first, last] = Data::recorded(vec![press]).halves();
        assert_eq!((first, last), (vec![0, 1, 2], vec![3, 4, 5]));
    }

    /// The force that a record is compared with is that of its path, slow or fast.
    #[test]
    fn forces_of_a_record_are_those_of_its_path() {
        let press = |step_s: f64| RecordedPress {
            name: "a".into(),
            indenter: IndenterSpec::default(),
            pitch_deg: 0.0,
            samples: (1..=4)
                .map(|k| {
                    let k = f64::from(k);
                    RecordedSample { time_s: step_s * k, depth_mm: 0.25 * k, force_n: 1.0 }
                })
                .collect(),
        };
        let forces = |step_s: f64| {
            let data = Data::recorded(vec![press(step_s)]);
            let Source::Recorded(presses) = &data.source else { panic!("recorded") };
            let features: Vec<f64> =
                presses[0].1.iter().map(|d| (0.7 * d.powf(1.5)).ln()).collect();
            assert_eq!(features.len(), data.feature_count());
            data.here(&features, &[0.5; 3])
        };
        let (slow, fast) = (forces(1e4), forces(1e-9));
        let stays = values(&RELAXATION, &[0.5; 3]).iter().sum::<f64>() + 1.0;
        for (k, (s, f)) in slow.iter().zip(&fast).enumerate() {
            let exact = 0.7 * (0.25 * (k as f64 + 1.0)).powf(1.5);
            assert!((s / exact - 1.0).abs() < 1e-3, "{s} {exact}");
            assert!((f / exact / stays - 1.0).abs() < 1e-6, "{f} {exact}");
        }
    }
}
