//! The states of a press, solved or read from an earlier run.

use crate::people::PeopleError;
use crate::people::contact::{self, ContactRead};
use crate::people::force_path::{ForcePath, steps_mm};
use crate::people::gradients::Gradients;
use crate::people::press::{Cells, Press};
use crate::people::receptors::{Felt, Receptors};
use papilla_dataset::BALANCE_RELATIVE_MAX;
use papilla_fem::element::Inverted;
use papilla_fem::solve::{Options, Solver, StepReport};
use papilla_fingertip::geometry::fingertip::FingertipShape;
use papilla_fingertip::mesh::fingertip::{Density, Order};
use papilla_fingertip::mesh::grading::Contact;
use papilla_fingertip::scene::Scene;
use papilla_fingertip::simulation::balanced::{AtState, Stoppable};
use papilla_fingertip::simulation::body::{Body, SimulationError};
use papilla_fingertip::simulation::drive::Drive;
use papilla_fingertip::simulation::laws::solids;
use papilla_fingertip::simulation::record::IncrementRecord;
use papilla_processor::thread_s;
use papilla_validation::stored;
use serde::{Deserialize, Serialize};
use std::cell::Cell;
use std::ops::ControlFlow;
use std::path::Path;

/// Changes what is read of a state: files of other readings are solved again.
const READING: u32 = 2;

/// One stored state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct State {
    /// Contact, of presses that are asked about it.
    pub contact: Option<ContactRead>,
    /// Change of the soft tissue's volume, %.
    pub volume_change_percent: f64,
    /// What receptors feel, of presses that are asked about it.
    pub felt: Felt,
    /// |stored energy - work| over work.
    pub energy_vs_work: f64,
}

/// A press that was solved.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Solution {
    /// What it was solved from.
    fingerprint: String,
    /// Unknowns.
    pub unknowns: usize,
    /// Processor time, s.
    pub solve_s: f64,
    /// Depths and forces of its states.
    pub path: ForcePath,
    /// The states.
    pub states: Vec<State>,
    /// Why there are no deeper ones, if it was not told to stop.
    pub ended: Option<String>,
}

/// What is read beside force and volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub(crate) enum Reads {
    Force,
    Contact,
    /// Receptors on lines from the middle.
    Receptors,
    /// Receptors all over the skin around the middle.
    Population,
    /// Displacement gradients of the epidermis.
    Gradients,
}

/// What reads a state.
enum Reader<'a> {
    None,
    Receptors(Receptors<'a>),
    Gradients(Gradients<'a>),
}

impl<'a> Reader<'a> {
    fn new(
        reads: Reads,
        press: &str,
        finger: &FingertipShape,
        body: &'a Body,
        first: [f64; 3],
    ) -> Result<Self, PeopleError> {
        Ok(match reads {
            Reads::Receptors => Self::Receptors(Receptors::lines(press, finger, body, first)?),
            Reads::Population => Self::Receptors(Receptors::grid(press, finger, body, first)?),
            Reads::Gradients => Self::Gradients(Gradients::new(press, finger, body, first)?),
            Reads::Force | Reads::Contact => Self::None,
        })
    }

    fn felt(&self, solver: &Solver<'_>, record: &IncrementRecord) -> Result<Felt, Inverted> {
        match self {
            Self::None => Ok(Felt::new()),
            Self::Receptors(r) => r.felt(solver, record),
            Self::Gradients(g) => Ok(g.read(solver)),
        }
    }
}

/// How far a press goes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Course {
    pub cells: Cells,
    /// Stored states.
    pub depths_mm: Vec<f64>,
    /// It stops at the first state with this force, N.
    pub until_n: f64,
    pub reads: Reads,
}

impl Course {
    /// Even steps to `limit_mm`, or until a force is met.
    pub(crate) fn until(until_n: f64, cells: Cells, reads: Reads, limit_mm: f64) -> Self {
        let count = (limit_mm / STEP_MAX_MM).ceil().max(STATES_MIN);
        Self { cells, depths_mm: steps_mm(limit_mm / count, limit_mm), until_n, reads }
    }
}

/// Largest distance of stored states, mm.
const STEP_MAX_MM: f64 = 0.25;
/// Fewest stored states on a way.
const STATES_MIN: f64 = 6.0;

