//! How the skin moves to second order in the forces on it: the first term of finite strain.
//!
//! Equilibrium `K u + r(u) = f` gives `u = C f - C r''(C f, C f) / 2 + ...`. The forces are taken
//! as R load modes, which the loads at hand call for; the second derivative `r''` of the internal
//! forces is a central difference, exact to rounding and the fourth order.

use super::build::tangent_at_rest;
use super::{Compliance, InfluenceError};
use crate::simulation::body::{Body, RecordedPatch};
use papilla_fem::linear::{Direct, DofMap, dominant};
use papilla_fem::solve::Loading;
use papilla_fem::solve::evaluate::{Evaluation, Trial, evaluate_body};

/// Right-hand sides solved at a time.
const COLUMNS: usize = 48;
/// Largest displacement of a central difference, mm.
const STEP_MM: f64 = 0.01;

/// Forces at some vertices, N.
pub type Load = Vec<(u32, [f64; 3])>;

/// The quadratic operator: `z = projection f`, `c_k = sum_(l <= m) products z_l z_m`,
/// `u = displacements c`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SecondOrder {
    /// R.
    pub modes: usize,
    /// K.
    pub outputs: usize,
    /// `[V, 3, R]`, 1 per N.
    pub projection: Vec<f32>,
    /// `[R (R + 1) / 2, K]`.
    pub products: Vec<f32>,
    /// `[V, 3, K]`, mm; orthonormal.
    pub displacements: Vec<f32>,
    /// Largest share of the second-order displacement in the first-order one among the loads.
    pub share_max: f64,
}

/// Solves for the second order of `body`, a fingertip of finite strain, over `modes` load modes
/// and `outputs` displacements that `loads` call for; `progress` is told how many products of
/// modes are solved.
///
/// # Errors
/// [`InfluenceError`] for a body without an atlas, loads of which no modes can be made, or
/// systems that could not be solved.
pub fn second_order(
    body: &Body,
    compliance: &Compliance,
    loads: &[Load],
    [modes, outputs]: [usize; 2],
    progress: &mut dyn FnMut(usize),
) -> Result<SecondOrder, InfluenceError> {
    let moved: Vec<Vec<f64>> = loads.iter().map(|load| compliance.displacement(load)).collect();
    let work = gram(loads.len(), |i, k| work_mj(&loads[i], &moved[k]));
    let kept = dominant(&work, loads.len(), modes).ok_or(InfluenceError::Loads)?;
    let size = 3 * compliance.area_mm2.len();
    let mut forces = Vec::new();
    let mut projection = Vec::new();
    for (value, weights) in &kept {
        let (mut force, mut displacement) = (vec![0.0; size], vec![0.0; size]);
        for ((load, moved), weight) in loads.iter().zip(&moved).zip(weights) {
            let weight = weight / value.sqrt();
            for (vertex, f) in load {
                (0..3).for_each(|i| force[3 * *vertex as usize + i] += weight * f[i]);
            }
            displacement.iter_mut().zip(moved).for_each(|(d, m)| *d += weight * m);
        }
        forces.push(force);
        projection.push(displacement);
    }
    let pairs = Curvature::new(body, &forces)?.pairs(progress)?;
    compressed(loads, &moved, &projection, &pairs, outputs)
}

/// Inner products `[n][n]` of a symmetric `product`.
fn gram(n: usize, product: impl Fn(usize, usize) -> f64) -> Vec<f64> {
    let mut gram = vec![0.0; n * n];
    for i in 0..n {
        for k in 0..=i {
            (gram[i * n + k], gram[k * n + i]) = (product(i, k), product(i, k));
        }
    }
    gram
}

fn work_mj(load: &Load, moved: &[f64]) -> f64 {
    let of = |(vertex, f): &(u32, [f64; 3])| -> f64 {
        (0..3).map(|i| f[i] * moved[3 * *vertex as usize + i]).sum()
    };
    load.iter().map(of).sum()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The operator over the `outputs` displacements that matter most under `loads`.
fn compressed(
    loads: &[Load],
    moved: &[Vec<f64>],
    projection: &[Vec<f64>],
    pairs: &[Vec<f64>],
    outputs: usize,
) -> Result<SecondOrder, InfluenceError> {
    let (modes, size) = (projection.len(), projection.first().map_or(0, Vec::len));
    let mut share_max = 0.0f64;
    let second: Vec<Vec<f64>> = loads
        .iter()
        .zip(moved)
        .map(|(load, moved)| {
            let z: Vec<f64> = projection.iter().map(|p| work_mj(load, p)).collect();
            let mut sum = vec![0.0; size];
            let products = (0..modes).flat_map(|l| (l..modes).map(move |m| (l, m)));
            for ((l, m), pair) in products.zip(pairs) {
                let weight = z[l] * z[m];
                sum.iter_mut().zip(pair).for_each(|(s, p)| *s += weight * p);
            }
            share_max = share_max.max((dot(&sum, &sum) / dot(moved, moved)).sqrt());
            sum
        })
        .collect();
    let inner = gram(second.len(), |i, k| dot(&second[i], &second[k]));
    let kept = dominant(&inner, second.len(), outputs).ok_or(InfluenceError::Loads)?;
    let displacements: Vec<Vec<f64>> = kept
        .iter()
        .map(|(value, weights)| {
            let mut sum = vec![0.0; size];
            for (second, weight) in second.iter().zip(weights) {
                sum.iter_mut().zip(second).for_each(|(s, v)| *s += weight / value.sqrt() * v);
            }
            sum
        })
        .collect();
    let turned = |columns: &[Vec<f64>]| {
        (0..size).flat_map(|i| columns.iter().map(move |c| c[i] as f32)).collect()
    };
    let products =
        pairs.iter().flat_map(|pair| displacements.iter().map(|d| dot(pair, d) as f32)).collect();
    let (projection, columns) = (turned(projection), turned(&displacements));
    let outputs = displacements.len();
    Ok(SecondOrder { modes, outputs, projection, products, displacements: columns, share_max })
}

/// Second derivatives of a body's internal forces along load modes.
struct Curvature<'a> {
    body: &'a Body,
    skin: &'a [u32],
    direct: Direct<'a>,
    /// Displacement of each mode over the unknowns, mm.
    modes: Vec<Vec<f64>>,
    multipliers: Vec<f64>,
    out: Evaluation,
}

