//! Where the search for the next equilibrium starts.

use super::fluid;
use super::state::State;
use super::stepping::Solver;

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
            for (c, old) in trial.independent.iter_mut().zip(&before.independent) {
                for r in 0..c.len() {
                    c[r] += ratio * (c[r] - old[r]);
                }
            }
            for (l, m) in trial.multipliers.iter_mut().zip(&before.multipliers) {
                *l = (*l + ratio * (*l - m)).max(0.0);
            }
        }
        self.prescribe(next, &mut trial.u);
        fluid::begin(&mut trial.fluid, self.last_step(next));
        trial
    }

    /// The last equilibrium as it meets what is prescribed at `next`.
    pub(super) fn unmoved(&self, next: f64) -> State {
        let mut trial = self.state.clone();
        self.prescribe(next, &mut trial.u);
        fluid::begin(&mut trial.fluid, self.last_step(next));
        trial
    }

    /// Displacement before the last step, and the length of the next over its; none since the load
    /// has turned.
    fn last_step(&self, next: f64) -> Option<(&[[f64; 3]], f64)> {
        let before = self.before.as_ref()?;
        let ratio = (next - self.state.fraction) / (self.state.fraction - before.fraction);
        Some((&before.u, ratio))
    }

    pub(super) fn prescribe(&self, fraction: f64, u: &mut [[f64; 3]]) {
        let share = self.loading.share(fraction);
        for &(dof, value) in &self.loading.prescribed_mm {
            u[dof / 3][dof % 3] = share * value;
        }
        self.newton.problem.mesh.follow(u);
    }
}
