//! The drive whose SED comes closest to a wanted map.

use crate::Array;
use crate::nnls::{self, Coupled};

/// How often a step that made the fit worse is halved.
const HALVINGS: usize = 4;
/// Share of the diagonal that is added to it: pins whose strains are nearly the same share a drive.
const DAMPING: f64 = 1e-6;
/// A network's SED is set against the half-space's where it is above this part of the greatest
/// that is wanted; below, the two are taken to agree.
const LEAST: f32 = 1e-3;
/// Greatest factor between the two.
const FACTOR_MAX: f32 = 16.0;

/// Finds drives, one frame after the other; no frame depends on another, none allocates.
#[derive(Debug)]
pub struct Inverse {
    array: Array,
    /// `sum_x |s_i(x)| |s_k(x)|`: of the linear problem.
    magnitudes: Vec<f64>,
    /// Pins that share a sample: the same in every problem.
    coupled: Coupled,
    gram: Vec<f64>,
    slope: Vec<f64>,
    drive: Vec<f64>,
    trial: Vec<f64>,
    /// What a network makes of the half-space's SED, a factor a sample.
    factor: Vec<f32>,
    /// Of the taps of one sample: the derivative of SED by each drive.
    derivative: Vec<f64>,
    drive_pa: Vec<f32>,
}

impl Inverse {
    /// Gauss-Newton steps of a frame.
    pub const STEPS: usize = 3;

    /// Takes all memory that frames need.
    #[must_use]
    pub fn new(array: Array) -> Self {
        let n = array.pins();
        let [mut magnitudes, gram] = [(); 2].map(|()| vec![0.0; n * n]);
        let [slope, drive, trial, derivative] = [(); 4].map(|()| vec![0.0; n]);
        let mut begin = 0;
        for &(_, end) in &array.samples {
            let taps = &array.taps[begin..end as usize];
            for a in taps {
                for b in taps {
                    magnitudes[a.pin as usize * n + b.pin as usize] +=
                        magnitude(&a.strain) * magnitude(&b.strain);
                }
            }
            begin = end as usize;
        }
        let coupled = Coupled::of(&magnitudes, n);
        damp(&mut magnitudes, n);
        let factor = vec![1.0; array.samples.len()];
        let drive_pa = vec![0.0; n];
        Self { array, magnitudes, coupled, gram, slope, drive, trial, factor, derivative, drive_pa }
    }

    /// The array.
    #[must_use]
    pub fn array(&self) -> &Array {
        &self.array
    }

    /// The drive that was found last, Pa, one a pin.
    #[must_use]
    pub fn drive_pa(&self) -> &[f32] {
        &self.drive_pa
    }

    /// The drive whose SED on the half-space is closest to `wanted_j_per_m3`, 224 x 224, after
    /// `steps` steps of Gauss-Newton; without any, the one whose magnitudes add to it.
    ///
    /// # Panics
    /// If `wanted_j_per_m3` is no map.
    pub fn fit(&mut self, wanted_j_per_m3: &[f32], steps: usize) -> &[f32] {
        self.factor.fill(1.0);
        self.slope.fill(0.0);
        let mut begin = 0;
        for &(index, end) in &self.array.samples {
            let root = f64::from(wanted_j_per_m3[index as usize].max(0.0)).sqrt();
            if root > 0.0 {
                for tap in &self.array.taps[begin..end as usize] {
                    self.slope[tap.pin as usize] += root * magnitude(&tap.strain);
                }
            }
            begin = end as usize;
        }
        self.drive.fill(0.0);
        let Self { magnitudes, coupled, slope, drive, .. } = self;
        nnls::solve(magnitudes, coupled, slope, &self.array.max_pa, drive);
        self.refine(wanted_j_per_m3, steps)
    }

    /// Corrects the drive that was found last by the SED that a network gives for it: the
    /// half-space's is multiplied, pixel by pixel, by what is between the two, and fitted again.
    ///
    /// # Panics
    /// If a map is none.
    pub fn correct(
        &mut self,
        wanted_j_per_m3: &[f32],
        answered_j_per_m3: &[f32],
        steps: usize,
    ) -> &[f32] {
        let samples = &self.array.samples;
        let greatest = samples.iter().map(|&(i, _)| wanted_j_per_m3[i as usize]);
        let least = LEAST * greatest.fold(0.0, f32::max);
        let mut begin = 0;
        for (&(index, end), factor) in samples.iter().zip(&mut self.factor) {
            let taps = &self.array.taps[begin..end as usize];
            let half_space = squares(taps, &self.drive).0 as f32;
            let answered = answered_j_per_m3[index as usize];
            // Both zero, or a map that is none: they agree.
            let between = (answered + least) / (half_space + least);
            let between = if between.is_finite() { between } else { 1.0 };
            *factor = between.clamp(1.0 / FACTOR_MAX, FACTOR_MAX);
            begin = end as usize;
        }
        self.refine(wanted_j_per_m3, steps)
    }

