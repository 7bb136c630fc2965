//! Energy, out-of-balance force and tangent of a whole body.

use super::StepError;
use super::loading::Loading;
use super::mixed::Lag;
use super::problem::Problem;
use crate::biphasic::{Flow, FluidForces};
use crate::contact::{FrictionTrial, PointContact, PointFriction, Support};
use crate::element::{Dilatation, HistoryVariables, IndependentDilatation};
use crate::linear::SymmetricMatrix;

/// What an evaluation at one displacement found.
#[derive(Clone, Debug, Default)]
pub struct Evaluation {
    /// Elastic energy, mJ, with that of a surface under tension; of a viscoelastic body the potential
    /// of the step.
    pub stored_mj: f64,
    /// Energy in the penalty that stands for contact where there are no multipliers, mJ.
    pub contact_mj: f64,
    /// Potential that equilibrium minimises, mJ.
    pub potential_mj: f64,
    /// Internal + contact - external force at every degree of freedom, N.
    pub residual_n: Vec<f64>,
    /// Volume, mm3, by which each unknown of the fluid's pressure is off; empty without fluid.
    pub surplus_mm3: Vec<f64>,
    /// Norm of both over the unknowns, N.
    pub residual_norm: f64,
    /// How far displacement and independent dilatations are from equilibrium, N; 0 without.
    pub mixed_norm: f64,
    /// Norm of contact, pressure, dead and support forces: what the residual is small against.
    pub reference_norm: f64,
    /// Nominal traction of each contact point, MPa.
    pub traction_mpa: Vec<f64>,
    /// Tangential traction of each contact point on the indenter, MPa; empty
    /// without friction.
    pub friction: Vec<[f64; 3]>,
    /// What convex edges take from the tangent at contact points, N/mm; filled with a
    /// tangent only.
    pub curvature: Vec<(usize, [[f64; 3]; 3])>,
    /// Largest |gap| over points in contact, mm.
    pub gap_error_mm: f64,
    /// Smallest `J`.
    pub j_min: f64,
    /// Block and element where it is.
    pub j_min_at: [usize; 2],
    /// Sum of contact forces and of pressure on the body, N.
    pub contact_force_n: [f64; 3],
    /// What of it is normal, N.
    pub normal_force_n: [f64; 3],
}

/// State that an evaluation reads.
pub struct Trial<'a> {
    /// Displacement, mm, one a mesh node.
    pub u: &'a [[f64; 3]],
    /// Dilatation of each element, block by block; empty if none is kept as an unknown of its own.
    pub independent: &'a [Dilatation],
    /// Contact multipliers, MPa, one a contact point.
    pub multipliers_mpa: &'a [f64],
    /// Contact penalty, MPa/mm.
    pub penalty: f64,
    /// Part of the loading that acts, 0 to 1.
    pub load_fraction: f64,
    /// History of viscoelastic materials at the start of the step, and its length, s.
    pub variables: HistoryVariables<'a>,
    /// Tangential contact; `None` without friction.
    pub friction: Option<&'a FrictionTrial>,
    /// The fluid's pressure; `None` without fluid.
    pub fluid: Option<Flow<'a>>,
}

/// Evaluates the body; fills `tangent` if given.
pub fn evaluate_body(
    problem: &Problem,
    loading: &Loading,
    trial: &Trial<'_>,
    mut tangent: Option<&mut SymmetricMatrix>,
    out: &mut Evaluation,
) -> Result<(), StepError> {
    if let Some(t) = tangent.as_deref_mut() {
        t.values.fill(0.0);
    }
    out.residual_n.clear();
    out.residual_n.resize(3 * problem.mesh.nodes.len(), 0.0);
    (out.stored_mj, out.contact_mj) = (0.0, 0.0);
    out.j_min = f64::INFINITY;
    let mut lag = Lag::new(problem, trial.independent);
    elements(problem, trial, tangent.as_deref_mut(), out, &mut lag)?;
    lag.condense(problem);
    fluid(problem, trial, tangent.as_deref_mut(), out)?;
    if let Some(tension) = &problem.tension {
        let forces = (tangent.as_deref_mut(), out.residual_n.as_mut_slice());
        out.stored_mj += tension.add(&problem.mesh, &problem.system, trial.u, forces);
    }
    out.potential_mj = out.stored_mj;
    let mut reference = contact(problem, loading, trial, tangent.as_deref_mut(), out);
    let share = loading.share(trial.load_fraction);
    if let Some(pressure) = &loading.pressure {
        let acting = pressure.add(problem, trial.u, share, tangent, &mut out.residual_n);
        out.potential_mj -= acting.work_mj;
        for i in 0..3 {
            out.contact_force_n[i] += acting.force_n[i];
            out.normal_force_n[i] += acting.force_n[i];
        }
        reference += acting.square;
    }
    for (node, f) in loading.dead_n.iter().enumerate() {
        for i in 0..3 {
            let force = share * f[i];
            out.residual_n[3 * node + i] -= force;
            out.potential_mj -= force * trial.u[node][i];
            reference += force * force;
        }
    }
    problem.mesh.condense(&mut out.residual_n);
    out.mixed_norm = lag.norm_n(problem, &out.residual_n);
    let surplus = out.surplus_mm3.iter().map(|s| (problem.surplus_n_per_mm3 * s).powi(2));
    let mut norm: f64 = surplus.sum();
    for (r, &e) in out.residual_n.iter().zip(&problem.system.dofs.of_dof) {
        if e == crate::linear::DofMap::FIXED {
            reference += r * r;
        } else {
            norm += r * r;
        }
    }
    out.residual_norm = norm.sqrt();
    out.reference_norm = reference.sqrt();
    if out.residual_norm.is_finite() && out.potential_mj.is_finite() {
        Ok(())
    } else {
        Err(StepError::NotFinite)
    }
}

