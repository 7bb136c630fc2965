//! How an indenter is driven into a body, and the states at which it is recorded.

use super::body::{Body, SimulationError};
use super::guide::Guided;
use super::record::IncrementRecord;
use super::way::{Stops, Way};
use crate::indenter::IndenterError;
use crate::scene::Pose;
use papilla_fem::contact::ContactRule;
use papilla_fem::solve::{Effort, Loading, Snapshot, Solver, StepReport};
use papilla_sdf::{IndenterSpec, Plate, RoundedPlate, SignedDistance};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// A rigid indenter in its pose, about to touch.
#[derive(Clone)]
pub struct Approach {
    /// Its shape.
    pub shape: Arc<dyn SignedDistance>,
    /// Highest point of the shape along its own z, mm.
    pub top_mm: f64,
    /// Orientation.
    pub pose: Pose,
    /// Where its axis meets the skin, mm along its own x and y from the skin
    /// point that a flat plate would touch first.
    pub offset_mm: [f64; 2],
    /// Coulomb coefficient; 0 is no friction.
    pub friction: f64,
    /// Where on the skin contact is found; `None` leaves that to its width and the mesh.
    pub contact: Option<ContactRule>,
}

impl Approach {
    /// The 20 mm plate of the surface-pressure study in a pose, without friction.
    #[must_use]
    pub fn plate(pose: Pose) -> Self {
        let plate = RoundedPlate::from(&Plate::default());
        let top_mm = plate.half_mm[2];
        Self {
            shape: Arc::new(plate),
            top_mm,
            pose,
            offset_mm: [0.0; 2],
            friction: 0.0,
            contact: None,
        }
    }

    /// A described indenter in a pose, straight over the first touch, without friction.
    ///
    /// # Errors
    /// [`IndenterError`] if the description is of no shape, or names a file that cannot be read.
    pub fn straight(indenter: &IndenterSpec, pose: Pose) -> Result<Self, IndenterError> {
        Ok(Self {
            shape: indenter.build(Path::new(""))?,
            top_mm: indenter.top_mm(),
            pose,
            offset_mm: [0.0; 2],
            friction: 0.0,
            contact: None,
        })
    }
}

/// States that are stored.
#[derive(Clone, Debug, PartialEq)]
pub enum Drive {
    /// Straight, at these depths from first touch, mm, rising.
    Depths(Vec<f64>),
    /// Straight, at these forces along the motion, N, rising.
    Forces(Vec<f64>),
    /// Not moved by an indenter: at these shares of a given pressure, rising.
    Shares(Vec<f64>),
    /// Along a path over time.
    Path(Vec<DrivePoint>),
}

/// A point of a path from first touch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DrivePoint {
    /// Time, s.
    pub time_s: f64,
    /// Depth, mm.
    pub depth_mm: f64,
    /// Displacement along the indenter's own x and y, mm.
    pub shift_mm: [f64; 2],
}

impl DrivePoint {
    /// Equilibria from here to another: one, and with friction one for each tenth of a millimetre.
    #[must_use]
    pub fn steps_to(&self, to: &Self, friction: f64) -> u32 {
        let [x, y] = [0, 1].map(|k: usize| to.shift_mm[k] - self.shift_mm[k]);
        let way_mm = (to.depth_mm - self.depth_mm).hypot(x.hypot(y));
        // Less than rounding is no step.
        let steps = (way_mm / RUBBED_STEP_MM - 1e-9).ceil().max(1.0) as u32;
        if friction > 0.0 { steps } else { 1 }
    }

    /// The point `i / n` of the way to `to`.
    #[must_use]
    pub fn towards(&self, to: &Self, i: usize, n: usize) -> Self {
        let part = i as f64 / n as f64;
        let mix = |a: f64, b: f64| a + part * (b - a);
        Self {
            time_s: mix(self.time_s, to.time_s),
            depth_mm: mix(self.depth_mm, to.depth_mm),
            shift_mm: std::array::from_fn(|k| mix(self.shift_mm[k], to.shift_mm[k])),
        }
    }
}

/// Called with the solver at each stored equilibrium.
pub type Visit<'a> = &'a mut dyn FnMut(&Solver<'_>, &IncrementRecord, &StepReport);

/// As [`Visit`]; an error ends the indentation.
pub(super) type Watch<'a> =
    &'a mut dyn FnMut(&Solver<'_>, &IncrementRecord, &StepReport) -> Result<(), SimulationError>;

/// How an indentation is taken.
#[derive(Clone, Copy)]
pub(super) struct Course<'a> {
    /// See [`Body::press`].
    pub refinement: u32,
    /// At stored depths work is mended ([`Solver::mend_work`]) until it parts from energy by no
    /// more than this.
    pub energy_vs_work_max: Option<f64>,
    /// Stored depths that are behind, and the solver there.
    pub from: Option<(usize, &'a Snapshot)>,
}

