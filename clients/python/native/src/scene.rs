//! Finite elements in process: scenes, explained and solved state by state.

use std::{
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
        mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel},
    },
    thread::JoinHandle,
    time::Duration,
};

use papilla_fem::{
    mesh::Mesh,
    solve::{Options, SolveError, Solver},
};
use papilla_fingertip::{
    run::{BodyFields, Explanation, Increment, Pressed, cells, press, write_vtu},
    scene::{Scene as Read, SceneError},
    simulation::{
        Simulation,
        body::SimulationError,
        maps::{FingerMaps, MapError},
    },
};
use pyo3::{
    buffer::PyBuffer,
    prelude::*,
    types::{PyBytes, PyDict},
};

use crate::border::{compute, error, lock};

/// How often Ctrl-C is looked for.
const LOOK: Duration = Duration::from_millis(50);

/// Why a scene came to no state.
enum Problem {
    Scene(SceneError),
    Simulation(SimulationError),
    Maps(MapError),
}

impl From<SceneError> for Problem {
    fn from(error: SceneError) -> Self {
        Self::Scene(error)
    }
}

impl From<SimulationError> for Problem {
    fn from(error: SimulationError) -> Self {
        Self::Simulation(error)
    }
}

impl From<MapError> for Problem {
    fn from(error: MapError) -> Self {
        Self::Maps(error)
    }
}

/// What Python is told of a scene that cannot be.
struct Fault {
    field: Option<String>,
    line: Option<usize>,
}

impl Problem {
    fn message(&self) -> String {
        match self {
            Self::Scene(error) => papilla_output::told(error),
            Self::Simulation(error) => papilla_output::told(error),
            Self::Maps(error) => papilla_output::told(error),
        }
    }

    /// Where in the scene the fault is; none of what failed while it was solved.
    fn fault(&self) -> Fault {
        match self {
            Self::Scene(error) => {
                let line = match error {
                    SceneError::Located(located) => Some(located.place.line),
                    _ => None,
                };
                Fault { field: error.field(), line }
            }
            Self::Simulation(error) => {
                let line = match error {
                    SimulationError::Located(located) => Some(located.place.line),
                    _ => None,
                };
                Fault { field: error.field(), line }
            }
            Self::Maps(_) => Fault { field: None, line: None },
        }
    }

    /// The exception: `NotSolved` of what found no equilibrium, `BadScene` of all else.
    fn raise(&self, py: Python<'_>, states: usize) -> PyErr {
        let message = self.message();
        if let Self::Simulation(found) = self
            && let Some((kind, depth_mm, reached)) = unsolved(found)
        {
            return error(py, "NotSolved", (message, kind, depth_mm, reached, states));
        }
        let Fault { field, line } = self.fault();
        error(py, "BadScene", (message, field, line))
    }
}

/// Kind, depth aimed at and load fraction reached of what found no equilibrium.
fn unsolved(error: &SimulationError) -> Option<(&'static str, Option<f64>, Option<f64>)> {
    match error {
        SimulationError::Located(located) => unsolved(&located.error),
        SimulationError::Solve { depth_mm, source } => {
            let (kind, reached) = match source {
                SolveError::CutsExhausted { reached, .. } => ("no_equilibrium", Some(*reached)),
                SolveError::StepsExhausted { reached, .. } => ("too_many_steps", Some(*reached)),
                SolveError::Stopped { reached } => ("stopped", Some(*reached)),
                SolveError::Factor(_) => ("too_large", None),
                SolveError::RigidBodyMode(_) => ("free_part", None),
            };
            Some((kind, Some(*depth_mm), reached))
        }
        SimulationError::Share { share, source } => {
            let at = SimulationError::Solve { depth_mm: 0.0, source: source.clone() };
            unsolved(&at).map(|(kind, _, reached)| (kind, None, reached.or(Some(*share))))
        }
        SimulationError::Slipped { depth_mm, .. } => Some(("slipped", Some(*depth_mm), None)),
        SimulationError::Force { .. } => Some(("force_not_reached", None, None)),
        SimulationError::Inverted(_) => Some(("inverted", None, None)),
        SimulationError::Halted => Some(("stopped", None, None)),
        _ => None,
    }
}

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
                Err(panic) => {
                    let text = panic.downcast_ref::<String>().cloned();
                    let short = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
                    Told::Panicked(text.or(short).unwrap_or_else(|| "no message".to_owned()))
                }
            };
            // Nobody waits for it any more.
            drop(tell.send(last));
        });
        let thread = Mutex::new(Some(thread));
        Run { told: Mutex::new(told), stop, thread, states: Mutex::new(0) }
    }
}

fn to_json(py: Python<'_>, value: &impl serde::Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(|e| error(py, "NativeFault", (e.to_string(),)))
}

/// The TOML of a JSON object; what is null was not named.
fn toml_of(path: &Path, json: &str) -> Result<String, Problem> {
    fn without_null(value: &mut serde_json::Value) {
        match value {
            serde_json::Value::Object(members) => {
                members.retain(|_, member| !member.is_null());
                members.values_mut().for_each(without_null);
            }
            serde_json::Value::Array(items) => items.iter_mut().for_each(without_null),
            _ => {}
        }
    }
    let incomplete = |message: String| SceneError::Incomplete { path: path.into(), message };
    let mut value: serde_json::Value =
        serde_json::from_str(json).map_err(|e| incomplete(e.to_string()))?;
    without_null(&mut value);
    Ok(toml::to_string(&value).map_err(|e| incomplete(e.to_string()))?)
}

