//! Contact in process: where things are in, what pushes back out.

use std::{
    path::PathBuf,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use papilla_inside::{Bundle, Contact as Inside, Problem, Solved, read_hello};
use pyo3::{buffer::PyBuffer, prelude::*, types::PyByteArray};
use serde_json::json;

use crate::border::{bad_models, compute, error, lock, refused};

/// How often Ctrl-C is looked for.
const LOOK: Duration = Duration::from_millis(50);

/// A finger's folder, read once.
#[pyclass(frozen, module = "papilla._native")]
pub(crate) struct Finger {
    bundle: Arc<Bundle>,
}

#[pymethods]
impl Finger {
    /// Reads the atlas and the contact model of a folder.
    #[new]
    fn new(py: Python<'_>, folder: PathBuf) -> PyResult<Self> {
        let bundle = compute(py, move || Bundle::load(&folder))?;
        let bundle = bundle.map_err(|problem| bad_models(py, &problem))?;
        Ok(Self { bundle: Arc::new(bundle) })
    }

    /// Hash of the atlas.
    #[getter]
    fn atlas_hash(&self) -> &str {
        self.bundle.atlas.hash()
    }

    /// Vertices of the skin.
    #[getter]
    fn vertices(&self) -> usize {
        self.bundle.atlas.vertex_count()
    }

    /// Contact on the terms of a hello, as JSON.
    fn contact(&self, py: Python<'_>, hello: &str) -> PyResult<Contact> {
        let opened = compute(py, || Inside::open(&self.bundle, &read_hello(hello)?))?;
        let inside = opened.map_err(|problem| refused(py, &problem))?;
        let told = json!({
            "method": inside.method(),
            "expected_error": inside.expected_error(),
            "warnings": inside.warnings(),
            "samples": inside.samples(),
            "sections": inside.sections(),
            "sections_len": inside.sections_len(),
        });
        Ok(Contact {
            told: told.to_string(),
            state: Mutex::new(Some(inside)),
            stop: AtomicBool::new(false),
        })
    }
}

/// A finger that is touched, and what it remembers. Frames of several threads are solved one after
/// the other.
#[pyclass(frozen, module = "papilla._native")]
pub(crate) struct Contact {
    told: String,
    /// None once a panic has left it half done.
    state: Mutex<Option<Inside>>,
    stop: AtomicBool,
}

/// Sections of all frames one behind the other, their flags, and their rounds.
type Found<'py> = (Bound<'py, PyByteArray>, Vec<u8>, Vec<u32>);

/// Why frames came to an end.
enum Ended {
    /// The frame of this number cannot be.
    Frame(usize, Problem),
    /// Ctrl-C, or whatever a handler of signals raised.
    Python(PyErr),
}

#[pymethods]
impl Contact {
    /// What was agreed to, as JSON.
    fn told(&self) -> &str {
        &self.told
    }

    /// Solves frames one after the other; `samples` holds all of them, `times_us` a time of each.
    ///
    /// Raises Refused for a single frame, FrameFailed for one of several; Ctrl-C ends it.
    fn frames<'py>(
        &self,
        py: Python<'py>,
        samples: PyBuffer<u8>,
        times_us: Vec<u64>,
    ) -> PyResult<Found<'py>> {
        let mut payload = vec![0; samples.item_count()];
        samples.copy_to_slice(py, &mut payload)?;
        drop(samples);
        let many = times_us.len() > 1;
        self.solve(py, many, times_us.len(), move |inside, number| {
            let bytes = 4 * inside.samples();
            let frame = payload.get(number * bytes..(number + 1) * bytes).unwrap_or_default();
            inside.solve(frame, times_us[number])
        })
    }

    /// In place of a frame where nobody knows where things are.
    fn lost<'py>(&self, py: Python<'py>) -> PyResult<Found<'py>> {
        self.solve(py, false, 1, |inside, _| inside.lose())
    }

    /// Ends what another thread solves, after the frame at hand.
    fn halt(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

impl Contact {
    fn solve<'py>(
        &self,
        py: Python<'py>,
        many: bool,
        frames: usize,
        frame: impl Fn(&mut Inside, usize) -> Result<Solved, Problem> + Send + Sync,
    ) -> PyResult<Found<'py>> {
        let fault = || error(py, "NativeFault", ("a fault before has left this finger half done",));
        self.stop.store(false, Ordering::Relaxed);
        let work = || {
            let mut held = lock(&self.state);
            // Taken out, so that a panic leaves none.
            let Some(mut inside) = held.take() else { return Ok(None) };
            let (mut bytes, mut flags, mut rounds) = (Vec::new(), Vec::new(), Vec::new());
            bytes.reserve(frames * inside.sections_len());
            let mut looked = Instant::now();
            let mut ended = None;
            for number in 0..frames {
                if looked.elapsed() > LOOK {
                    looked = Instant::now();
                    if let Err(interrupt) = Python::attach(|py| py.check_signals()) {
                        ended = Some(Ended::Python(interrupt));
                        break;
                    }
                    if self.stop.load(Ordering::Relaxed) {
                        let problem = Problem::new(papilla_proto::ErrorCode::Internal, "halted");
                        ended = Some(Ended::Frame(number, problem));
                        break;
                    }
                }
                match frame(&mut inside, number) {
                    Ok(solved) => {
                        bytes.extend_from_slice(inside.bytes());
                        flags.push(solved.flags);
                        rounds.push(solved.rounds);
                    }
                    Err(problem) => {
                        ended = Some(Ended::Frame(number, problem));
                        break;
                    }
                }
            }
            *held = Some(inside);
            ended.map_or(Ok(Some((bytes, flags, rounds))), Err)
        };
        match compute(py, work)? {
            Ok(Some((bytes, flags, rounds))) => Ok((PyByteArray::new(py, &bytes), flags, rounds)),
            Ok(None) => Err(fault()),
            Err(Ended::Python(interrupt)) => Err(interrupt),
            Err(Ended::Frame(number, problem)) if many => {
                let place =
                    problem.field.map_or_else(String::new, |field| format!(" (in '{field}')"));
                let reason = format!("{}{place}", problem.message);
                Err(error(py, "FrameFailed", (number, "error", reason)))
            }
            Err(Ended::Frame(_, problem)) => Err(refused(py, &problem)),
        }
    }
}