impl Solution {
    /// From `folder`, or solved and written there.
    pub(crate) fn found_or_solved(
        press: &Press,
        course: &Course,
        folder: &Path,
    ) -> Result<Self, PeopleError> {
        let scene = press.scene(course.cells, course.depths_mm.last().copied().unwrap_or(1.0));
        let fingerprint =
            stored::fingerprint(&(&scene, course, READING, env!("CARGO_PKG_VERSION")))?;
        let path = folder.join(format!("{}-{}.json", press.name, &fingerprint[..8]));
        let found: Option<Self> = stored::read_json(&path)?;
        if let Some(found) = found.filter(|f| f.fingerprint == fingerprint) {
            return Ok(found);
        }
        let mut solution = Self { fingerprint, ..Self::default() };
        solution.solve(press, course, &scene)?;
        papilla_output::atomic::write_json(&path, &solution)?;
        Ok(solution)
    }

    fn solve(&mut self, press: &Press, course: &Course, scene: &Scene) -> Result<(), PeopleError> {
        let failed =
            |e: SimulationError| PeopleError::Press { press: press.name.clone(), source: e.into() };
        let begun_s = thread_s();
        let finger = &press.subject.shape;
        let touch = press.first_touch(&course.depths_mm)?;
        let mut body = body(scene, finger, course.cells, &touch).map_err(failed)?;
        body.read_at_nodes();
        self.unknowns = body.problem.system.dofs.count;
        let reader = Reader::new(course.reads, &press.name, finger, &body, touch.first)?;
        let rest_mm3 = body.problem.volume_mm3(&vec![[0.0; 3]; body.problem.mesh.nodes.len()]);
        let rotation = touch.start.rotation;
        let force = Cell::new(0.0);
        let at_end = Cell::new(false);
        let mut broken = None;
        let path = &mut self.path;
        let mut keep = |k: usize, solver: &Solver<'_>, record: &IncrementRecord, _: &StepReport| {
            if k == 0 {
                *path = ForcePath::default();
            }
            force.set(solver.force_along_path_n());
            at_end.set(contact::reaches(&body, solver, finger.length_mm - END_MM));
            path.push(record.depth_mm, force.get());
            let felt = reader.felt(solver, record).unwrap_or_else(|e| {
                broken = Some(e.to_string());
                Felt::new()
            });
            let touches = course.reads == Reads::Contact;
            let volume_mm3 = body.problem.volume_mm3(solver.displacement_mm());
            State {
                contact: if touches { contact::read(&body, solver, rotation) } else { None },
                volume_change_percent: 100.0 * (volume_mm3 / rest_mm3 - 1.0),
                felt,
                energy_vs_work: record.checks.energy_vs_work,
            }
        };
        let mut at_state =
            |_: &AtState<'_, State>| match force.get() >= course.until_n || at_end.get() {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            };
        let stoppable = Stoppable { from: None, at_state: &mut at_state };
        let mut solver = body.solver(Options::default()).map_err(failed)?;
        let (approach, drive) = (press.approach()?, Drive::Depths(course.depths_mm.clone()));
        let limit = BALANCE_RELATIVE_MAX;
        let pressed =
            body.press_stoppable(&mut solver, &approach, &drive, limit, &mut keep, stoppable);
        self.states = pressed.kept;
        if at_end.get() {
            self.states.pop();
            self.path.pop();
            broken = Some(format!(
                "the contact comes within {END_MM} mm of where the model of the finger ends"
            ));
        }
        if self.states.is_empty() {
            self.path = ForcePath::default();
        }
        self.ended = match pressed.pressed {
            Ok(()) | Err(SimulationError::Halted) => broken,
            Err(e) => Some(e.to_string()),
        };
        self.solve_s = thread_s() - begun_s;
        Ok(())
    }

    /// Largest |stored energy - work| over work.
    pub(crate) fn energy_vs_work_max(&self) -> f64 {
        self.states.iter().map(|s| s.energy_vs_work).fold(0.0, f64::max)
    }
}

/// A contact that comes so near to the plane where the finger is cut off leans on the cut, mm: people's
/// fingers go on there, and the model is held.
const END_MM: f64 = 0.5;

/// The finger, its cells, if any are split, for the very depths that are stored.
fn body(
    scene: &Scene,
    finger: &FingertipShape,
    cells: Cells,
    touch: &Contact,
) -> Result<Body, SimulationError> {
    let plan = scene.plan()?;
    let tissues = solids(&scene.materials, &plan)?;
    let touch = (cells.order == Order::Graded).then_some(touch);
    Body::fingertip(finger, tissues, cells.density, cells.order, plan.parts, touch)
}

/// Deepest that a force is looked for on a split mesh, of which all that may be touched is split, mm.
const LIMIT_SPLIT_MM: f64 = 4.25;
/// Deepest on an even one: a finger of Hertz' modulus .2 MPa has 10 N at 4.3 mm, one of .15 MPa at
/// 5.2 mm.
const LIMIT_EVEN_MM: f64 = 5.25;
/// How much deeper than the even mesh says a press on a split one may go, and how much deeper again if
/// that is not enough.
const BEYOND_EVEN: f64 = 1.04;
/// How much deeper than Hertz' guess a press may go at first.
const BEYOND_GUESS: f64 = 1.25;

