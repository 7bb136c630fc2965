//! A folder of models, and SED of maps.

use std::{
    path::PathBuf,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, AtomicU8, AtomicUsize, Ordering},
        mpsc::{RecvTimeoutError, channel},
    },
    thread,
    time::Duration,
};

use papilla_inside::{Frame, Model, Network, Problem, Session as Inside, read_hello};
use papilla_proto::{MAP_LEN, contact::Input};
use pyo3::{buffer::PyBuffer, prelude::*};

use crate::{
    border::{bad_models, compute, error, lock, refused},
    session::Session,
};

/// How often Ctrl-C is looked for.
const LOOK: Duration = Duration::from_millis(50);

/// The networks of a folder for clients who name none, or the one named, with atlas and contact model,
/// read once; sessions share them.
#[pyclass(frozen, module = "papilla._native")]
pub(crate) struct Models {
    model: Arc<Model>,
    /// Sessions that render bare maps, kept from call to call.
    idle: Mutex<Vec<Inside>>,
}

#[pymethods]
impl Models {
    /// Reads a network of a folder and a contact model. Without a name these are the index's default and
    /// its default for pressure.
    #[new]
    #[pyo3(signature = (folder, tier=None, contact=None))]
    fn new(
        py: Python<'_>,
        folder: PathBuf,
        tier: Option<String>,
        contact: Option<PathBuf>,
    ) -> PyResult<Self> {
        let load = move || Model::load(&folder, tier.as_deref(), contact.as_deref());
        let model = compute(py, load)?.map_err(|problem| bad_models(py, &problem))?;
        Ok(Self { model: Arc::new(model), idle: Mutex::default() })
    }

    /// Name of the network for maps of pressure.
    #[getter]
    fn name(&self) -> &str {
        &self.for_pressure().card.name
    }

    /// Names of the networks that were loaded, each once: for poses and gaps, and for pressure.
    #[getter]
    fn names(&self) -> Vec<String> {
        self.model.networks().map(|of| of.card.name.clone()).collect()
    }

    /// Hash of the atlas.
    #[getter]
    fn atlas_hash(&self) -> &str {
        self.model.bundle.atlas.hash()
    }

    /// Greatest pressure that the network for maps of pressure was trained on, Pa.
    #[getter]
    fn pressure_max_pa(&self) -> f32 {
        self.for_pressure().model.info().pressure_max_pa
    }

    /// Whether pressure can be found from poses and gaps.
    #[getter]
    fn has_contact(&self) -> bool {
        self.model.bundle.contact.is_some()
    }

    /// The card of the network for maps of pressure, as JSON.
    fn card(&self, py: Python<'_>) -> PyResult<String> {
        let text = self.for_pressure().card.to_json();
        text.map_err(|problem| error(py, "NativeFault", (problem.to_string(),)))
    }

