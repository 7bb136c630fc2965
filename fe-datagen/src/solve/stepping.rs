//! Load stepping: equilibria at increasing load fractions, cutting steps that fail.

use super::evaluate::Balance;
use super::newton::{Effort, Newton};
use super::problem::{Loading, Problem};
use super::{Options, SolveError, StepError};
use crate::linear::Equations;

/// Solves one loading of a [`Problem`]; re-usable for the next.
pub struct Solver<'a> {
    newton: Newton<'a>,
    loading: Loading,
    state: State,
    /// Equilibrium before the last, for extrapolation.
    before: Option<State>,
    /// Contact force (N) along the travel at every equilibrium: `(fraction, force)`.
    history: Vec<(f64, f64)>,
}

#[derive(Clone, Debug, Default)]
struct State {
    fraction: f64,
    u: Vec<[f64; 3]>,
    multipliers: Vec<f64>,
}

/// One equilibrium.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct StepReport {
    /// Load fraction.
    pub load_fraction: f64,
    /// Out-of-balance force over the reference norm.
    pub residual_relative: f64,
    /// Largest |gap| of a node in contact, mm.
    pub gap_error_mm: f64,
    /// Elastic energy, mJ.
    pub stored_mj: f64,
    /// Smallest `J`.
    pub j_min: f64,
    /// Work since the last report.
    pub effort: Effort,
}

impl<'a> Solver<'a> {
    /// Memory for solving `problem`.
    ///
    /// # Errors
    /// [`SolveError::Factor`] if the factor does not fit in memory.
    pub fn new(problem: &'a Problem, options: Options) -> Result<Self, SolveError> {
        let mut solver = Self {
            newton: Newton::new(problem, options)?,
            loading: Loading::default(),
            state: State::default(),
            before: None,
            history: Vec::new(),
        };
        solver.start(Loading::default());
        Ok(solver)
    }

    /// Puts the body at rest and takes a new loading.
    pub fn start(&mut self, loading: Loading) {
        let problem = self.newton.problem;
        let contact_nodes = problem.contact.as_ref().map_or(0, |c| c.nodes.len());
        self.loading = loading;
        self.state = State {
            fraction: 0.0,
            u: vec![[0.0; 3]; problem.mesh.nodes.len()],
            multipliers: vec![0.0; contact_nodes],
        };
        self.before = None;
        self.history = vec![(0.0, 0.0)];
        self.newton.forget();
    }

    /// Displacement, mm, one a mesh node.
    #[must_use]
    pub fn displacement_mm(&self) -> &[[f64; 3]] {
        &self.state.u
    }

