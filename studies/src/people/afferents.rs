//! SA1 rates under spheres: what a receptor feels, fitted at the smallest force, tried at the others.

use crate::people::PeopleError;
use crate::people::measured::{Profile, Sa1};
use crate::people::press::{Press, Subject};
use crate::people::rates::{Law, line_of, r_squared};
use crate::people::receptors::{DEPTHS_MM, PLACES, SPACING_MM, Stimulus};
use crate::people::solution::{Reads, Solution, State, held_at};
use papilla_fingertip::mesh::fingertip::Density;
use serde::Serialize;
use std::path::Path;

/// One stimulus at one depth as what SA1 afferents answer to.
#[derive(Clone, Debug, Serialize)]
pub struct Fit {
    /// The stimulus.
    pub stimulus: Stimulus,
    /// Index into [`DEPTHS_MM`].
    pub depth: usize,
    /// Radius of the disc over which an afferent takes the mean of what is felt, mm; 0 is a point.
    pub pooled_mm: f64,
    /// Gain and threshold from the first force's row; absent where no rate rises with it.
    pub law: Option<Law>,
    /// What is felt under the last sphere over what is felt under the first, at the first force.
    pub growth: f64,
    /// R2 of that row.
    pub r2_fitted: f64,
    /// R2 of the rows of the other forces.
    pub r2_others: f64,
    /// The same if the threshold may be negative, a rate at rest.
    pub r2_others_free: f64,
    /// R2 of the profiles, all together.
    pub r2_profiles: f64,
    /// Where the profiles peak.
    pub peaks: Vec<Peak>,
}

/// Where a profile has its largest rate.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Peak {
    /// Curvature of the sphere, 1/m.
    pub curvature_per_m: f64,
    /// Distance from the middle where the measured rate is largest, mm.
    pub people_mm: f64,
    /// The same of the finger, mm.
    pub here_mm: f64,
}

/// What a fit says of measured places.
#[derive(Clone, Debug, Serialize)]
pub struct Predicted {
    /// Force, N.
    pub force_n: f64,
    /// Curvature of each sphere, or of all of a profile, 1/m.
    pub curvature_per_m: Vec<f64>,
    /// Distance of each place from the middle, mm.
    pub distance_mm: Vec<f64>,
    /// Measured impulses a second.
    pub measured_per_s: Vec<f64>,
    /// The finger's.
    pub here_per_s: Vec<f64>,
}

/// Rates and presses.
#[derive(Clone, Debug, Serialize)]
pub struct Afferents {
    /// Every stimulus at every depth.
    pub fits: Vec<Fit>,
    /// Rates of SED at the interface at each force, then of each profile.
    pub of_sed: Vec<Predicted>,
    /// The same of the fit with the largest R2 of the other forces.
    pub of_best: Vec<Predicted>,
    /// Which fit that is.
    pub best: usize,
    /// Largest |force of a state - force wanted| over force wanted.
    pub force_missed_max: f64,
    /// Largest |stored energy - work| over work.
    pub energy_vs_work_max: f64,
    /// Depth at each force, mm, `[curvature][force]`.
    pub depth_mm: Vec<Vec<f64>>,
    /// Processor time of the presses, s.
    pub solve_s: f64,
}