/// A press until a force is met. The first try goes no deeper than Hertz' law for a soft finger, and each
/// further one twice as deep. Cells are split for all that may be touched: there the even mesh says how
/// deep that is, since a mesh that is split for thrice the depth is pressed thrice as long.
pub(crate) fn until(
    press: &Press,
    until_n: f64,
    cells: Cells,
    reads: Reads,
    folder: &Path,
) -> Result<Solution, PeopleError> {
    let is_split = cells.order == Order::Graded;
    let deepest_mm = if is_split { LIMIT_SPLIT_MM } else { LIMIT_EVEN_MM };
    let mut limit_mm = (BEYOND_GUESS * press.hertz_depth_mm(until_n)?).min(deepest_mm);
    if is_split {
        let way = until(press, until_n, Cells::COARSE, reads, folder)?;
        if way.path.reaches(until_n) || way.ended.is_some() {
            limit_mm = (BEYOND_EVEN * way.path.deepest().1).min(deepest_mm);
        }
    }
    loop {
        let course = Course::until(until_n, cells, reads, limit_mm);
        let found = Solution::found_or_solved(press, &course, folder)?;
        if found.path.reaches(until_n) || found.ended.is_some() || limit_mm >= deepest_mm {
            return Ok(found);
        }
        let further = if is_split { BEYOND_EVEN } else { 2.0 };
        limit_mm = (further * limit_mm).min(deepest_mm);
    }
}

/// How far past the last force the way goes: the denser mesh may be as much stiffer or softer.
const WAY_BEYOND: f64 = 1.02;

/// A press held at `forces_n`: a way on the coarse mesh tells the depths, states there on `density`
/// are solved. Their forces miss by what the meshes differ.
pub(crate) fn held_at(
    press: &Press,
    forces_n: &[f64],
    density: Density,
    reads: Reads,
    folder: &Path,
) -> Result<Solution, PeopleError> {
    let most_n = forces_n.last().copied().unwrap_or(0.0);
    let coarse = Cells::graded(Density::Coarse);
    let way = until(press, WAY_BEYOND * most_n, coarse, Reads::Force, folder)?;
    let depth = |&force_n: &f64| {
        way.path.depth_at(force_n).ok_or_else(|| {
            let (reached_n, depth_mm) = way.path.deepest();
            PeopleError::Force {
                press: press.name.clone(),
                wanted_n: force_n,
                reached_n,
                depth_mm,
                why: way.ended.clone(),
            }
        })
    };
    let depths_mm = forces_n.iter().map(depth).collect::<Result<_, _>>()?;
    let cells = Cells::graded(density);
    let course = Course { cells, depths_mm, until_n: f64::INFINITY, reads };
    let held = Solution::found_or_solved(press, &course, folder)?;
    if held.states.len() == forces_n.len() && held.ended.is_none() {
        return Ok(held);
    }
    let (reached_n, depth_mm) = held.path.deepest();
    let why = held.ended;
    Err(PeopleError::Force {
        press: press.name.clone(),
        wanted_n: most_n,
        reached_n,
        depth_mm,
        why,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::people::press::Materials;
    use papilla_sdf::{IndenterSpec, Plate};

    /// A pad that hardly rises towards the joint lies on a plate as far as the model goes: what presses
    /// there tells of the cut, not of a finger.
    #[test]
    fn a_press_ends_before_its_contact_leans_on_the_end_of_the_model() {
        let folder = tempfile::tempdir().unwrap();
        let pressed = |crease_depth_mm: f64| {
            let mut subject = Materials::NeoHookean.subject();
            subject.shape.crease_depth_mm = crease_depth_mm;
            let indenter = IndenterSpec::Plate(Plate { size_mm: [30.0, 30.0], ..Plate::default() });
            let press = Press { indenter, ..Press::plate(0.0, subject) };
            let course = Course::until(1e3, Cells::COARSE, Reads::Force, 1.2);
            Solution::found_or_solved(&press, &course, folder.path()).unwrap()
        };
        let usual = pressed(FingertipShape::default().crease_depth_mm);
        assert_eq!((usual.states.len(), usual.ended.as_deref()), (6, None));
        let flat = pressed(0.1);
        assert!(flat.states.len() < 6, "{:?}", flat.path);
        assert_eq!(flat.states.len(), flat.path.force_n.len());
        assert!(flat.ended.unwrap().contains("the model of the finger ends"));
    }
}