    /// The problem being solved.
    #[must_use]
    pub fn problem(&self) -> &'a Problem {
        self.newton.problem
    }

    /// Nominal traction of each contact node, MPa per undeformed area.
    #[must_use]
    pub fn traction_mpa(&self) -> &[f64] {
        &self.newton.current.traction_mpa
    }

    /// Goes on to `target` (in `[0, 1]`, above the fraction reached) through as
    /// many equilibria as it takes.
    ///
    /// # Errors
    /// [`SolveError::CutsExhausted`]; the state is then the last equilibrium.
    pub fn advance_to(&mut self, target: f64) -> Result<StepReport, SolveError> {
        let first = self.newton.effort;
        let mut step = target - self.state.fraction;
        let mut cuts = 0;
        while self.state.fraction < target {
            let next = if self.state.fraction + 1.000_001 * step >= target {
                target
            } else {
                self.state.fraction + step
            };
            match self.try_step(next) {
                Ok(()) => step *= 1.5,
                Err(cause) => {
                    cuts += 1;
                    self.newton.effort.cuts += 1;
                    tracing::debug!(reached = self.state.fraction, next, %cause, "load step cut");
                    if cuts > self.newton.options.cuts_max {
                        return Err(SolveError::CutsExhausted {
                            reached: self.state.fraction,
                            cuts: cuts - 1,
                            cause,
                        });
                    }
                    step = 0.5 * (next - self.state.fraction);
                }
            }
        }
        let e = &self.newton.current;
        Ok(StepReport {
            load_fraction: self.state.fraction,
            residual_relative: e.residual_norm / e.reference_norm.max(f64::MIN_POSITIVE),
            gap_error_mm: e.gap_error_mm,
            stored_mj: e.stored_mj,
            j_min: e.j_min,
            effort: self.newton.effort.since(&first),
        })
    }

    /// One equilibrium at `next`, or the state as it was.
    fn try_step(&mut self, next: f64) -> Result<(), StepError> {
        let mut trial = self.predict(next);
        match self.augmented(next, &mut trial) {
            Ok(()) => {}
            // The extrapolation may be what failed: once more from the last equilibrium.
            Err(_) if self.before.is_some() => {
                trial = self.state.clone();
                self.prescribe(next, &mut trial.u);
                self.augmented(next, &mut trial)?;
            }
            Err(e) => return Err(e),
        }
        trial.fraction = next;
        self.before = Some(std::mem::replace(&mut self.state, trial));
        let force = self.newton.current.contact_force_n;
        let along = self.loading.indenter.as_ref().map_or(0.0, |m| {
            let length = crate::mesh::surface::norm(m.travel_mm);
            (0..3).map(|i| force[i] * m.travel_mm[i] / length).sum()
        });
        self.history.push((next, along));
        Ok(())
    }

    /// Extrapolates the last two equilibria.
    fn predict(&self, next: f64) -> State {
        let mut trial = self.state.clone();
        if let Some(before) = &self.before {
            let ratio = (next - self.state.fraction) / (self.state.fraction - before.fraction);
            for (v, w) in trial.u.iter_mut().zip(&before.u) {
                for i in 0..3 {
                    v[i] += ratio * (v[i] - w[i]);
                }
            }
            for (l, m) in trial.multipliers.iter_mut().zip(&before.multipliers) {
                *l = (*l + ratio * (*l - m)).max(0.0);
            }
        }
        self.prescribe(next, &mut trial.u);
        trial
    }

    fn prescribe(&self, fraction: f64, u: &mut [[f64; 3]]) {
        for &(dof, value) in &self.loading.prescribed_mm {
            u[dof / 3][dof % 3] = fraction * value;
        }
    }

    /// Equilibrium with contact multipliers updated until gaps close.
    fn augmented(&mut self, fraction: f64, trial: &mut State) -> Result<(), StepError> {
        let options = self.newton.options;
        // The first equilibrium only serves to update the multipliers.
        let mut tolerance = 1e-3f64.max(options.residual_tolerance);
        for update in 0..=options.augmentations_max {
            let (multipliers, u) = (&trial.multipliers, &mut trial.u);
            self.newton.equilibrate(tolerance, &self.loading, fraction, multipliers, u)?;
            if self.newton.current.gap_error_mm <= options.gap_tolerance_mm {
                let tight = options.residual_tolerance;
                self.newton.equilibrate(tight, &self.loading, fraction, multipliers, u)?;
            }
            let e = &self.newton.current;
            if e.gap_error_mm <= options.gap_tolerance_mm {
                return Ok(());
            }
            tolerance = options.residual_tolerance;
            if update < options.augmentations_max {
                trial.multipliers.copy_from_slice(&e.traction_mpa);
                self.newton.effort.augmentations += 1;
            }
        }
        Err(StepError::Contact {
            augmentations: options.augmentations_max,
            gap_mm: self.newton.current.gap_error_mm,
        })
    }

    /// Work of the indenter so far, mJ: the force history integrated by a power
    /// law between equilibria, which is exact for Hertz-like contact.
    #[must_use]
    pub fn indenter_work_mj(&self) -> f64 {
        let Some(m) = &self.loading.indenter else { return 0.0 };
        let travel = crate::mesh::surface::norm(m.travel_mm);
        power_law_integral(&self.history) * travel
    }

    /// Forces of indenter and supports, and the integral of true pressure.
    #[must_use]
    pub fn balance(&self) -> Balance {
        let problem = self.newton.problem;
        let e = &self.newton.current;
        let mut balance = Balance { contact_force_n: e.contact_force_n, ..Balance::default() };
        for (dof, &eq) in problem.structure.equations.of_dof.iter().enumerate() {
            if eq == Equations::FIXED {
                balance.support_force_n[dof % 3] += e.residual_n[dof];
            }
        }
        balance
    }

    /// True (Cauchy) pressure at every mesh node, MPa: the nominal traction
    /// times undeformed over deformed nodal area of the contact surface.
    #[must_use]
    pub fn pressure_mpa(&self, surface: &crate::mesh::Surface) -> Vec<f64> {
        let problem = self.newton.problem;
        let x = self.deformed();
        let mut deformed = vec![0.0; x.len()];
        surface.add_nodal_areas(&|n| x[n as usize], &mut deformed);
        let mut pressure = vec![0.0; x.len()];
        if let Some(contact) = &problem.contact {
            for ((&n, &area), &t) in
                contact.nodes.iter().zip(&contact.area_mm2).zip(&self.newton.current.traction_mpa)
            {
                pressure[n as usize] = t * area / deformed[n as usize];
            }
        }
        pressure
    }

    /// Force that a nodal pressure (MPa) exerts on the deformed surface, N: Gauss
    /// quadrature of the interpolated field, which acts along the indenter's normal.
    #[must_use]
    pub fn force_of_pressure_n(
        &self,
        surface: &crate::mesh::Surface,
        pressure: &[f64],
    ) -> [f64; 3] {
        let Some(indenter) = &self.loading.indenter else { return [0.0; 3] };
        let x = self.deformed();
        let mut traction = vec![[0.0; 3]; x.len()];
        for n in surface.nodes() {
            let n = n as usize;
            if pressure[n] > 0.0 {
                let normal = indenter.distance(self.state.fraction, x[n]).normal;
                traction[n] = normal.map(|v| v * pressure[n]);
            }
        }
        let mut total = [0.0; 3];
        let rule = surface.kind.quadrature();
        surface.integrate(&rule, &|n| x[n as usize], &mut |face, value, normal| {
            let area = crate::mesh::surface::norm(normal);
            for (&n, v) in face.iter().zip(value) {
                for i in 0..3 {
                    total[i] += v * area * traction[n as usize][i];
                }
            }
        });
        total
    }

    /// Deformed node positions, mm.
    #[must_use]
    pub fn deformed(&self) -> Vec<[f64; 3]> {
        let nodes = &self.newton.problem.mesh.nodes;
        nodes.iter().zip(&self.state.u).map(|(x, u)| std::array::from_fn(|i| x[i] + u[i])).collect()
    }
}