impl<'a> Curvature<'a> {
    fn new(body: &'a Body, forces: &[Vec<f64>]) -> Result<Self, InfluenceError> {
        let Some(RecordedPatch { patch, .. }) = &body.patch else {
            return Err(InfluenceError::NoPatch);
        };
        let system = &body.problem.system;
        let mut direct = Direct::new(system, &tangent_at_rest(&body.problem)?, COLUMNS)?;
        let mut modes = Vec::new();
        for force in forces {
            let mut mode = vec![0.0; system.dofs.count];
            for (&node, f) in patch.skin.iter().zip(force.as_chunks::<3>().0) {
                for i in 0..3 {
                    let unknown = system.dofs.of_dof[3 * node as usize + i];
                    if unknown != DofMap::FIXED {
                        mode[unknown as usize] = f[i];
                    }
                }
            }
            direct.solve(&mut mode);
            modes.push(mode);
        }
        let points = body.problem.contact.as_ref().map_or(0, |c| c.nodes().len());
        let (multipliers, out) = (vec![0.0; points], Evaluation::default());
        Ok(Self { body, skin: &patch.skin, direct, modes, multipliers, out })
    }

    /// `r''(x, x)` over the degrees of freedom, N.
    fn along(&mut self, x: &[f64]) -> Result<Vec<f64>, InfluenceError> {
        let problem = &self.body.problem;
        let step = STEP_MM / x.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()));
        let mut sum = vec![0.0; problem.system.dofs.of_dof.len()];
        for step in [step, -step] {
            let moved = |dof: usize| match problem.system.dofs.of_dof[dof] {
                DofMap::FIXED => 0.0,
                unknown => step * x[unknown as usize],
            };
            let u: Vec<[f64; 3]> = (0..problem.mesh.nodes.len())
                .map(|node| std::array::from_fn(|i| moved(3 * node + i)))
                .collect();
            let trial = Trial {
                u: &u,
                independent: &[],
                multipliers_mpa: &self.multipliers,
                penalty: 1.0,
                load_fraction: 0.0,
                variables: Default::default(),
                friction: None,
                fluid: None,
            };
            evaluate_body(problem, &Loading::default(), &trial, None, &mut self.out)?;
            let forces = sum.iter_mut().zip(&self.out.residual_n);
            forces.for_each(|(s, r)| *s += r / (step * step));
        }
        Ok(sum)
    }

    /// Second-order displacement of the skin for each pair of modes `l <= m`, mm.
    fn pairs(mut self, progress: &mut dyn FnMut(usize)) -> Result<Vec<Vec<f64>>, InfluenceError> {
        let modes = std::mem::take(&mut self.modes);
        let own = modes.iter().map(|x| self.along(x)).collect::<Result<Vec<_>, _>>()?;
        let (mut right, mut found) = (Vec::new(), Vec::new());
        for (l, first) in modes.iter().enumerate() {
            for (m, second) in modes.iter().enumerate().skip(l) {
                let forces = if l == m {
                    own[l].clone()
                } else {
                    let both: Vec<f64> = first.iter().zip(second).map(|(a, b)| a + b).collect();
                    let mut cross = self.along(&both)?;
                    for (c, (a, b)) in cross.iter_mut().zip(own[l].iter().zip(&own[m])) {
                        *c -= a + b;
                    }
                    cross
                };
                self.append(&forces, &mut right);
                if right.len() >= COLUMNS * first.len() {
                    self.solve(&mut right, &mut found);
                    progress(found.len());
                }
            }
        }
        self.solve(&mut right, &mut found);
        progress(found.len());
        Ok(found)
    }

    /// Appends a right-hand side: minus half of `forces`.
    fn append(&self, forces: &[f64], right: &mut Vec<f64>) {
        let dofs = &self.body.problem.system.dofs;
        let first = right.len();
        right.resize(first + dofs.count, 0.0);
        for (force, &unknown) in forces.iter().zip(&dofs.of_dof) {
            if unknown != DofMap::FIXED {
                right[first + unknown as usize] -= 0.5 * force;
            }
        }
    }

    fn solve(&mut self, right: &mut Vec<f64>, found: &mut Vec<Vec<f64>>) {
        let dofs = &self.body.problem.system.dofs;
        self.direct.solve(right);
        for x in right.chunks_exact(dofs.count) {
            let of = |&node: &u32| {
                [0, 1, 2].map(|i| match dofs.of_dof[3 * node as usize + i] {
                    DofMap::FIXED => 0.0,
                    unknown => x[unknown as usize],
                })
            };
            found.push(self.skin.iter().flat_map(of).collect());
        }
        right.clear();
    }
}