    /// A session on the terms of a hello, as JSON, with the models of the fingers that it may name.
    fn session(
        &self,
        py: Python<'_>,
        hello: &str,
        fingers: Vec<(String, Bound<'_, Self>)>,
    ) -> PyResult<Session> {
        let model_of =
            |(name, models): (String, Bound<'_, Self>)| (name, models.get().model.clone());
        let named: Vec<_> = fingers.into_iter().map(model_of).collect();
        let opened = compute(py, || {
            let hello = read_hello(hello)?;
            Inside::open_each(&self.model, &named, &hello)
        })?;
        opened.map(Session::new).map_err(|problem| refused(py, &problem))
    }

    /// Renders maps of pressure into as many maps of SED, on threads, and gives their flags.
    ///
    /// Each is 224 x 224 float32. Raises BadInput with the place of a map that cannot be.
    fn sed(
        &self,
        py: Python<'_>,
        pressure_pa: Vec<PyBuffer<f32>>,
        sed_j_per_m3: Vec<PyBuffer<f32>>,
        threads: usize,
    ) -> PyResult<Vec<u8>> {
        let is_map = |buffer: &PyBuffer<f32>| buffer.item_count() == MAP_LEN;
        let both = pressure_pa.iter().chain(&sed_j_per_m3);
        if pressure_pa.len() != sed_j_per_m3.len() || !both.into_iter().all(is_map) {
            let message = "as many maps of 224 x 224 are due for SED as come";
            return Err(error(py, "BadInput", ("pressure_pa", message)));
        }
        let maps = pressure_pa.len();
        let batch = Batch {
            models: self,
            pressure_pa,
            sed_j_per_m3,
            flags: (0..maps).map(|_| AtomicU8::new(0)).collect(),
            next: AtomicUsize::new(0),
            stop: AtomicBool::new(false),
        };
        match compute(py, || batch.render(threads.clamp(1, maps.max(1))))?? {
            None => Ok(batch.flags.into_iter().map(AtomicU8::into_inner).collect()),
            Some(Failed::Python(problem)) => Err(problem),
            Some(Failed::Map(map, problem)) => {
                Err(error(py, "BadInput", ("pressure_pa", problem.message, Some(map))))
            }
        }
    }
}

impl Models {
    fn for_pressure(&self) -> &Network {
        self.model.network_for(Input::Pressure)
    }
}

/// Maps that threads take one after the other.
struct Batch<'a> {
    models: &'a Models,
    pressure_pa: Vec<PyBuffer<f32>>,
    sed_j_per_m3: Vec<PyBuffer<f32>>,
    flags: Vec<AtomicU8>,
    next: AtomicUsize,
    stop: AtomicBool,
}

/// Why a batch came to an end.
enum Failed {
    /// A map that cannot be rendered, by its place.
    Map(usize, Problem),
    /// A buffer that cannot be read or written.
    Python(PyErr),
}

impl Batch<'_> {
    /// Renders all; the caller's thread waits, and looks for Ctrl-C.
    fn render(&self, threads: usize) -> PyResult<Option<Failed>> {
        let (tell, told) = channel();
        thread::scope(|scope| {
            for _ in 0..threads {
                let tell = tell.clone();
                scope.spawn(move || tell.send(self.work()));
            }
            drop(tell);
            let (mut interrupted, mut failed) = (Ok(()), None);
            loop {
                match told.recv_timeout(LOOK) {
                    Ok(None) => {}
                    Ok(Some(found)) => {
                        self.stop.store(true, Ordering::Relaxed);
                        failed = Some(found);
                    }
                    Err(RecvTimeoutError::Timeout) if interrupted.is_ok() => {
                        interrupted = Python::attach(|py| py.check_signals());
                        if interrupted.is_err() {
                            self.stop.store(true, Ordering::Relaxed);
                        }
                    }
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => break,
                }
            }
            interrupted.map(|()| failed)
        })
    }

    /// Renders the next maps until there are none.
    fn work(&self) -> Option<Failed> {
        let idle = lock(&self.models.idle).pop();
        let mut session = match idle.map_or_else(|| self.open(), Ok) {
            Ok(session) => session,
            Err(problem) => return Some(Failed::Map(0, problem)),
        };
        let mut pressure_pa = vec![0.0; MAP_LEN];
        while !self.stop.load(Ordering::Relaxed) {
            let map = self.next.fetch_add(1, Ordering::Relaxed);
            let Some(from) = self.pressure_pa.get(map) else { break };
            let read = Python::attach(|py| from.copy_to_slice(py, &mut pressure_pa));
            if let Err(problem) = read {
                return Some(Failed::Python(problem));
            }
            let made = match session.render(0, Frame::Map(&pressure_pa), 0) {
                Ok(made) => made,
                Err(problem) => return Some(Failed::Map(map, problem)),
            };
            self.flags[map].store(made.flags, Ordering::Relaxed);
            let sed_j_per_m3 = session.sed_j_per_m3();
            let written =
                Python::attach(|py| self.sed_j_per_m3[map].copy_from_slice(py, sed_j_per_m3));
            if let Err(problem) = written {
                return Some(Failed::Python(problem));
            }
        }
        lock(&self.models.idle).push(session);
        None
    }

    fn open(&self) -> Result<Inside, Problem> {
        Inside::open(&self.models.model, &read_hello(r#"{"type": "hello"}"#)?)
    }
}