fn elements(
    problem: &Problem,
    trial: &Trial<'_>,
    mut tangent: Option<&mut SymmetricMatrix>,
    out: &mut Evaluation,
    lag: &mut Lag,
) -> Result<(), StepError> {
    let mut independent = trial.independent.iter();
    let mut lag_n = [[0.0; 3]; 27];
    let mut local = [[0.0; 3]; 27];
    let mut force = [[0.0; 3]; 27];
    let mut dense = Vec::new();
    for (b, (block, geometry)) in problem.mesh.blocks.iter().zip(&problem.geometry).enumerate() {
        let n = block.kind.nodes();
        for e in 0..block.len() {
            let nodes = block.element(e);
            for (l, &node) in local.iter_mut().zip(nodes) {
                *l = trial.u[node as usize];
            }
            let stiffness = tangent.is_some().then(|| {
                dense.clear();
                dense.resize(9 * n * n, 0.0);
                dense.as_mut_slice()
            });
            let material = &problem.materials[block.region[e]];
            let variables =
                problem.history_layout.as_ref().map_or(HistoryVariables::default(), |layout| {
                    layout.of(trial.variables.history, trial.variables.dt_s, b, e)
                });
            let own = independent.next().map(|&theta_minus_1| IndependentDilatation {
                theta_minus_1,
                lag_n: &mut lag_n[..n],
            });
            let keeps = own.is_some();
            let g = geometry.element(e);
            let state = material
                .evaluate_with(g, &local[..n], variables, own, &mut force[..n], stiffness)
                .map_err(|i| StepError::Inverted { block: b, element: e, j: i.j })?;
            out.stored_mj += state.energy_mj;
            if state.j_min < out.j_min {
                (out.j_min, out.j_min_at) = (state.j_min, [b, e]);
            }
            for (f, &node) in force.iter().zip(nodes) {
                for i in 0..3 {
                    out.residual_n[3 * node as usize + i] += f[i];
                }
            }
            if keeps {
                let mu_mpa = material.shear_modulus_mpa();
                lag.add(nodes, &lag_n, mu_mpa, g.weights, state.gap_squared_mm3);
            }
            if let Some(t) = tangent.as_deref_mut() {
                problem.system.add_element(t, b, e, &mut dense);
            }
        }
    }
    Ok(())
}

/// Adds the fluid's pressure.
fn fluid(
    problem: &Problem,
    trial: &Trial<'_>,
    tangent: Option<&mut SymmetricMatrix>,
    out: &mut Evaluation,
) -> Result<(), StepError> {
    let (Some(phase), Some(flow)) = (&problem.fluid, trial.fluid) else { return Ok(()) };
    let forces = FluidForces {
        force_n: &mut out.residual_n,
        surplus_mm3: &mut out.surplus_mm3,
        tangent: tangent.map(|t| (&problem.system, t)),
    };
    phase
        .add(problem.solid(), trial.u, flow, trial.variables.dt_s, forces)
        .map_err(|(block, element, i)| StepError::Inverted { block, element, j: i.j })
}

