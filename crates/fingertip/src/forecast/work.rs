//! How much iteration an indentation takes.
//!
//! The numbers were counted in twelve indentations of fingertip and block, coarse and
//! medium, with each effect on and off (docs/reference/scenes.md, 'What a scene costs');
//! the number of equilibria follows from the stored states.

use crate::scene::effects::Law;
use crate::simulation::drive::{Drive, DrivePoint};
use crate::simulation::{Simulation, equilibria as way_equilibria};
use serde::Serialize;

/// Iterations of a whole indentation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Work {
    /// Equilibria on the way, stored or not.
    pub equilibria: f64,
    /// Newton iterations, each with a tangent.
    pub newton_iterations: f64,
    /// Evaluations of forces alone.
    pub force_evaluations: f64,
    /// Numeric factorizations.
    pub factorizations: f64,
    /// Iterations of conjugate gradients.
    pub cg_iterations: f64,
}

/// Iterations for one equilibrium.
struct Rate {
    newton: f64,
    factorizations: f64,
    /// Per Newton iteration.
    cg: f64,
}

/// Evaluations of forces for one equilibrium: at the start of each search for it
/// and after each update of multipliers.
const FORCES_PER_EQUILIBRIUM: f64 = 2.8;
/// Evaluations of forces for one Newton iteration: the line search's first try is
/// nearly always taken.
const FORCES_PER_NEWTON: f64 = 1.1;
/// Evaluations that the histories of a body with memory take at each equilibrium.
const FORCES_PER_HISTORY: f64 = 1.0;
/// Evaluations for one stored state: fields and energies.
const FORCES_PER_STATE: f64 = 2.0;
/// Equilibria tried for one prescribed force.
const TRIES_PER_FORCE: f64 = 7.7;
/// Equilibria on the way to the whole of a given pressure.
const SHARES: f64 = 8.0;

impl Work {
    pub(super) fn new(setup: &Simulation) -> Self {
        let equilibria = equilibria(setup);
        let flows = setup.body.problem.fluid.is_some();
        let rate = if flows {
            // Each Newton iteration factorizes and solves; counted on the coarse section.
            Rate { newton: 2.1, factorizations: 2.1, cg: 1.0 }
        } else if setup.approach.friction > 0.0 {
            Rate { newton: 14.0, factorizations: 1.5, cg: 4.9 }
        } else if setup.plan.law == Law::Linear {
            Rate { newton: 2.8, factorizations: 0.2, cg: 4.4 }
        } else {
            Rate { newton: 3.8, factorizations: 0.65, cg: 4.6 }
        };
        let newton = rate.newton * equilibria;
        let remembers = setup.body.problem.history_layout.is_some();
        let per_equilibrium =
            FORCES_PER_EQUILIBRIUM + if remembers { FORCES_PER_HISTORY } else { 0.0 };
        Self {
            equilibria,
            newton_iterations: newton,
            force_evaluations: FORCES_PER_NEWTON * newton
                + per_equilibrium * equilibria
                + FORCES_PER_STATE * setup.drive.len() as f64,
            factorizations: (rate.factorizations * equilibria).max(1.0),
            cg_iterations: rate.cg * newton,
        }
    }
}

fn equilibria(setup: &Simulation) -> f64 {
    let points = match &setup.drive {
        Drive::Forces(forces) => return TRIES_PER_FORCE * forces.len() as f64,
        Drive::Depths(depths) => {
            return way_equilibria(depths, setup.body.has_guide() && setup.approach.friction == 0.0)
                as f64;
        }
        Drive::Shares(shares) => return SHARES.max(shares.len() as f64),
        Drive::Path(points) => points,
    };
    let problem = &setup.body.problem;
    if problem.history_layout.is_none() && problem.fluid.is_none() {
        let mut last = DrivePoint::default();
        let steps =
            |p: &DrivePoint| std::mem::replace(&mut last, *p).steps_to(p, setup.approach.friction);
        return points.iter().map(steps).sum::<u32>().into();
    }
    if problem.fluid.is_some() {
        return flow_steps(points);
    }
    // From a stored time steps start at half the shortest relaxation time. While the
    // indenter holds still each may be twice as long as the last; while it
    // moves, spreading contact keeps them short.
    let shortest = problem.materials.models().filter_map(|m| m.shortest_time_s());
    let first_s = 0.5 * shortest.fold(f64::INFINITY, f64::min);
    let mut last = DrivePoint::default();
    let steps = points.iter().map(|p| {
        let from = std::mem::replace(&mut last, *p);
        let parts = (p.time_s - from.time_s) / first_s;
        let holds = DrivePoint { time_s: from.time_s, ..*p } == from;
        if holds { (parts + 1.0).log2().ceil() } else { parts.ceil() }
    });
    steps.sum()
}

/// Steps of fluid that flows: some 70 in a path that moves all the time (counted on the coarse
/// section); while the indenter holds still each is half as long again as the last, from a
/// hundredth of the whole path.
fn flow_steps(points: &[DrivePoint]) -> f64 {
    let end_s = points.last().map_or(1.0, |p| p.time_s);
    let mut last = DrivePoint::default();
    let steps = points.iter().map(|p| {
        let from = std::mem::replace(&mut last, *p);
        let share = (p.time_s - from.time_s) / end_s;
        let holds = DrivePoint { time_s: from.time_s, ..*p } == from;
        if holds { ((1.0 + 50.0 * share).ln() / 1.5f64.ln()).ceil() } else { (70.0 * share).ceil() }
    });
    steps.sum()
}