/// Farthest that a prescribed force is looked for, mm.
pub(super) const FORCE_TRAVEL_MAX_MM: f64 = 6.0;
/// How closely a prescribed force is met.
const FORCE_TOLERANCE: f64 = 1e-4;
/// Farthest from one equilibrium to the next on a path with friction, mm: which points stick depends
/// on the way, and a long step takes ten times the iterations of a short one.
const RUBBED_STEP_MM: f64 = 0.1;
/// Equilibria tried for one prescribed force.
const FORCE_TRIES_MAX: u32 = 60;

impl Body {
    /// Presses and calls `visit` with the solver at each stored equilibrium and
    /// its record. There are more equilibria than stored depths, for the work integral;
    /// `refinement` 2 halves their distance, and so on; of a path over time it is the number of
    /// equilibria for each [step](DrivePoint::steps_to) that is reached by moving. The stored states
    /// do not depend on it (those of a path to the error of time integration); forces ignore it.
    ///
    /// # Errors
    /// [`SimulationError::Solve`] names the state that found no equilibrium; records
    /// up to it have been visited.
    pub fn press(
        &self,
        solver: &mut Solver<'_>,
        approach: &Approach,
        drive: &Drive,
        refinement: u32,
        visit: Visit<'_>,
    ) -> Result<(), SimulationError> {
        let course = Course { refinement, energy_vs_work_max: None, from: None };
        self.press_to(solver, approach, drive, course, &mut |solver, record, report| {
            visit(solver, record, report);
            Ok(())
        })
    }

    /// As [`Self::press`], on a course; only depths can be gone on with.
    pub(super) fn press_to(
        &self,
        solver: &mut Solver<'_>,
        approach: &Approach,
        drive: &Drive,
        course: Course<'_>,
        visit: Watch<'_>,
    ) -> Result<(), SimulationError> {
        drive.validate()?;
        if let Drive::Shares(shares) = drive {
            return self.to_shares(solver, shares, course.refinement, visit);
        }
        let duration_s = match drive {
            Drive::Path(points) => points.last().map_or(0.0, |p| p.time_s),
            _ => 0.0,
        };
        solver.start(Loading {
            indenter: Some(self.indenter(approach, drive)?),
            friction: approach.friction,
            duration_s,
            ..Loading::default()
        });
        match drive {
            Drive::Depths(depths) => {
                let guided = self.guided(approach, drive, solver.stops_when())?;
                self.to_depths(solver, guided, depths, course, visit)
            }
            Drive::Forces(forces) => self.to_forces(solver, forces, visit),
            Drive::Shares(_) => Err(SimulationError::Empty),
            Drive::Path(points) => {
                self.along(solver, points, (approach.friction, course.refinement), visit)
            }
        }
    }

