//! Angle-based flattening: the plane angles closest to those of the surface.
//!
//! Unknowns are the three corner angles `a` of each triangle. Minimised is
//! `1/2 sum ((a - b) / b)^2`, where `b` is the angle on the surface, scaled at each
//! interior vertex so that the angles around it add up to a full turn. Constraints:
//! - triangle: its angles add up to pi;
//! - planarity: the angles around each interior vertex add up to 2 pi;
//! - wheel: walking around an interior vertex ends at the length one started with,
//!   `sum log sin (angle after) - sum log sin (angle before) = 0`.
//!
//! Sheffer & de Sturler write the wheel as a difference of products of sines. The
//! logarithm has the same solutions and a diagonal second derivative, so Newton's
//! matrix stays diagonal in the angles and the reduction of ABF++ (angles first, then
//! triangles, leaving two unknowns per interior vertex) is exact.

use super::FlattenError;
use super::disc::Disc;
use super::sparse::{Cholesky, Entry};
use papilla_vector::dot;
use serde::Serialize;
use std::f64::consts::{PI, TAU};

/// Newton steps allowed.
const ITERATIONS_MAX: usize = 60;
/// Largest residual of a converged solution, rad.
const RESIDUAL_RAD_MAX: f64 = 1e-11;
/// Part of the way to a zero angle that one step may go.
const STEP_TO_BOUND_MAX: f64 = 0.7;
/// Share of the plain least-squares curvature kept where the exact one is less.
const CURVATURE_SHARE_MIN: f64 = 0.2;
/// Halvings of a step that does not reduce the residual.
const HALVINGS_MAX: usize = 6;

/// How Newton's method got to the flat angles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Convergence {
    /// Newton steps.
    pub iterations: usize,
    /// Largest residual at the end over all constraints and the optimality condition, rad.
    pub residual_rad: f64,
}

/// Corner angles that fit together in the plane.
pub(super) struct FlatAngles {
    pub(super) angles: Vec<[f64; 3]>,
    pub(super) convergence: Convergence,
}

/// Finds the flat angles closest to `surface_angles`.
pub(super) fn flat_angles(
    disc: &Disc,
    surface_angles: &[[f64; 3]],
) -> Result<FlatAngles, FlattenError> {
    flat_angles_within(disc, surface_angles, ITERATIONS_MAX)
}

/// As [`flat_angles`] with a bound on the Newton steps.
pub(super) fn flat_angles_within(
    disc: &Disc,
    surface_angles: &[[f64; 3]],
    iterations_max: usize,
) -> Result<FlatAngles, FlattenError> {
    let problem = Problem { disc, targets: targets(disc, surface_angles) };
    let mut cholesky = Cholesky::new("angle-based flattening", 2 * disc.interior_count);
    let mut state = State {
        angles: surface_angles.to_vec(),
        triangle: vec![0.0; disc.triangles.len()],
        vertex: vec![0.0; 2 * disc.interior_count],
    };
    let mut residual = problem.residual(&state);
    let mut iterations = 0;
    loop {
        let residual_rad = residual.largest_rad(&problem.targets);
        if residual_rad <= RESIDUAL_RAD_MAX {
            let convergence = Convergence { iterations, residual_rad };
            return Ok(FlatAngles { angles: state.angles, convergence });
        }
        if iterations == iterations_max || !residual_rad.is_finite() {
            return Err(FlattenError::NotConverged { iterations, residual_rad });
        }
        let step = problem.newton_step(&state, &residual, &mut cholesky)?;
        (state, residual) = problem.search(&state, &step, &residual);
        iterations += 1;
    }
}

/// Optimal angles: the surface's, scaled to a full turn around interior vertices.
fn targets(disc: &Disc, surface_angles: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut sum = vec![0.0; disc.vertex_count];
    for (corners, angles) in disc.triangles.iter().zip(surface_angles) {
        for k in 0..3 {
            sum[corners[k]] += angles[k];
        }
    }
    let scale = |vertex: usize| disc.interior[vertex].map_or(1.0, |_| TAU / sum[vertex]);
    let scaled = |(corners, angles): (&[usize; 3], &[f64; 3])| {
        std::array::from_fn(|k| angles[k] * scale(corners[k]))
    };
    disc.triangles.iter().zip(surface_angles).map(scaled).collect()
}

/// Angles and multipliers; also a step in them.
#[derive(Clone)]
struct State {
    angles: Vec<[f64; 3]>,
    /// Multiplier of each triangle constraint.
    triangle: Vec<f64>,
    /// Multipliers of the planarity (even) and wheel (odd) constraint of each interior vertex.
    vertex: Vec<f64>,
}

