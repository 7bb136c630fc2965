//! Equilibria: what makes one, where the search for the next starts, and how one is told of.

use super::effort::Effort;
use super::stepping::Solver;
use super::work::Work;
use crate::contact::FrictionTrial;
use crate::element::Dilatation;

/// An equilibrium, or the start of the search for one.
#[derive(Clone, Debug, Default)]
pub(super) struct State {
    pub fraction: f64,
    pub u: Vec<[f64; 3]>,
    /// Dilatation of each element that is carried along; empty if none is.
    pub carried: Vec<Dilatation>,
    pub multipliers: Vec<f64>,
    /// History of materials with memory; empty if there are none.
    pub memory: Vec<f64>,
    /// Tangential contact; no points without friction.
    pub friction: FrictionTrial,
}

/// A place to go back to, see [`Solver::mark`].
#[derive(Clone)]
pub struct Mark {
    pub(super) state: State,
    pub(super) before: Option<State>,
    pub(super) work: Work,
}

/// One equilibrium.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct StepReport {
    /// Load fraction.
    pub load_fraction: f64,
    /// Out-of-balance force over the reference norm.
    pub residual_relative: f64,
    /// Largest |gap| of a point in contact, mm.
    pub gap_error_mm: f64,
    /// Energy that can be got back, mJ.
    pub stored_mj: f64,
    /// Energy that materials with memory and friction have turned into heat, mJ.
    pub dissipated_mj: f64,
    /// Smallest `J`.
    pub j_min: f64,
    /// Block of the mesh and element in it where it is.
    pub j_min_at: [usize; 2],
    /// The tangent's condition number is at least this, by the diagonal of its last
    /// Cholesky factor; not a number if there has been none.
    pub condition_at_least: f64,
    /// Work since the last report.
    pub effort: Effort,
}

impl Solver<'_> {
    /// Extrapolates the last two equilibria.
    pub(super) fn predict(&self, next: f64) -> State {
        let mut trial = self.state.clone();
        if let Some(before) = &self.before {
            let ratio = (next - self.state.fraction) / (self.state.fraction - before.fraction);
            for (v, w) in trial.u.iter_mut().zip(&before.u) {
                for i in 0..3 {
                    v[i] += ratio * (v[i] - w[i]);
                }
            }
            for (c, old) in trial.carried.iter_mut().zip(&before.carried) {
                for r in 0..c.len() {
                    c[r] += ratio * (c[r] - old[r]);
                }
            }
            for (l, m) in trial.multipliers.iter_mut().zip(&before.multipliers) {
                *l = (*l + ratio * (*l - m)).max(0.0);
            }
        }
        self.prescribe(next, &mut trial.u);
        trial
    }

    /// The last equilibrium as it meets what is prescribed at `next`.
    pub(super) fn unmoved(&self, next: f64) -> State {
        let mut trial = self.state.clone();
        self.prescribe(next, &mut trial.u);
        trial
    }

    fn prescribe(&self, fraction: f64, u: &mut [[f64; 3]]) {
        for &(dof, value) in &self.loading.prescribed_mm {
            u[dof / 3][dof % 3] = fraction * value;
        }
    }
}
