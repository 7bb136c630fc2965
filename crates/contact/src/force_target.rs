//! Contact under a net force: how far objects have to travel until they press with it.

use crate::answer::{Contact, Effort};
use crate::error::ContactError;
use crate::objects::{Scene, View};
use crate::solver::{Reached, Solver};
use papilla_vector::norm;

/// Farthest that things travel, mm.
const TRAVEL_MAX_MM: f64 = 30.0;
/// First step of the travel, mm.
const STEP_MM: f64 = 0.1;
/// Longest step where only one side of the travel is known, mm.
const STEP_MAX_MM: f64 = 1.0;
/// Most linearisations in all frames tried.
const ITERATIONS_MAX: u32 = 400;
/// A travel this near an end of its bracket, as part of it, goes to the middle.
const MARGIN: f64 = 0.02;

/// How a body lies beyond the trusted depth, mm of the person.
struct Beyond {
    excess_mm: f64,
    /// Slope of the force over the force.
    part_per_mm: f64,
}

/// A net force to be met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NetForce {
    /// Unit vector along which things travel and press.
    pub direction: [f64; 3],
    /// Force on the finger along it, N.
    pub force_n: f64,
}

/// How the travel is looked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Search {
    /// How closely the force is met.
    pub(crate) tolerance: f64,
    /// Most frames tried.
    pub(crate) tries_max: u32,
}

impl Search {
    pub(crate) const AT_VERTICES: Self = Self { tolerance: 2e-3, tries_max: 40 };
}

impl NetForce {
    pub(crate) fn validate(&self) -> Result<(), ContactError> {
        let size = norm(self.direction);
        if !((size - 1.0).abs() < 1e-3) {
            let (member, rule) = ("direction", "has to be a unit vector; this is its length");
            return Err(ContactError::Value { member, value: size, rule });
        }
        if !(self.force_n > 0.0 && self.force_n.is_finite()) {
            let (member, rule) = ("force_n", "has to be positive");
            return Err(ContactError::Value { member, value: self.force_n, rule });
        }
        Ok(())
    }
}