impl State {
    fn moved(&self, step: &Self, share: f64) -> Self {
        let add = |a: &f64, b: &f64| a + share * b;
        let add3 = |(a, b): (&[f64; 3], &[f64; 3])| std::array::from_fn(|k| add(&a[k], &b[k]));
        let sum =
            |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| add(a, b)).collect::<Vec<_>>();
        Self {
            angles: self.angles.iter().zip(&step.angles).map(add3).collect(),
            triangle: sum(&self.triangle, &step.triangle),
            vertex: sum(&self.vertex, &step.vertex),
        }
    }

    /// Largest share of `step`, up to 1, that keeps all angles well between 0 and pi.
    fn share_max(&self, step: &Self) -> f64 {
        let mut share: f64 = 1.0;
        let pairs = self.angles.as_flattened().iter().zip(step.angles.as_flattened());
        for (&angle, &change) in pairs {
            let room = if change < 0.0 { angle } else { PI - angle };
            share = share.min(STEP_TO_BOUND_MAX * room / change.abs().max(f64::MIN_POSITIVE));
        }
        share
    }
}

/// First-order optimality: gradient in the angles, and the constraints.
struct Residual {
    gradient: Vec<[f64; 3]>,
    triangle: Vec<f64>,
    vertex: Vec<f64>,
}

impl Residual {
    /// Largest entry, with the gradient in radians (times the squared target angle).
    fn largest_rad(&self, targets: &[[f64; 3]]) -> f64 {
        let gradient = self.gradient.as_flattened().iter().zip(targets.as_flattened());
        let gradient = gradient.map(|(g, target)| g * target * target);
        let constraints = self.triangle.iter().chain(&self.vertex).copied();
        // Not `f64::max`, which would drop a NaN.
        gradient.chain(constraints).map(f64::abs).fold(0.0, |a, b| if b <= a { a } else { b })
    }

    fn squared(&self, targets: &[[f64; 3]]) -> f64 {
        let gradient = self.gradient.as_flattened().iter().zip(targets.as_flattened());
        let gradient = gradient.map(|(g, target)| g * target * target);
        gradient.chain(self.triangle.iter().chain(&self.vertex).copied()).map(|r| r * r).sum()
    }
}

struct Problem<'a> {
    disc: &'a Disc,
    targets: Vec<[f64; 3]>,
}

/// One triangle's part of the planarity and wheel constraints.
struct Local {
    /// Row of each of the six (planarity, wheel) x (corner) parts, `None` on the boundary.
    rows: [Option<usize>; 6],
    /// Derivative of each part in the triangle's angles.
    jacobian: [[f64; 3]; 6],
    /// Value of each part.
    value: [f64; 6],
}

