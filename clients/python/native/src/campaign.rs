//! Campaigns in process: many simulations, explained and solved into a dataset.

use std::{
    num::NonZero,
    path::PathBuf,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
        mpsc::{Receiver, RecvTimeoutError, sync_channel},
    },
    time::Duration,
};

use papilla_campaign::{CampaignCost, CampaignError, Count, Generated, RunOptions, generate};
use papilla_fingertip::campaign::{CampaignSpec, Slice, SpecError};
use pyo3::prelude::*;

use crate::{
    border::{compute, error, lock, panic_text, to_json},
    problem::{Problem, toml_of},
};

/// How long Python is kept from what it has to do besides, such as heeding Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

fn bad_spec(py: Python<'_>, problem: &SpecError) -> PyErr {
    let field = match problem {
        SpecError::Value { field, .. } => Some(field.clone()),
        SpecError::Finger { .. } => Some("finger".to_owned()),
        SpecError::Scene { source, .. } => source.field(),
        SpecError::Read { .. } | SpecError::Spec { .. } => None,
    };
    error(py, "BadScene", (papilla_output::told(problem), field, None::<usize>))
}

/// `BadScene` of a campaign that cannot be, `NotSolved` of one that came to nothing, `BadDataset` of
/// its folder.
fn raised(py: Python<'_>, problem: CampaignError) -> PyErr {
    let told = papilla_output::told(&problem);
    match problem {
        CampaignError::Spec(problem) => bad_spec(py, &problem),
        CampaignError::SetUp(problem) => Problem::from(problem).raise(py, 0),
        CampaignError::Lacks(_) | CampaignError::Simulation(_) => {
            error(py, "BadScene", (told, None::<String>, None::<usize>))
        }
        CampaignError::NothingSolved { .. } => error(py, "NotSolved", (told, "nothing_solved")),
        CampaignError::Occupied { .. }
        | CampaignError::NotBegun { .. }
        | CampaignError::Holes { .. }
        | CampaignError::Output(_)
        | CampaignError::Dataset(_) => error(py, "BadDataset", (told,)),
    }
}

/// A campaign that was read and checked.
#[pyclass(frozen, module = "papilla._native")]
pub(crate) struct Campaign {
    spec: Arc<CampaignSpec>,
}

#[pymethods]
impl Campaign {
    /// Reads the text of a campaign, in TOML or, if `json` says so, as a JSON object; `path` is where it
    /// stands, or would stand.
    #[new]
    #[pyo3(signature = (path, text=None, json=false))]
    fn new(py: Python<'_>, path: PathBuf, text: Option<String>, json: bool) -> PyResult<Self> {
        let read = move || -> Result<CampaignSpec, SpecError> {
            let spec = |message: String| SpecError::Spec { path: path.clone(), message };
            match text {
                None => CampaignSpec::read(&path),
                Some(text) if json => {
                    let text = toml_of(&path, &text).map_err(|error| spec(error.to_string()))?;
                    CampaignSpec::parse(&path, &text)
                }
                Some(text) => CampaignSpec::parse(&path, &text),
            }
        };
        let spec = compute(py, read)?.map_err(|problem| bad_spec(py, &problem))?;
        Ok(Self { spec: Arc::new(spec) })
    }

    /// All of the campaign, as manifests hold it, as JSON.
    fn json(&self, py: Python<'_>) -> PyResult<String> {
        to_json(py, &*self.spec)
    }

    /// What it is going to cost: as JSON, and for people.
    fn explain(&self, py: Python<'_>) -> PyResult<(String, String)> {
        let cost = compute(py, || CampaignCost::of(&self.spec))?;
        let cost = cost.map_err(|problem| Problem::from(problem).raise(py, 0))?;
        Ok((to_json(py, &cost)?, cost.human()))
    }

    /// Begins to solve it into a folder, or goes on there, on a thread of its own.
    #[pyo3(signature = (folder, threads, slice, retry_failed))]
    fn run(
        &self,
        py: Python<'_>,
        folder: PathBuf,
        threads: Option<NonZero<usize>>,
        slice: (usize, usize),
        retry_failed: bool,
    ) -> PyResult<CampaignRun> {
        let slice = Slice::new(slice.0, slice.1)
            .map_err(|problem| error(py, "BadInput", ("slice", problem.to_string())))?;
        let (stop, count) = <(Arc<AtomicBool>, Arc<Count>)>::default();
        let options = RunOptions {
            slice,
            threads,
            retry_failed,
            progress: false,
            stop: Arc::clone(&stop),
            count: Arc::clone(&count),
            ..RunOptions::default()
        };
        let (tell, told) = sync_channel(1);
        let spec = Arc::clone(&self.spec);
        std::thread::spawn(move || {
            let work = std::panic::AssertUnwindSafe(|| generate(&spec, &folder, &options));
            let ended = match std::panic::catch_unwind(work) {
                Ok(Ok(generated)) => Ended::Done(Box::new(generated)),
                Ok(Err(problem)) => Ended::Failed(Box::new(problem)),
                Err(panic) => Ended::Panicked(panic_text(panic.as_ref())),
            };
            // Nobody may wait for it any more.
            drop(tell.send(ended));
        });
        Ok(CampaignRun { told: Mutex::new(told), stop, count })
    }
}

/// How a run ended.
enum Ended {
    Done(Box<Generated>),
    Failed(Box<CampaignError>),
    Panicked(String),
}

/// A campaign that is being solved.
#[pyclass(frozen, module = "papilla._native")]
pub(crate) struct CampaignRun {
    told: Mutex<Receiver<Ended>>,
    stop: Arc<AtomicBool>,
    count: Arc<Count>,
}

#[pymethods]
impl CampaignRun {
    /// What came of it, as JSON and for people; None if it has not ended after a twentieth of a second.
    ///
    /// Raises BadScene, NotSolved and BadDataset.
    fn wait(&self, py: Python<'_>) -> PyResult<Option<(String, String)>> {
        match py.detach(|| lock(&self.told).recv_timeout(LOOK)) {
            Ok(Ended::Done(generated)) => Ok(Some((to_json(py, &generated)?, generated.human()))),
            Ok(Ended::Failed(problem)) => Err(raised(py, *problem)),
            Ok(Ended::Panicked(text)) => Err(error(py, "NativeFault", (text,))),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => {
                Err(error(py, "NativeFault", ("the campaign's thread is gone".to_owned(),)))
            }
        }
    }

    /// Indentations in all, those that are solved or failed, and those that failed.
    fn counts(&self) -> (usize, usize, usize) {
        (self.count.due(), self.count.done(), self.count.failed())
    }

    /// Lets each indentation be stored at its next depth, and the run end.
    fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

impl Drop for CampaignRun {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}