impl Solver {
    /// Moves the things of a scene along a direction until they press on the finger with a net
    /// force, and finds what presses there; returns their travel, mm, which is negative where they
    /// have to draw back.
    ///
    /// Secant steps, kept between a travel with too little force and one with too much; the first
    /// is where the last frame ended. What it took is summed over all frames tried.
    ///
    /// # Errors
    /// [`ContactError::Force`] if no travel up to 30 mm gives the force; a search that has used the
    /// frame's budget ends with what it has, which is not settled;
    /// [`ContactError::Value`] for a direction that is no unit vector, or no positive force.
    pub fn solve_for_force<'a>(
        &mut self,
        scene: impl Into<Scene<'a>>,
        net: NetForce,
        out: &mut Contact,
    ) -> Result<f64, ContactError> {
        net.validate()?;
        let everywhere = f32::INFINITY;
        self.within(scene.into(), everywhere, |solver, view| {
            (solver.sides.toward, solver.sides.fine) = (Some(net.direction), false);
            let mut effort = Effort::default();
            let how = Search::AT_VERTICES;
            let travel = solver.travel_until(view, net, how, (&mut effort, out), Self::frame)?;
            let shift_mm = net.direction.map(|d| d * travel / view.length);
            let view = View { shift_mm, ..view };
            solver.tell_missed(view, true, out);
            solver.follow_slip(view);
            Ok(travel)
        })
    }

    /// How far the last frame was solved beyond the trusted depth, if it was.
    fn beyond(&self, length: f64) -> Option<Beyond> {
        let (strength, slope) = self.strength()?;
        let excess_mm = (strength - 1.0) / slope * length;
        Some(Beyond { excess_mm, part_per_mm: slope / strength / length })
    }

    /// Ends a search whose budget is used at the travel that was tried last: what presses there is
    /// not settled, and the next frame starts from the travel that would have been next.
    fn end_search(&mut self, [at, next]: [f64; 2], slope: Option<f64>, out: &mut Contact) -> f64 {
        out.quality.settled = false;
        let travel_mm = if next.abs() <= TRAVEL_MAX_MM { next } else { at };
        self.reached = Some(Reached { travel_mm, slope_n_per_mm: slope.unwrap_or(0.0) });
        at
    }

    /// Looks for the travel with `frame`, which finds what presses in a view; what was taken before
    /// counts.
    pub(crate) fn travel_until(
        &mut self,
        view: View<'_>,
        NetForce { direction, force_n }: NetForce,
        Search { tolerance, tries_max }: Search,
        (effort, out): (&mut Effort, &mut Contact),
        mut frame: impl FnMut(&mut Self, View<'_>, &mut Contact) -> Result<(), ContactError>,
    ) -> Result<f64, ContactError> {
        let [mut low, mut high]: [Option<(f64, f64)>; 2] = [None, None];
        let mut last: Option<(f64, f64)> = None;
        let start = self.reached.take();
        let mut slope = start.map(|s| s.slope_n_per_mm);
        let (mut travel, mut reached) = (start.map_or(0.0, |s| s.travel_mm), 0.0f64);
        for _ in 0..tries_max {
            let shift_mm = direction.map(|d| d * travel / view.length);
            let view = View { shift_mm, ..view };
            frame(self, view.after(effort), out)?;
            *effort = effort.plus(out.effort);
            out.effort = *effort;
            let force = (0..3).map(|i| direction[i] * out.force_n[i]).sum::<f64>();
            reached = reached.max(force);
            if let Some((at, then)) = last.filter(|(_, then)| *then > 0.0 && force > 0.0) {
                let found = (force - then) / (travel - at);
                slope = Some(found).filter(|s| *s > 0.0 && s.is_finite()).or(slope);
            }
            if (force - force_n).abs() <= tolerance * force_n {
                let slope_n_per_mm = slope.unwrap_or(0.0);
                self.reached = Some(Reached { travel_mm: travel, slope_n_per_mm });
                return Ok(travel);
            }
            last = Some((travel, force));
            let at = travel;
            // Beyond the trusted depth force goes on by a known slope.
            let beyond = self.beyond(view.length);
            if let Some(Beyond { excess_mm, part_per_mm }) = beyond {
                let ahead = (force * part_per_mm).max(0.0) * (TRAVEL_MAX_MM - travel);
                if force < force_n && 1.1 * (force + ahead) < force_n {
                    let reached_n = reached.max(force + ahead);
                    let depth_mm = TRAVEL_MAX_MM;
                    return Err(ContactError::Force { wanted_n: force_n, reached_n, depth_mm });
                }
                if force > force_n && low.is_none() {
                    // No less than what is left at the trusted depth is found by steps from there.
                    high = last;
                    travel -= excess_mm.max(STEP_MM);
                    if view.is_spent(effort) {
                        return Ok(self.end_search([at, travel], slope, out));
                    }
                    if travel.abs() > TRAVEL_MAX_MM || effort.iterations > ITERATIONS_MAX {
                        break;
                    }
                    continue;
                }
            }
            *if force < force_n { &mut low } else { &mut high } = last;
            let secant = slope.filter(|s| *s > 0.0).map(|s| travel + (force_n - force) / s);
            travel = match (low, high) {
                (Some((a, _)), Some((b, _))) => {
                    let inside = |t: &f64| (MARGIN..1.0 - MARGIN).contains(&((t - a) / (b - a)));
                    secant.filter(inside).unwrap_or(0.5 * (a + b))
                }
                (Some((a, fa)), None) if fa > 0.0 => {
                    a + secant.map_or(STEP_MM, |t| (1.05 * (t - a)).clamp(1e-4, STEP_MAX_MM))
                }
                (Some((a, _)), None) => a + view.free_mm(&self.model, effort).max(STEP_MM),
                (None, Some((b, _))) => {
                    b + secant
                        .map_or(-4.0 * STEP_MM, |t| (1.05 * (t - b)).clamp(-STEP_MAX_MM, -1e-4))
                }
                (None, None) => travel,
            };
            if view.is_spent(effort) {
                return Ok(self.end_search([at, travel], slope, out));
            }
            if travel.abs() > TRAVEL_MAX_MM || effort.iterations > ITERATIONS_MAX {
                break;
            }
        }
        let (wanted_n, reached_n) = (force_n, reached);
        Err(ContactError::Force { wanted_n, reached_n, depth_mm: travel.abs() })
    }
}
