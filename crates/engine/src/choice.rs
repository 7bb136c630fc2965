//! Which engine runs a model: the one that is named, or the faster one.

use crate::{Backend, Card, EngineError, MAP_LEN, Model, Session, load_with, trial_map};
use papilla_processor::thread_time;
use serde::{Serialize, Serializer};
use std::sync::Arc;
use std::time::{Duration, Instant};
use std::{fmt, str::FromStr};

impl Backend {
    /// Requires that this program can use the backend here. The first call opens the library.
    ///
    /// # Errors
    /// [`EngineError::BackendMissing`]: it was not built in, or its library is missing or too
    /// old; the reason says what to install.
    pub fn require(self) -> Result<(), EngineError> {
        match self {
            Self::Tract => Ok(()),
            #[cfg(feature = "ort")]
            Self::Ort => crate::ort_backend::environment().map(|_| ()),
            #[cfg(not(feature = "ort"))]
            Self::Ort => Err(not_built(self)),
        }
    }
}

#[cfg(not(feature = "ort"))]
pub(crate) fn not_built(backend: Backend) -> EngineError {
    let reason = "this program was built without the cargo feature 'ort'".to_owned();
    EngineError::BackendMissing { backend, reason }
}

/// Which backend is to run a model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Choice {
    /// The fastest of the available backends on this machine.
    #[default]
    Auto,
    /// This one.
    Only(Backend),
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Only(backend) => backend.fmt(f),
        }
    }
}

impl FromStr for Choice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            _ => {
                text.parse().map(Self::Only).map_err(|error: String| format!("{error}; or 'auto'"))
            }
        }
    }
}

impl Serialize for Choice {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// The fewest timed runs in each backend, however slow it is.
const RUNS_MIN: usize = 2;
/// The most timed runs in each backend.
const RUNS_MAX: usize = 50;
/// Greatest accepted difference between the answers of two backends, relative to the greatest
/// value. The shipped models differ by 1e-5 at most.
const DIFFERENCE_MAX: f32 = 1e-3;

impl Choice {
    /// Loads a model as [`load_with`] does. [`Choice::Auto`] times every available backend on this
    /// thread, in about `time` altogether, and keeps the faster one. It takes tract if `time` is
    /// zero, or if ONNX Runtime is missing, fails or answers differently.
    ///
    /// # Errors
    /// As [`load_with`]. With [`Choice::Auto`] only an error of tract is returned.
    pub fn load(
        self,
        onnx: &[u8],
        card: Option<&Card>,
        time: Duration,
    ) -> Result<Arc<dyn Model>, EngineError> {
        if let Self::Only(backend) = self {
            return load_with(backend, onnx, card);
        }
        let tract = load_with(Backend::Tract, onnx, card)?;
        if time.is_zero() || Backend::Ort.require().is_err() {
            return Ok(tract);
        }
        let model = tract.info().name.clone();
        let measured = load_with(Backend::Ort, onnx, card)
            .and_then(|ort| Ok((Race::run([tract.as_ref(), ort.as_ref()], time)?, ort)));
        let (race, ort) = match measured {
            Ok(measured) => measured,
            Err(error) => {
                tracing::warn!(model, %error, "tract runs this model");
                return Ok(tract);
            }
        };
        let [tract_us, ort_us] = race.least.map(|time| time.as_micros());
        if race.difference > DIFFERENCE_MAX {
            let difference = race.difference;
            tracing::warn!(
                model,
                difference,
                "ONNX Runtime answers otherwise; tract runs this model"
            );
            return Ok(tract);
        }
        let chosen = if race.least[1] < race.least[0] { ort } else { tract };
        tracing::info!(model, backend = chosen.info().backend, tract_us, ort_us, "backend chosen");
        Ok(chosen)
    }
}

/// A comparison of two models that run the same map alternately.
struct Race {
    /// Least processor time of each. The least is used since disturbances make a run slower, never
    /// faster.
    least: [Duration; 2],
    /// Greatest difference between the answers, relative to the greatest value.
    difference: f32,
}

impl Race {
    fn run(models: [&dyn Model; 2], time: Duration) -> Result<Self, EngineError> {
        let pressure_pa = trial_map(models[0].info().pressure_max_pa);
        let mut answers = [0, 1].map(|_| vec![0.0; MAP_LEN]);
        let mut sessions = Vec::with_capacity(models.len());
        for (model, answer) in models.into_iter().zip(&mut answers) {
            let mut session: Box<dyn Session> = model.session()?;
            session.infer(&pressure_pa, answer)?;
            sessions.push(session);
        }
        let mut least = [Duration::MAX; 2];
        let begun = Instant::now();
        for run in 0..RUNS_MAX {
            if run >= RUNS_MIN && begun.elapsed() > time {
                break;
            }
            for ((session, answer), least) in sessions.iter_mut().zip(&mut answers).zip(&mut least)
            {
                let start = thread_time();
                session.infer(&pressure_pa, answer)?;
                *least = thread_time().saturating_sub(start).min(*least);
            }
        }
        let [ours, theirs] = &answers;
        let greatest = ours.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
        let apart = ours.iter().zip(theirs).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        Ok(Self { least, difference: apart / greatest })
    }
}