    fn refine(&mut self, wanted_j_per_m3: &[f32], steps: usize) -> &[f32] {
        let mut cost = self.cost(&self.drive, wanted_j_per_m3);
        for _ in 0..steps {
            self.linearise(wanted_j_per_m3);
            self.trial.copy_from_slice(&self.drive);
            let Self { gram, coupled, slope, trial, .. } = self;
            nnls::solve(gram, coupled, slope, &self.array.max_pa, trial);
            let before = cost;
            for _ in 0..=HALVINGS {
                let found = self.cost(&self.trial, wanted_j_per_m3);
                if found < cost {
                    cost = found;
                    self.drive.copy_from_slice(&self.trial);
                    break;
                }
                for (trial, drive) in self.trial.iter_mut().zip(&self.drive) {
                    *trial = 0.5 * (*trial + drive);
                }
            }
            if !(cost < before) {
                break;
            }
        }
        for (out, drive) in self.drive_pa.iter_mut().zip(&self.drive) {
            *out = *drive as f32;
        }
        &self.drive_pa
    }

    /// `sum_x (f(x) |sum_i a_i s_i(x)|^2 - wanted(x))^2`.
    fn cost(&self, drive: &[f64], wanted_j_per_m3: &[f32]) -> f64 {
        let (mut begin, mut sum) = (0, 0.0);
        for (&(index, end), factor) in self.array.samples.iter().zip(&self.factor) {
            let sed = squares(&self.array.taps[begin..end as usize], drive).0;
            sum += (f64::from(*factor) * sed - f64::from(wanted_j_per_m3[index as usize])).powi(2);
            begin = end as usize;
        }
        sum
    }

    /// The normal equations of Gauss-Newton at the drive `a`: SED is homogeneous of degree 2, so
    /// `J a = 2 SED(a)`, and the next drive `b` has `J b = wanted + SED(a)`.
    fn linearise(&mut self, wanted_j_per_m3: &[f32]) {
        let n = self.array.pins();
        self.gram.fill(0.0);
        self.slope.fill(0.0);
        let mut begin = 0;
        for (&(index, end), factor) in self.array.samples.iter().zip(&self.factor) {
            let taps = &self.array.taps[begin..end as usize];
            begin = end as usize;
            let (squares, strain) = squares(taps, &self.drive);
            if !(squares > 0.0) {
                continue;
            }
            let factor = f64::from(*factor);
            let due = f64::from(wanted_j_per_m3[index as usize]) + factor * squares;
            for (derivative, tap) in self.derivative.iter_mut().zip(taps) {
                let along = strain.iter().zip(tap.strain).map(|(a, b)| a * f64::from(b));
                *derivative = 2.0 * factor * along.sum::<f64>();
            }
            for (a, da) in taps.iter().zip(&self.derivative) {
                let row = &mut self.gram[a.pin as usize * n..][..n];
                for (b, db) in taps.iter().zip(&self.derivative) {
                    row[b.pin as usize] += da * db;
                }
                self.slope[a.pin as usize] += da * due;
            }
        }
        damp(&mut self.gram, n);
        for i in 0..n {
            // Damping pulls towards the drive at hand.
            let diagonal = self.gram[i * n + i];
            self.slope[i] += diagonal * DAMPING / (1.0 + DAMPING) * self.drive[i];
        }
    }
}

fn damp(gram: &mut [f64], n: usize) {
    (0..n).for_each(|i| gram[i * n + i] *= 1.0 + DAMPING);
}

fn magnitude(strain: &[f32; 6]) -> f64 {
    strain.iter().map(|s| f64::from(s * s)).sum::<f64>().sqrt()
}

/// Sum of the squares of the strain under a drive, and the strain.
fn squares(taps: &[crate::array::Tap], drive: &[f64]) -> (f64, [f64; 6]) {
    let mut strain = [0.0; 6];
    for tap in taps {
        let drive = drive[tap.pin as usize];
        if drive > 0.0 {
            for (sum, part) in strain.iter_mut().zip(tap.strain) {
                *sum += drive * f64::from(part);
            }
        }
    }
    (strain.iter().map(|s| s * s).sum(), strain)
}