impl Problem<'_> {
    fn local(&self, triangle: usize, angles: [f64; 3]) -> Local {
        let mut local = Local { rows: [None; 6], jacobian: [[0.0; 3]; 6], value: [0.0; 6] };
        for (k, &vertex) in self.disc.triangles[triangle].iter().enumerate() {
            let Some(number) = self.disc.interior[vertex] else { continue };
            let (after, before) = ((k + 1) % 3, (k + 2) % 3);
            local.rows[2 * k] = Some(2 * number);
            local.rows[2 * k + 1] = Some(2 * number + 1);
            local.jacobian[2 * k][k] = 1.0;
            local.jacobian[2 * k + 1][after] = 1.0 / angles[after].tan();
            local.jacobian[2 * k + 1][before] = -1.0 / angles[before].tan();
            local.value[2 * k] = angles[k];
            local.value[2 * k + 1] = (angles[after].sin() / angles[before].sin()).ln();
        }
        local
    }

    fn residual(&self, state: &State) -> Residual {
        let mut vertex = vec![0.0; state.vertex.len()];
        vertex.iter_mut().step_by(2).for_each(|planarity| *planarity = -TAU);
        let mut gradient = Vec::with_capacity(state.angles.len());
        for (triangle, (&angles, targets)) in state.angles.iter().zip(&self.targets).enumerate() {
            let local = self.local(triangle, angles);
            let mut g: [f64; 3] = std::array::from_fn(|k| {
                (angles[k] - targets[k]) / (targets[k] * targets[k]) + state.triangle[triangle]
            });
            for i in 0..6 {
                let Some(row) = local.rows[i] else { continue };
                vertex[row] += local.value[i];
                for k in 0..3 {
                    g[k] += state.vertex[row] * local.jacobian[i][k];
                }
            }
            gradient.push(g);
        }
        let triangle = state.angles.iter().map(|a| a[0] + a[1] + a[2] - PI).collect();
        Residual { gradient, triangle, vertex }
    }

    /// Inverse of the second derivative of the Lagrangian in one triangle's angles.
    fn inverse_curvature(&self, triangle: usize, state: &State) -> [f64; 3] {
        let corners = self.disc.triangles[triangle];
        let wheel = |k: usize| {
            self.disc.interior[corners[k % 3]].map_or(0.0, |number| state.vertex[2 * number + 1])
        };
        std::array::from_fn(|k| {
            let sine = state.angles[triangle][k].sin();
            let plain = self.targets[triangle][k].powi(-2);
            let exact = plain + (wheel(k + 1) - wheel(k + 2)) / (sine * sine);
            1.0 / exact.max(CURVATURE_SHARE_MIN * plain)
        })
    }

    /// Solves Newton's equations by eliminating first the angles, then the triangle
    /// multipliers: both are local to a triangle.
    fn newton_step(
        &self,
        state: &State,
        residual: &Residual,
        cholesky: &mut Cholesky,
    ) -> Result<State, FlattenError> {
        let mut lower = Vec::with_capacity(21 * state.angles.len());
        let mut vertex = residual.vertex.clone();
        let mut reduced = Vec::with_capacity(state.angles.len());
        for triangle in 0..state.angles.len() {
            let local = self.local(triangle, state.angles[triangle]);
            let inverse = self.inverse_curvature(triangle, state);
            let part =
                Reduced::new(inverse, residual.gradient[triangle], residual.triangle[triangle]);
            for i in 0..6 {
                let Some(row) = local.rows[i] else { continue };
                let image = part.project(local.jacobian[i]);
                vertex[row] += dot(local.jacobian[i], part.free);
                for j in 0..6 {
                    let Some(column) = local.rows[j].filter(|&column| column <= row) else {
                        continue;
                    };
                    lower.push(Entry::new(row, column, dot(image, local.jacobian[j])));
                }
            }
            reduced.push((local, part));
        }
        if !vertex.is_empty() {
            cholesky.factor(&lower)?.solve_in_place(&mut vertex);
        }
        let mut step =
            State { angles: Vec::with_capacity(reduced.len()), triangle: Vec::new(), vertex };
        for (local, part) in &reduced {
            let mut pull = [0.0; 3];
            for i in 0..6 {
                let Some(row) = local.rows[i] else { continue };
                for k in 0..3 {
                    pull[k] += step.vertex[row] * local.jacobian[i][k];
                }
            }
            let bent = part.project(pull);
            step.angles.push(std::array::from_fn(|k| part.free[k] - bent[k]));
            step.triangle.push(part.multiplier - dot(part.inverse, pull) / part.inverse_sum);
        }
        Ok(step)
    }

    /// Goes along `step` as far as the angles allow and the residual shrinks.
    fn search(&self, state: &State, step: &State, residual: &Residual) -> (State, Residual) {
        let before = residual.squared(&self.targets);
        let mut share = state.share_max(step);
        let mut halvings = 0;
        loop {
            let moved = state.moved(step, share);
            let after = self.residual(&moved);
            if after.squared(&self.targets) < before || halvings == HALVINGS_MAX {
                return (moved, after);
            }
            share *= 0.5;
            halvings += 1;
        }
    }
}

/// One triangle's angles and triangle multiplier, eliminated.
struct Reduced {
    inverse: [f64; 3],
    inverse_sum: f64,
    /// Step of the angles if the vertex multipliers stay.
    free: [f64; 3],
    /// Step of the triangle multiplier if the vertex multipliers stay.
    multiplier: f64,
}

impl Reduced {
    fn new(inverse: [f64; 3], gradient: [f64; 3], excess: f64) -> Self {
        let inverse_sum = inverse.iter().sum::<f64>();
        let multiplier = (excess - dot(inverse, gradient)) / inverse_sum;
        let free = std::array::from_fn(|k| -inverse[k] * (gradient[k] + multiplier));
        Self { inverse, inverse_sum, free, multiplier }
    }

    /// Applies the inverse curvature within angles of constant sum.
    fn project(&self, v: [f64; 3]) -> [f64; 3] {
        let mean = dot(self.inverse, v) / self.inverse_sum;
        std::array::from_fn(|k| self.inverse[k] * (v[k] - mean))
    }
}
