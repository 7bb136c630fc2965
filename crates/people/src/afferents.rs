//! SA1 rates under spheres: what a receptor feels, fitted at the smallest force, tried at the others.

use crate::PeopleError;
use crate::measured::{Profile, Sa1};
use crate::press::{Materials, Press};
use crate::rates::{Law, r_squared};
use crate::receptors::{DEPTHS_MM, PLACES, SPACING_MM, Stimulus};
use crate::solution::{Solution, held_at};
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
    /// Gain and threshold from the first force's row; absent where no rate rises with it.
    pub law: Option<Law>,
    /// R2 of that row.
    pub r2_fitted: f64,
    /// R2 of the rows of the other forces.
    pub r2_others: f64,
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
        materials: Materials,
        density: Density,
        folder: &Path,
        told: &mut dyn FnMut(&str),
    ) -> Result<Self, PeopleError> {
        let mut presses = Vec::with_capacity(sa1.curvature_per_m.len());
        for &curvature in &sa1.curvature_per_m {
            let press = Press::sphere(curvature, materials);
            told(&press.name);
            presses.push(held_at(&press, &sa1.force_n, density, folder)?);
        }
        let heard = Heard { sa1, presses: &presses };
        let every = |s| (0..DEPTHS_MM.len()).map(move |d| (s, d));
        let fits: Vec<Fit> =
            Stimulus::ALL.into_iter().flat_map(every).map(|(s, d)| heard.fit(s, d)).collect();
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

impl Heard<'_> {
    fn fit(&self, stimulus: Stimulus, depth: usize) -> Fit {
        let felt = |force_n: f64| -> Vec<f64> {
            (0..self.presses.len()).map(|k| self.felt(k, force_n, stimulus, depth, 0.0)).collect()
        };
        let (forces, rates) = (&self.sa1.force_n, &self.sa1.rate_per_s);
        let first = felt(forces[0]);
        let law = Law::fitted(&first, &rates[0]);
        let none = Law { gain: 0.0, threshold: 0.0 };
        let heard = |felt: Vec<f64>| -> Vec<f64> {
            felt.into_iter().map(|q| law.unwrap_or(none).rate_per_s(q)).collect()
        };
        let others: Vec<f64> = forces[1..].iter().flat_map(|&f| heard(felt(f))).collect();
        let mut profiles = (Vec::new(), Vec::new());
        let mut peaks = Vec::new();
        for p in &self.sa1.profiles {
            let along = self.along(p, stimulus, depth);
            profiles.0.extend(&p.rate_per_s);
            profiles.1.extend(heard(along));
            peaks.extend(self.peak(p, stimulus, depth));
        }
        Fit {
            stimulus,
            depth,
            law,
            r2_fitted: r_squared(&rates[0], &heard(first)),
            r2_others: r_squared(&rates[1..].concat(), &others),
            r2_profiles: r_squared(&profiles.0, &profiles.1),
            peaks,
        }
    }

    /// What is felt at the places of a profile.
    fn along(&self, p: &Profile, stimulus: Stimulus, depth: usize) -> Vec<f64> {
        let k = self.press(p);
        p.distance_mm.iter().map(|&d| self.felt(k, p.force_n, stimulus, depth, d)).collect()
    }

    /// Where a profile peaks; `None` where the last place has the largest measured rate.
    fn peak(&self, p: &Profile, stimulus: Stimulus, depth: usize) -> Option<Peak> {
        let most = |v: &[f64]| (0..v.len()).max_by(|&a, &b| v[a].total_cmp(&v[b]));
        let people = most(&p.rate_per_s).filter(|k| k + 1 < p.rate_per_s.len())?;
        let k = self.press(p);
        let places: Vec<f64> = (0..PLACES).map(|i| SPACING_MM * i as f64).collect();
        let felt = |&d: &f64| self.felt(k, p.force_n, stimulus, depth, d);
        let here = most(&places.iter().map(felt).collect::<Vec<_>>())?;
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
    fn felt(&self, k: usize, force_n: f64, stimulus: Stimulus, depth: usize, away_mm: f64) -> f64 {
        let at = (away_mm / SPACING_MM).min((PLACES - 1) as f64);
        let before = (at.floor() as usize).min(PLACES - 2);
        let part = at - before as f64;
        let press = &self.presses[k];
        let read = |s: &crate::solution::State| {
            let line = &s.felt[depth][stimulus as usize];
            line[before] + part * (line[before + 1] - line[before])
        };
        let values: Vec<f64> = press.states.iter().map(read).collect();
        press.path.value_at(force_n, &values, BEYOND).unwrap_or(f64::NAN)
    }

    fn predictions(&self, fit: &Fit) -> Vec<Predicted> {
        let law = fit.law.unwrap_or(Law { gain: 0.0, threshold: 0.0 });
        let spheres = self.sa1.force_n.iter().zip(&self.sa1.rate_per_s).map(|(&force_n, row)| {
            let felt = |k| self.felt(k, force_n, fit.stimulus, fit.depth, 0.0);
            Predicted {
                force_n,
                curvature_per_m: self.sa1.curvature_per_m.clone(),
                distance_mm: vec![0.0; row.len()],
                measured_per_s: row.clone(),
                here_per_s: (0..row.len()).map(|k| law.rate_per_s(felt(k))).collect(),
            }
        });
        let profiles = self.sa1.profiles.iter().map(|p| Predicted {
            force_n: p.force_n,
            curvature_per_m: vec![p.curvature_per_m; p.distance_mm.len()],
            distance_mm: p.distance_mm.clone(),
            measured_per_s: p.rate_per_s.clone(),
            here_per_s: self
                .along(p, fit.stimulus, fit.depth)
                .into_iter()
                .map(|q| law.rate_per_s(q))
                .collect(),
        });
        spheres.chain(profiles).collect()
    }
}