/// What the thread that solves tells of.
enum Told {
    /// How many states are going to be stored.
    States(usize),
    State(Box<Found>),
    End,
    Failed(Problem),
    Panicked(String),
}

/// A state, ready for Python.
struct Found {
    number: usize,
    increment: Increment,
    maps: Vec<(&'static str, Vec<f32>)>,
    body: Option<(Arc<Simulation>, BodyFields)>,
}

fn solve(
    scene: &Read,
    fields: bool,
    stop: &Arc<AtomicBool>,
    tell: &SyncSender<Told>,
) -> Result<(), Problem> {
    let mut setup = Simulation::new(scene)?;
    let maps = FingerMaps::new(&mut setup.body)?;
    let setup = Arc::new(setup);
    let mut solver = setup.body.solver(Options::default())?;
    solver.stop_when(Some(Arc::clone(stop)));
    if tell.send(Told::States(setup.drive.len())).is_err() {
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
                Ok(Told::States(count)) => return Ok(Some((count, None))),
                Ok(Told::State(found)) => {
                    *lock(&self.states) = found.number + 1;
                    return Ok(Some((found.number, Some(State { found: *found }))));
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

/// One equilibrium.
#[pyclass(frozen, module = "papilla._native")]
pub(crate) struct State {
    found: Found,
}

fn bytes_of<'py, T: Copy, const N: usize>(
    py: Python<'py>,
    values: &[T],
    bytes: impl Fn(T) -> [u8; N],
) -> PyResult<Bound<'py, PyBytes>> {
    PyBytes::new_with(py, N * values.len(), |room| {
        for (to, value) in room.chunks_exact_mut(N).zip(values) {
            to.copy_from_slice(&bytes(*value));
        }
        Ok(())
    })
}

fn doubles<'py>(py: Python<'py>, values: &[f64]) -> PyResult<Bound<'py, PyBytes>> {
    bytes_of(py, values, f64::to_le_bytes)
}

#[pymethods]
impl State {
    /// What `summary.json` says of it, as JSON.
    fn summary(&self, py: Python<'_>) -> PyResult<String> {
        to_json(py, &self.found.increment)
    }

    /// Maps by name, float32, one or three of 224 x 224; empty of what has no atlas.
    fn maps<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let maps = PyDict::new(py);
        for (name, pixels) in &self.found.maps {
            maps.set_item(name, bytes_of(py, pixels, f32::to_le_bytes)?)?;
        }
        Ok(maps)
    }

    /// Fields of the nodes by name, float64; empty if they were not asked for.
    fn nodes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let nodes = PyDict::new(py);
        let Some((setup, fields)) = &self.found.body else { return Ok(nodes) };
        let mesh: &Mesh = &setup.body.problem.mesh;
        let BodyFields { displacement_mm, pressure_pa, fluid_pressure_pa, elements } = fields;
        let fields = [
            ("places_mm", mesh.nodes.as_flattened()),
            ("displacement_mm", displacement_mm.as_flattened()),
            ("pressure_pa", pressure_pa),
            ("fluid_pressure_pa", fluid_pressure_pa),
            ("stress_pa", elements.node_stress_pa.as_flattened()),
            ("strain", elements.node_strain.as_flattened()),
        ];
        for (name, values) in fields.into_iter().filter(|(_, values)| !values.is_empty()) {
            nodes.set_item(name, doubles(py, values)?)?;
        }
        Ok(nodes)
    }

    /// Fields of the cells by name, float64, but for the layer, int32, and `connectivity` and
    /// `offsets`, int64; empty if they were not asked for.
    fn cells<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let found = PyDict::new(py);
        let Some((setup, fields)) = &self.found.body else { return Ok(found) };
        let elements = &fields.elements;
        let (connectivity, offsets, types) = cells(&setup.body.problem.mesh);
        let whole = |value: usize| (value as i64).to_le_bytes();
        found.set_item("connectivity", bytes_of(py, &connectivity, whole)?)?;
        found.set_item("offsets", bytes_of(py, &offsets, whole)?)?;
        found.set_item("types", PyBytes::new(py, &types))?;
        found.set_item("layer", bytes_of(py, &elements.layer, i32::to_le_bytes)?)?;
        let fields = [
            ("sed_j_per_m3", &elements.sed_j_per_m3[..]),
            ("volume_ratio", &elements.volume_ratio[..]),
            ("stress_pa", elements.stress_pa.as_flattened()),
            ("strain", elements.strain.as_flattened()),
        ];
        for (name, values) in fields {
            found.set_item(name, doubles(py, values)?)?;
        }
        Ok(found)
    }

    /// Writes the body as a file for ParaView.
    fn write_vtu(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let Some((setup, fields)) = &self.found.body else {
            let message = "the state has no fields: solve(fields=True) keeps them";
            return Err(error(py, "BadInput", ("path", message)));
        };
        let written = compute(py, move || write_vtu(&path, &setup.body.problem.mesh, fields))?;
        written.map_err(|e| pyo3::exceptions::PyOSError::new_err(papilla_output::told(&e)))
    }
}