/// Integral of `(x, f)` points with `f = c x^m` on each interval; on the first,
/// from `x = 0`, with the exponent of the second.
fn power_law_integral(points: &[(f64, f64)]) -> f64 {
    let exponent = |a: (f64, f64), b: (f64, f64)| {
        if a.0 > 0.0 && a.1 > 0.0 && b.1 > 0.0 {
            Some((b.1 / a.1).ln() / (b.0 / a.0).ln())
        } else {
            None
        }
    };
    let mut total = 0.0;
    for (i, w) in points.windows(2).enumerate() {
        let (a, b) = (w[0], w[1]);
        let m = exponent(a, b).or_else(|| points.get(i + 2).and_then(|&c| exponent(b, c)));
        total += match m {
            Some(m) if (m + 1.0).abs() > 1e-6 && b.0 > 0.0 => (b.0 * b.1 - a.0 * a.1) / (m + 1.0),
            _ => 0.5 * (b.0 - a.0) * (a.1 + b.1),
        };
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_work_of_a_power_law_is_exact() {
        let points: Vec<_> =
            (0..6).map(|i| f64::from(i) * 0.3).map(|x| (x, 2.0 * x.powf(1.7))).collect();
        let exact = 2.0 * 1.5f64.powf(2.7) / 2.7;
        assert!((power_law_integral(&points) - exact).abs() < 1e-12 * exact);
    }
}