    /// The guide of this body, about to press; `None` if there is none or states depend on the
    /// way to them.
    fn guided(
        &self,
        approach: &Approach,
        drive: &Drive,
        stop: Option<Arc<AtomicBool>>,
    ) -> Result<Option<Guided<'_>>, SimulationError> {
        let depends = approach.friction > 0.0
            || self.problem.history_layout.is_some()
            || self.problem.fluid.is_some();
        let Some(guide) = self.guide.as_ref().filter(|_| !depends) else { return Ok(None) };
        Guided::new(guide, guide.body.indenter(approach, drive)?, stop).map(Some)
    }

    fn to_depths(
        &self,
        solver: &mut Solver<'_>,
        mut guided: Option<Guided<'_>>,
        depths_mm: &[f64],
        Course { refinement, energy_vs_work_max, from }: Course<'_>,
        visit: Watch<'_>,
    ) -> Result<(), SimulationError> {
        let stops = match &guided {
            Some(_) => Stops::guided(depths_mm),
            None => Stops::stored(depths_mm),
        };
        let graded = self.graded;
        let way = Way { depths_mm: &stops.depths_mm, refinement, graded, energy_vs_work_max };
        let behind = match from {
            Some((behind, snapshot)) => {
                solver.resume(snapshot)?;
                behind
            }
            None => 0,
        };
        for stop in stops.between(0, behind) {
            guided = guided.and_then(|g| way.lead(g, stop));
        }
        for (i, &depth_mm) in depths_mm.iter().enumerate().skip(behind) {
            let clock = Instant::now();
            let mut spent = StepReport::default();
            for stop in stops.between(i, i + 1) {
                let report = way.beside(&mut guided, solver, stop)?;
                spent = StepReport {
                    effort: spent.effort.plus(&report.effort),
                    mending: spent.mending.plus(&report.mending),
                    guiding: spent.guiding.plus(&report.guiding),
                    ..report
                };
            }
            let mut record = self.record(solver, depth_mm, &spent)?;
            record.seconds = clock.elapsed().as_secs_f64();
            visit(solver, &record, &spent)?;
        }
        Ok(())
    }

    fn along(
        &self,
        solver: &mut Solver<'_>,
        points: &[DrivePoint],
        (friction, refinement): (f64, u32),
        visit: Watch<'_>,
    ) -> Result<(), SimulationError> {
        let end = points.last().map_or(1.0, |p| p.time_s);
        let mut from = DrivePoint::default();
        for p in points {
            let clock = Instant::now();
            solver.turn();
            let at = |source| SimulationError::at_depth(p.depth_mm, source);
            // An indenter that rests does no work.
            let rests = *p == DrivePoint { time_s: p.time_s, ..from };
            let parts = if rests { 1 } else { (from.steps_to(p, friction) * refinement) as usize };
            let mut effort = Effort::default();
            for i in 1..parts {
                let between_s = from.towards(p, i, parts).time_s;
                effort = effort.plus(&solver.advance_to(between_s / end).map_err(at)?.effort);
            }
            from = *p;
            let mut report = solver.advance_to(p.time_s / end).map_err(at)?;
            report.effort = report.effort.plus(&effort);
            let mut record = self.record(solver, p.depth_mm, &report)?;
            record.time_s = p.time_s;
            record.seconds = clock.elapsed().as_secs_f64();
            visit(solver, &record, &report)?;
        }
        Ok(())
    }

    /// Secant and bisection on the depth, always coming from a state below.
    fn to_forces(
        &self,
        solver: &mut Solver<'_>,
        forces_n: &[f64],
        visit: Watch<'_>,
    ) -> Result<(), SimulationError> {
        // Depth grows about as force^(2/3); the first guess is a small part of it.
        let mut low: (f64, f64) = (0.0, 0.0);
        let mut step = 0.02;
        for &wanted in forces_n {
            let clock = Instant::now();
            let mut effort = Effort::default();
            let mut high: Option<(f64, f64)> = None;
            let mut found = None;
            for _ in 0..FORCE_TRIES_MAX {
                let next = match high {
                    None => (low.0 + step).min(1.0),
                    Some(h) => {
                        let secant = low.0 + (wanted - low.1) / (h.1 - low.1) * (h.0 - low.0);
                        let width = h.0 - low.0;
                        secant.clamp(low.0 + 0.05 * width, h.0 - 0.05 * width)
                    }
                };
                let depth_mm = next * FORCE_TRAVEL_MAX_MM;
                let mark = solver.mark();
                let report = solver
                    .advance_to(next)
                    .map_err(|source| SimulationError::at_depth(depth_mm, source))?;
                effort = effort.plus(&report.effort);
                let force = solver.force_along_path_n();
                if (force - wanted).abs() <= FORCE_TOLERANCE * wanted {
                    found = Some((next, force, report));
                    break;
                }
                if force > wanted {
                    solver.restore(&mark);
                    high = Some((next, force));
                } else {
                    step = (next - low.0)
                        * ((wanted - force) / (force - low.1).max(1e-300)).clamp(0.2, 1.5);
                    low = (next, force);
                    if next >= 1.0 {
                        break;
                    }
                }
            }
            let Some((at, force, mut report)) = found else {
                return Err(SimulationError::Force { wanted_n: wanted, reached_n: low.1 });
            };
            low = (at, force);
            report.effort = effort;
            let mut record = self.record(solver, at * FORCE_TRAVEL_MAX_MM, &report)?;
            record.seconds = clock.elapsed().as_secs_f64();
            visit(solver, &record, &report)?;
        }
        Ok(())
    }
}

impl Drive {
    /// Number of stored states.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Depths(v) | Self::Forces(v) | Self::Shares(v) => v.len(),
            Self::Path(points) => points.len(),
        }
    }

    /// Whether nothing is stored.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether states have a time.
    #[must_use]
    pub const fn is_timed(&self) -> bool {
        matches!(self, Self::Path(_))
    }

    fn validate(&self) -> Result<(), SimulationError> {
        let rising: Vec<f64> = match self {
            Self::Depths(v) | Self::Forces(v) | Self::Shares(v) => v.clone(),
            Self::Path(points) => points.iter().map(|p| p.time_s).collect(),
        };
        let mut last = 0.0;
        for v in rising {
            if !(v.is_finite() && v > last) {
                return Err(SimulationError::Rising(v, last));
            }
            last = v;
        }
        Ok(())
    }
}
