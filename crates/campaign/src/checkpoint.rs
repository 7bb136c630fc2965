//! Checkpoints: how far a simulation has come, stored so that another process can go on with it.

use crate::BoxError;
use papilla_output::OutputError;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Why an indentation was not solved.
#[derive(Debug)]
pub enum PressError {
    /// It cannot be; the text goes into the manifest.
    Failed(BoxError),
    /// The process was asked to stop; what was stored will be gone on with.
    Interrupted,
    /// The process was asked to stop and could not store it.
    Output(OutputError),
}

impl<E: std::error::Error + Send + Sync + 'static> From<E> for PressError {
    fn from(error: E) -> Self {
        Self::Failed(error.into())
    }
}

/// Stores where an indentation stands, at each of its stored depths: when the process is asked to
/// stop, and every so often, against what comes unannounced.
pub struct Checkpoints<'a> {
    stored: Option<Vec<u8>>,
    store: &'a dyn Fn(&[u8]) -> Result<(), OutputError>,
    reached: &'a dyn Fn(usize),
    stop: &'a AtomicBool,
    every: Duration,
    last: Instant,
    states: usize,
    failed: Option<OutputError>,
}

impl<'a> Checkpoints<'a> {
    /// For an indentation of so many stored depths of which an earlier process `stored` something.
    pub(crate) fn new(
        states: usize,
        stored: Option<Vec<u8>>,
        store: &'a dyn Fn(&[u8]) -> Result<(), OutputError>,
        reached: &'a dyn Fn(usize),
        (stop, every): (&'a AtomicBool, Duration),
    ) -> Self {
        let last = Instant::now();
        Self { stored, store, reached, stop, every, last, states, failed: None }
    }

    /// Where an earlier process left the indentation; it begins anew if that cannot be read.
    pub fn stored<S: DeserializeOwned>(&mut self) -> Option<S> {
        let bytes = self.stored.take()?;
        let read = postcard::from_bytes(&bytes);
        read.inspect_err(|error| tracing::warn!(%error, "a stored state is of another form")).ok()
    }

    /// To be called at each stored depth with their number so far. `Break`: the indentation is to
    /// end with [`Self::interrupted`].
    pub fn at_state<S: Serialize>(
        &mut self,
        states: usize,
        standing: impl FnOnce() -> S,
    ) -> ControlFlow<()> {
        (self.reached)(states);
        let stop = self.stop.load(Ordering::Relaxed);
        if states >= self.states || !(stop || self.last.elapsed() >= self.every) {
            return ControlFlow::Continue(());
        }
        let bytes = postcard::to_stdvec(&standing()).map_err(|e| OutputError::Encode {
            what: "the state of an indentation",
            message: e.to_string(),
        });
        let stored = bytes.and_then(|bytes| (self.store)(&bytes));
        self.last = Instant::now();
        match (stop, stored) {
            (true, stored) => {
                self.failed = stored.err();
                ControlFlow::Break(())
            }
            (false, Err(error)) => {
                // There may be room again by the time it is solved.
                tracing::warn!(%error, "where an indentation stands was not stored");
                ControlFlow::Continue(())
            }
            (false, Ok(())) => ControlFlow::Continue(()),
        }
    }

    /// Why the indentation ended after a `Break`.
    pub fn interrupted(&mut self) -> PressError {
        self.failed.take().map_or(PressError::Interrupted, PressError::Output)
    }
}