/// Adds contact; returns the square of its force norm.
fn contact(
    problem: &Problem,
    loading: &Loading,
    trial: &Trial<'_>,
    mut tangent: Option<&mut SymmetricMatrix>,
    out: &mut Evaluation,
) -> f64 {
    out.traction_mpa.clear();
    out.friction.clear();
    out.curvature.clear();
    out.gap_error_mm = 0.0;
    out.contact_force_n = [0.0; 3];
    out.normal_force_n = [0.0; 3];
    let (Some(surface), Some(indenter)) = (&problem.contact, &loading.indenter) else { return 0.0 };
    let placement = indenter.placement(trial.load_fraction);
    let points = surface.points(indenter.contact);
    let has_multipliers = indenter.contact.has_multipliers();
    let mut square = 0.0;
    for (at, ((support, area), &last)) in points.iter().zip(trial.multipliers_mpa).enumerate() {
        let multiplier = if has_multipliers { last } else { 0.0 };
        let x = support.of(|n| trial.place(problem, n));
        let d = placement.distance(indenter.shape.as_ref(), x);
        let Some(c) = PointContact::new(&d, area, multiplier, trial.penalty) else {
            out.traction_mpa.push(0.0);
            continue;
        };
        out.traction_mpa.push(c.traction_mpa);
        out.potential_mj += c.energy_mj;
        if !has_multipliers {
            out.contact_mj += c.energy_mj;
        }
        if c.traction_mpa > 0.0 {
            out.gap_error_mm = out.gap_error_mm.max(d.gap_mm.abs());
        }
        square += out.add_contact_force(support, c.force_n);
        if let Some(t) = tangent.as_deref_mut() {
            problem.add_point(t, support, &c.stiffness);
            out.curvature.extend(c.curvature.map(|k| (at, k)));
        }
    }
    out.normal_force_n = out.contact_force_n;
    if let Some(friction) = trial.friction {
        square += add_friction(problem, loading, trial, friction, tangent, out);
    }
    square
}

/// Penalty of what sticks over that of what presses, where both stand for multipliers: bounds are a
/// part of pressure, and a softer turn from stick to slip is found in fewer steps.
const STICK_PART: f64 = 0.1;

/// Adds friction; returns the square of its force norm.
fn add_friction(
    problem: &Problem,
    loading: &Loading,
    trial: &Trial<'_>,
    friction: &FrictionTrial,
    mut tangent: Option<&mut SymmetricMatrix>,
    out: &mut Evaluation,
) -> f64 {
    let (Some(surface), Some(indenter)) = (&problem.contact, &loading.indenter) else { return 0.0 };
    let offset = indenter.offset_mm(trial.load_fraction);
    let part = if indenter.contact.has_multipliers() { 1.0 } else { STICK_PART };
    let penalty = part * trial.penalty;
    let mut square = 0.0;
    for ((support, area), state) in surface.points(indenter.contact).iter().zip(&friction.points) {
        let x = support.of(|n| trial.place(problem, n));
        let relative = std::array::from_fn(|i| x[i] - offset[i]);
        let found = PointFriction::new(state, relative, area, penalty);
        out.friction.push(found.map_or([0.0; 3], |f| f.traction_mpa));
        let Some(f) = found else { continue };
        out.potential_mj += f.energy_mj;
        square += out.add_contact_force(support, f.force_n);
        if let Some(t) = tangent.as_deref_mut() {
            problem.add_point(t, support, &f.stiffness);
        }
    }
    square
}

impl Trial<'_> {
    /// Deformed place of a mesh node, mm.
    fn place(&self, problem: &Problem, node: usize) -> [f64; 3] {
        std::array::from_fn(|i| problem.mesh.nodes[node][i] + self.u[node][i])
    }
}

impl Evaluation {
    /// Adds the derivative of a contact potential at a point; returns its square.
    fn add_contact_force(&mut self, support: Support<'_>, force_n: [f64; 3]) -> f64 {
        let mut square = 0.0;
        for i in 0..3 {
            for (&n, v) in support.nodes.iter().zip(support.values) {
                self.residual_n[3 * n as usize + i] += v * force_n[i];
            }
            self.contact_force_n[i] -= force_n[i];
            square += force_n[i] * force_n[i];
        }
        square
    }
}

/// Forces on the body at an equilibrium.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Balance {
    /// Force of the indenter, or of pressure, on the body, N.
    pub contact_force_n: [f64; 3],
    /// Part of it that acts along the indenter's normals, N.
    pub normal_force_n: [f64; 3],
    /// Force of the supports on the body, N.
    pub support_force_n: [f64; 3],
}
