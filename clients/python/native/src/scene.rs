//! Finite elements in process: scenes, explained and solved state by state.

use std::{
    path::PathBuf,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
        mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel},
    },
    thread::JoinHandle,
    time::Duration,
};

use papilla_fem::solve::{Options, Solver};
use papilla_fingertip::{
    run::{BodyFields, Explanation, Increment, Pressed, doubts, press},
    scene::{Scene as Read, SceneError},
    simulation::{Simulation, maps::FingerMaps},
};
use pyo3::{buffer::PyBuffer, prelude::*};

use crate::{
    border::{compute, error, lock, panic_text, to_json},
    problem::{Problem, toml_of},
    state::{Found, State},
};

/// How often Ctrl-C is looked for.
const LOOK: Duration = Duration::from_millis(50);

/// A scene that was read and checked.
#[pyclass(frozen, module = "papilla._native")]
pub(crate) struct Scene {
    scene: Arc<Read>,
}

#[pymethods]
impl Scene {
    /// Reads the text of a scene, in TOML or, if `json` says so, as a JSON object; `path` is where it
    /// stands, or would stand. `pressure_pa` is a map of 224 x 224 that presses in place of an indenter.
    #[new]
    #[pyo3(signature = (path, text=None, json=false, pressure_pa=None))]
    fn new(
        py: Python<'_>,
        path: PathBuf,
        text: Option<String>,
        json: bool,
        pressure_pa: Option<PyBuffer<f32>>,
    ) -> PyResult<Self> {
        let map_pa = pressure_pa.map(|map| map.to_vec(py)).transpose()?.map(Arc::new);
        let read = move || -> Result<Read, Problem> {
            let text = match text {
                None => papilla_json::read_text(&path)
                    .map_err(|source| SceneError::Read { path: path.clone(), source })?,
                Some(text) if json => toml_of(&path, &text)?,
                Some(text) => text,
            };
            Ok(Read::parse_under(&path, text, map_pa)?)
        };
        let scene = compute(py, read)?.map_err(|problem| problem.raise(py, 0))?;
        Ok(Self { scene: Arc::new(scene) })
    }

    /// All of the scene, what was not named too, as JSON.
    fn json(&self, py: Python<'_>) -> PyResult<String> {
        to_json(py, &*self.scene)
    }

    /// What it is going to simulate and cost: as JSON, and for people.
    fn explain(&self, py: Python<'_>) -> PyResult<(String, String)> {
        let explained = compute(py, || Explanation::of(&self.scene))?;
        let explained = explained.map_err(|problem| Problem::from(problem).raise(py, 0))?;
        Ok((to_json(py, &explained)?, explained.human()))
    }

    /// Begins to solve it on a thread of its own; `fields` says whether states carry the fields of the
    /// whole body.
    fn solve(&self, fields: bool) -> Run {
        let (tell, told) = sync_channel(1);
        let stop = Arc::new(AtomicBool::new(false));
        let (scene, ends) = (Arc::clone(&self.scene), Arc::clone(&stop));
        let thread = std::thread::spawn(move || {
            let work = std::panic::AssertUnwindSafe(|| solve(&scene, fields, &ends, &tell));
            let last = match std::panic::catch_unwind(work) {
                Ok(Ok(())) => Told::End,
                Ok(Err(problem)) => Told::Failed(problem),
                Err(panic) => Told::Panicked(panic_text(panic.as_ref())),
            };
            // Nobody waits for it any more.
            drop(tell.send(last));
        });
        let thread = Mutex::new(Some(thread));
        Run {
            told: Mutex::new(told),
            stop,
            thread,
            states: Mutex::new(0),
            remarks: Mutex::default(),
        }
    }
}

/// What was done to meshes, and what may be a mistake.
#[derive(Clone, Default)]
struct Remarks {
    mended: Vec<String>,
    doubts: Vec<String>,
}

/// What the thread that solves tells of.
enum Told {
    /// How many states are going to be stored, and what a person should know of the scene.
    SetUp(usize, Remarks),
    State(Box<Found>),
    End,
    Failed(Problem),
    Panicked(String),
}