impl Afferents {
    /// Presses every sphere and fits.
    pub(crate) fn new(
        sa1: &Sa1,
        subject: &Subject,
        density: Density,
        folder: &Path,
        told: &mut dyn FnMut(&str),
    ) -> Result<Self, PeopleError> {
        let mut presses = Vec::with_capacity(sa1.curvature_per_m.len());
        for &curvature in &sa1.curvature_per_m {
            let press = Press::sphere(curvature, subject.clone());
            told(&press.name);
            presses.push(held_at(&press, &sa1.force_n, density, Reads::Receptors, folder)?);
        }
        let heard = Heard { sa1, presses: &presses };
        let mut fits: Vec<Fit> = Vec::new();
        for pooled_mm in POOLED_MM {
            for stimulus in Stimulus::ALL {
                let felt = |depth| Felt { pooled_mm, stimulus, depth };
                fits.extend((0..DEPTHS_MM.len()).map(|depth| heard.fit(felt(depth))));
            }
        }
        let best = (0..fits.len()).max_by(|&a, &b| {
            let score = |k: usize| fits[k].r2_others;
            score(a).total_cmp(&score(b))
        });
        let best = best.unwrap_or(0);
        let misses = presses.iter().flat_map(|p| p.path.force_n.iter().zip(&sa1.force_n));
        Ok(Self {
            of_sed: heard.predictions(&fits[0]),
            of_best: heard.predictions(&fits[best]),
            best,
            fits,
            force_missed_max: misses.map(|(f, w)| (f / w - 1.0).abs()).fold(0.0, f64::max),
            energy_vs_work_max: presses
                .iter()
                .map(Solution::energy_vs_work_max)
                .fold(0.0, f64::max),
            depth_mm: presses.iter().map(|p| p.path.depth_mm.clone()).collect(),
            solve_s: presses.iter().map(|p| p.solve_s).sum(),
        })
    }
}

/// Measured rates and the presses that go with them, one a curvature.
struct Heard<'a> {
    sa1: &'a Sa1,
    presses: &'a [Solution],
}

/// How far past the last state's force a value may be taken, of the force.
const BEYOND: f64 = 0.2;
/// Radii over which afferents take means, mm.
const POOLED_MM: [f64; 2] = [0.0, 1.0];
/// What an afferent without a law does.
const SILENT: Law = Law { gain: 0.0, threshold: 0.0 };

/// What an afferent answers to.
#[derive(Clone, Copy)]
struct Felt {
    pooled_mm: f64,
    stimulus: Stimulus,
    depth: usize,
}

impl Heard<'_> {
    fn fit(&self, felt: Felt) -> Fit {
        let row = |force_n: f64| -> Vec<f64> {
            (0..self.presses.len()).map(|k| self.felt(k, force_n, felt, 0.0)).collect()
        };
        let (forces, rates) = (&self.sa1.force_n, &self.sa1.rate_per_s);
        let first = row(forces[0]);
        let law = Law::fitted(&first, &rates[0]);
        let heard = |law: Option<Law>, felt: &[f64]| -> Vec<f64> {
            felt.iter().map(|q| law.unwrap_or(SILENT).rate_per_s(*q)).collect()
        };
        let others: Vec<f64> = forces[1..].iter().flat_map(|&f| row(f)).collect();
        let measured = rates[1..].concat();
        let along: Vec<f64> = self.sa1.profiles.iter().flat_map(|p| self.along(p, felt)).collect();
        let profiles: Vec<f64> =
            self.sa1.profiles.iter().flat_map(|p| p.rate_per_s.iter().copied()).collect();
        Fit {
            stimulus: felt.stimulus,
            depth: felt.depth,
            pooled_mm: felt.pooled_mm,
            law,
            growth: first.last().unwrap_or(&f64::NAN) / first[0],
            r2_fitted: r_squared(&rates[0], &heard(law, &first)),
            r2_others: r_squared(&measured, &heard(law, &others)),
            r2_others_free: r_squared(&measured, &heard(line_of(&first, &rates[0]), &others)),
            r2_profiles: r_squared(&profiles, &heard(law, &along)),
            peaks: self.sa1.profiles.iter().filter_map(|p| self.peak(p, felt)).collect(),
        }
    }

    /// What is felt at the places of a profile.
    fn along(&self, p: &Profile, felt: Felt) -> Vec<f64> {
        let k = self.press(p);
        p.distance_mm.iter().map(|&d| self.felt(k, p.force_n, felt, d)).collect()
    }

    /// Where a profile peaks; `None` where the last place has the largest measured rate.
    fn peak(&self, p: &Profile, felt: Felt) -> Option<Peak> {
        let most = |v: &[f64]| (0..v.len()).max_by(|&a, &b| v[a].total_cmp(&v[b]));
        let people = most(&p.rate_per_s).filter(|k| k + 1 < p.rate_per_s.len())?;
        let k = self.press(p);
        let places: Vec<f64> = (0..PLACES).map(|i| SPACING_MM * i as f64).collect();
        let at = |&d: &f64| self.felt(k, p.force_n, felt, d);
        let here = most(&places.iter().map(at).collect::<Vec<_>>())?;
        Some(Peak {
            curvature_per_m: p.curvature_per_m,
            people_mm: p.distance_mm[people],
            here_mm: places[here],
        })
    }

    fn press(&self, p: &Profile) -> usize {
        let same = |c: &f64| c.total_cmp(&p.curvature_per_m).is_eq();
        self.sa1.curvature_per_m.iter().position(same).unwrap_or(0)
    }

    /// What is felt under a sphere at a force and a distance from its middle, between states and
    /// places along lines.
    fn felt(&self, k: usize, force_n: f64, felt: Felt, away_mm: f64) -> f64 {
        let press = &self.presses[k];
        let read = |s: &State| {
            let line = &s.felt[felt.depth][felt.stimulus as usize];
            pooled(line, felt.pooled_mm, away_mm)
        };
        let values: Vec<f64> = press.states.iter().map(read).collect();
        press.path.value_at(force_n, &values, BEYOND).unwrap_or(f64::NAN)
    }

    fn predictions(&self, fit: &Fit) -> Vec<Predicted> {
        let law = fit.law.unwrap_or(SILENT);
        let Fit { pooled_mm, stimulus, depth, .. } = *fit;
        let felt = Felt { pooled_mm, stimulus, depth };
        let spheres = self.sa1.force_n.iter().zip(&self.sa1.rate_per_s).map(|(&force_n, row)| {
            let here = |k| law.rate_per_s(self.felt(k, force_n, felt, 0.0));
            Predicted {
                force_n,
                curvature_per_m: self.sa1.curvature_per_m.clone(),
                distance_mm: vec![0.0; row.len()],
                measured_per_s: row.clone(),
                here_per_s: (0..row.len()).map(here).collect(),
            }
        });
        let profiles = self.sa1.profiles.iter().map(|p| Predicted {
            force_n: p.force_n,
            curvature_per_m: vec![p.curvature_per_m; p.distance_mm.len()],
            distance_mm: p.distance_mm.clone(),
            measured_per_s: p.rate_per_s.clone(),
            here_per_s: self.along(p, felt).into_iter().map(|q| law.rate_per_s(q)).collect(),
        });
        spheres.chain(profiles).collect()
    }
}

