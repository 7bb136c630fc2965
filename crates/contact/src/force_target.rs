//! Contact under a net force: how far objects have to travel.

use crate::answer::{Contact, Effort};
use crate::error::ContactError;
use crate::objects::{Object, View, validate};
use crate::solver::Solver;

/// Farthest that objects travel, mm.
const TRAVEL_MAX_MM: f64 = 30.0;
/// First step of the travel, mm.
const STEP_MM: f64 = 0.1;
/// How closely the force is met.
const TOLERANCE: f64 = 2e-3;
/// Most frames tried.
const TRIES_MAX: u32 = 40;

impl Solver {
    /// Moves `objects` along the unit vector `direction` until they press on the finger along it
    /// with `force_n`, and finds what presses there; returns their travel, mm, which is negative
    /// where they have to draw back.
    ///
    /// Secant and bisection between a travel with too little force and one with too much. What
    /// it took is summed over all frames tried.
    ///
    /// # Errors
    /// [`ContactError::Force`] if no travel up to 30 mm gives the force;
    /// [`ContactError::Value`] for a direction that is no unit vector, or no positive force.
    pub fn solve_for_force(
        &mut self,
        objects: &[Object],
        direction: [f64; 3],
        force_n: f64,
        out: &mut Contact,
    ) -> Result<f64, ContactError> {
        validate(objects)?;
        let size = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
        if !((size - 1.0).abs() < 1e-3) {
            let (member, rule) = ("direction", "has to be a unit vector; this is its length");
            return Err(ContactError::Value { member, value: size, rule });
        }
        if !(force_n > 0.0 && force_n.is_finite()) {
            let (member, rule) = ("force_n", "has to be positive");
            return Err(ContactError::Value { member, value: force_n, rule });
        }
        let length = self.person().width;
        let mut effort = Effort::default();
        let [mut low, mut high]: [Option<(f64, f64)>; 2] = [None, None];
        let (mut travel, mut reached) = (0.0f64, 0.0f64);
        for _ in 0..TRIES_MAX {
            let shift_mm = direction.map(|d| d * travel / length);
            let view = View { objects, length, shift_mm };
            self.frame(view, out);
            effort = effort.plus(out.effort);
            out.effort = effort;
            let force = (0..3).map(|i| direction[i] * out.force_n[i]).sum::<f64>();
            reached = reached.max(force);
            if (force - force_n).abs() <= TOLERANCE * force_n {
                return Ok(travel);
            }
            *if force < force_n { &mut low } else { &mut high } = Some((travel, force));
            travel = match (low, high) {
                (Some((a, fa)), Some((b, fb))) => {
                    let part = ((force_n - fa) / (fb - fa)).clamp(0.1, 0.9);
                    a + part * (b - a)
                }
                (Some((a, fa)), None) if fa > 0.0 => a + STEP_MM.max(0.5 * a.abs().min(1.0)),
                (Some((a, _)), None) => a + self.free_mm(view).max(STEP_MM),
                (None, Some((b, _))) => b - 4.0 * STEP_MM,
                (None, None) => travel,
            };
            if travel.abs() > TRAVEL_MAX_MM {
                break;
            }
        }
        let (wanted_n, reached_n) = (force_n, reached);
        Err(ContactError::Force { wanted_n, reached_n, depth_mm: travel.abs() })
    }
}
