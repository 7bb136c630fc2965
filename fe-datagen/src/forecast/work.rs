//! How much iteration a press takes.
//!
//! The numbers were counted in twelve presses of fingertip and block, coarse and
//! medium, with each effect on and off (docs/scenes.md, 'What a scene costs');
//! the number of equilibria follows from the stored states.

use crate::press::drive::Drive;
use crate::press::setup::Setup;
use crate::scene::effects::Law;
use serde::Serialize;

/// Iterations of a whole press.
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
/// Evaluations for one stored state: fields and energies.
const FORCES_PER_STATE: f64 = 2.0;
/// Equilibria tried for one prescribed force.
const TRIES_PER_FORCE: f64 = 7.7;
/// Equilibria between first touch and the first two stored depths.
const EXTRA_DEPTHS: [usize; 2] = [5, 1];

impl Work {
    pub(super) fn new(setup: &Setup) -> Self {
        let equilibria = equilibria(setup);
        let rate = if setup.approach.friction > 0.0 {
            Rate { newton: 14.0, factorizations: 1.5, cg: 4.9 }
        } else if setup.plan.law == Law::Linear {
            Rate { newton: 2.8, factorizations: 0.2, cg: 4.4 }
        } else {
            Rate { newton: 3.6, factorizations: 0.55, cg: 4.2 }
        };
        let newton = rate.newton * equilibria;
        Self {
            equilibria,
            newton_iterations: newton,
            force_evaluations: FORCES_PER_NEWTON * newton
                + FORCES_PER_EQUILIBRIUM * equilibria
                + FORCES_PER_STATE * setup.drive.len() as f64,
            factorizations: (rate.factorizations * equilibria).max(1.0),
            cg_iterations: rate.cg * newton,
        }
    }
}

fn equilibria(setup: &Setup) -> f64 {
    let points = match &setup.drive {
        Drive::Forces(forces) => return TRIES_PER_FORCE * forces.len() as f64,
        Drive::Depths(depths) => {
            return (depths.len() + EXTRA_DEPTHS.iter().take(depths.len()).sum::<usize>()) as f64;
        }
        Drive::Path(points) => points,
    };
    let problem = &setup.body.problem;
    if problem.memory.is_none() {
        return points.len() as f64;
    }
    // Between two stored times steps start at half the shortest relaxation time
    // and may double from one to the next.
    let shortest = problem.materials.iter().filter_map(|m| m.shortest_time_s());
    let first_s = 0.5 * shortest.fold(f64::INFINITY, f64::min);
    let mut last_s = 0.0;
    let steps = points.iter().map(|p| {
        let lasts_s = p.time_s - std::mem::replace(&mut last_s, p.time_s);
        (lasts_s / first_s + 1.0).log2().ceil()
    });
    steps.sum()
}