/// Mean of a field of revolution over a disc whose middle lies `away_mm` from its axis; `line` holds
/// it every [`SPACING_MM`] and goes on as it ends. A disc of no size is a point.
fn pooled(line: &[f64], radius_mm: f64, away_mm: f64) -> f64 {
    let at = |distance_mm: f64| {
        let at = (distance_mm / SPACING_MM).min((line.len() - 1) as f64);
        let before = (at.floor() as usize).min(line.len() - 2);
        line[before] + (at - before as f64) * (line[before + 1] - line[before])
    };
    if radius_mm == 0.0 {
        return at(away_mm);
    }
    // Rings of the same area, each at as many angles.
    const PARTS: usize = 16;
    let part = |k: usize| (k as f64 + 0.5) / PARTS as f64;
    let mut sum = 0.0;
    for ring in 0..PARTS {
        let r = radius_mm * part(ring).sqrt();
        for turn in 0..PARTS {
            let (sin, cos) = (std::f64::consts::TAU * part(turn)).sin_cos();
            sum += at((away_mm + r * cos).hypot(r * sin));
        }
    }
    sum / (PARTS * PARTS) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disc_takes_the_mean() {
        // r^2 over a disc of radius 1 at distance d: d^2 + 1/2.
        let line: Vec<f64> = (0..PLACES).map(|i| (SPACING_MM * i as f64).powi(2)).collect();
        for away in [0.0, 0.8, 2.0] {
            let exact = away * away + 0.5;
            // Lines between places add a twelfth of the spacing's square, doubled.
            assert!((pooled(&line, 1.0, away) - exact).abs() < 0.01, "{away}");
        }
        assert_eq!(pooled(&line, 0.0, 0.4), line[2]);
        assert_eq!(pooled(&line, 0.0, 99.0), line[PLACES - 1]);
    }
}