fn solve(
    scene: &Read,
    fields: bool,
    stop: &Arc<AtomicBool>,
    tell: &SyncSender<Told>,
) -> Result<(), Problem> {
    let mut setup = Simulation::new(scene)?;
    let mended = setup.approach.shape.mended();
    let remarks = Remarks { mended, doubts: doubts(scene, &setup)? };
    let maps = FingerMaps::new(&mut setup.body)?;
    let setup = Arc::new(setup);
    let mut solver = setup.body.solver(Options::default())?;
    solver.stop_when(Some(Arc::clone(stop)));
    if tell.send(Told::SetUp(setup.drive.len(), remarks)).is_err() {
        return Ok(());
    }
    let mut drawn = Ok(());
    let visit = &mut |number: usize, solver: &Solver<'_>, pressed: &Pressed| {
        let records = std::slice::from_ref(&pressed.record);
        let maps_of = maps.as_ref().map_or(Ok(Vec::new()), |maps| maps.drawn(records));
        let told = match maps_of {
            Ok(drawn) => {
                let body =
                    fields.then(|| (Arc::clone(&setup), BodyFields::new(&setup.body, solver)));
                let increment = Increment::of(pressed, maps.as_ref());
                let state = Found { number, increment, maps: drawn, body };
                tell.send(Told::State(Box::new(state))).is_ok()
            }
            Err(problem) => {
                drawn = Err(problem);
                false
            }
        };
        if !told {
            stop.store(true, Ordering::Relaxed);
        }
    };
    let (_, solved) = press(&setup, &mut solver, visit);
    drawn?;
    Ok(solved?)
}

/// States of a scene as they are found.
#[pyclass(frozen, module = "papilla._native")]
pub(crate) struct Run {
    told: Mutex<Receiver<Told>>,
    stop: Arc<AtomicBool>,
    thread: Mutex<Option<JoinHandle<()>>>,
    /// Found so far.
    states: Mutex<usize>,
    remarks: Mutex<Remarks>,
}

#[pymethods]
impl Run {
    /// The next state, how many states are going to be stored before the first, or None at the end.
    ///
    /// Raises BadScene and NotSolved; Ctrl-C ends the solve.
    fn next(&self, py: Python<'_>) -> PyResult<Option<(usize, Option<State>)>> {
        loop {
            let told = py.detach(|| lock(&self.told).recv_timeout(LOOK));
            match told {
                Ok(Told::SetUp(count, remarks)) => {
                    *lock(&self.remarks) = remarks;
                    return Ok(Some((count, None)));
                }
                Ok(Told::State(found)) => {
                    *lock(&self.states) = found.number + 1;
                    return Ok(Some((found.number, Some(State::new(*found)))));
                }
                Ok(Told::End) | Err(RecvTimeoutError::Disconnected) => return Ok(None),
                Ok(Told::Failed(problem)) => return Err(problem.raise(py, *lock(&self.states))),
                Ok(Told::Panicked(text)) => return Err(error(py, "NativeFault", (text,))),
                Err(RecvTimeoutError::Timeout) => {
                    if let Err(interrupt) = py.check_signals() {
                        self.stop.store(true, Ordering::Relaxed);
                        return Err(interrupt);
                    }
                }
            }
        }
    }

    /// What was done to meshes, and what may be a mistake; known once states are counted.
    fn remarks(&self) -> (Vec<String>, Vec<String>) {
        let Remarks { mended, doubts } = lock(&self.remarks).clone();
        (mended, doubts)
    }

    /// Ends the solve within an iteration, and waits for that.
    fn close(&self, py: Python<'_>) {
        self.stop.store(true, Ordering::Relaxed);
        py.detach(|| {
            let Some(thread) = lock(&self.thread).take() else { return };
            // What waits to be told is not wanted any more.
            while !thread.is_finished() {
                drop(lock(&self.told).recv_timeout(LOOK));
            }
            // A panic has been told of.
            drop(thread.join());
        });
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        // Its next word finds nobody.
        self.stop.store(true, Ordering::Relaxed);
    }
}
