//! How far a time step goes in viscoelastic and biphasic bodies.

use super::stepping::Solver;

/// Load fraction of the first time step of fluid that flows.
const FLOW_FIRST: f64 = 0.01;
/// Least load fraction of a time step: what relaxes within it has relaxed at its end, and
/// its history is exact for what changes linearly.
const TIME_STEP_MIN: f64 = 1e-9;

impl Solver<'_> {
    /// Half the shortest relaxation time, as a load fraction; of fluid a hundredth.
    pub(super) fn first_time_step(&self) -> Option<f64> {
        let problem = self.newton.problem;
        let flows = problem.fluid.is_some() && self.newton.options.time_error.is_finite();
        let relaxes = problem.history_layout.as_ref().map(|_| {
            let shortest = problem.materials.models().filter_map(|m| m.shortest_time_s());
            0.5 * shortest.fold(f64::INFINITY, f64::min) / self.loading.duration_s
        });
        let flow = flows.then_some(FLOW_FIRST);
        relaxes.into_iter().chain(flow).reduce(f64::min)
    }

    /// `step`, no longer than time integration allows.
    pub(super) fn within_time_step(&self, step: f64) -> f64 {
        self.time_step.map_or(step, |p| step.min(p.max(TIME_STEP_MIN)))
    }

    /// Sets the next time step by how far linear extrapolation missed this one:
    /// the recursion of a Prony series is exact for what changes linearly.
    pub(super) fn set_time_step(&mut self, next: f64, u: &[[f64; 3]]) {
        let (Some(time_step), Some(before)) = (&mut self.time_step, &self.before) else { return };
        let step = next - self.state.fraction;
        let ratio = step / (self.state.fraction - before.fraction);
        let (mut miss, mut size) = (0.0f64, 0.0f64);
        for ((new, last), old) in u.iter().zip(&self.state.u).zip(&before.u) {
            for i in 0..3 {
                let predicted = last[i] + ratio * (last[i] - old[i]);
                miss = miss.max((new[i] - predicted).abs());
                size = size.max(new[i].abs());
            }
        }
        let wanted = (self.newton.options.time_error * size / miss.max(f64::MIN_POSITIVE)).sqrt();
        *time_step = step * wanted.clamp(0.3, 2.0);
    }

    /// Time from the last equilibrium to `next`, s.
    pub(super) fn seconds(&self, next: f64) -> f64 {
        (next - self.state.fraction) * self.loading.duration_s
    }
}
