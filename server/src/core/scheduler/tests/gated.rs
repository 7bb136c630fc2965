//! A model that stops and goes as it is told.

use std::{
    sync::{
        Arc, Mutex,
        mpsc::{Receiver, SyncSender},
    },
    time::Duration,
};

use papilla_engine::{Backend, EngineError, Model, ModelInfo, Session};

/// A model whose every inference, after those of the warm-up, waits for a go. What it is
/// told to do, it does: that makes the order of events in these tests certain, which no real
/// network could.
pub(super) struct Gated {
    pub(super) info: ModelInfo,
    pub(super) gate: Arc<Gate>,
}

pub(super) struct Gate {
    /// Announces that an inference has begun.
    pub(super) begun: SyncSender<()>,
    /// Receives what the inference shall do.
    pub(super) go: Mutex<Receiver<Act>>,
}

/// A map whose pressures are no greater than this, Pa, is rendered at once. Its beginning is
/// announced as well.
pub(super) const FREE_PA: f32 = 0.5;

pub(super) enum Act {
    Finish,
    Panic,
}

struct GatedSession {
    gate: Arc<Gate>,
    warm: usize,
}

impl Model for Gated {
    fn info(&self) -> &ModelInfo {
        &self.info
    }

    fn backend(&self) -> Backend {
        Backend::Tract
    }

    fn session(&self) -> Result<Box<dyn Session>, EngineError> {
        Ok(Box::new(GatedSession { gate: Arc::clone(&self.gate), warm: 0 }))
    }
}

impl Session for GatedSession {
    fn infer(&mut self, pressure: &[f32], sed: &mut [f32]) -> Result<(), EngineError> {
        self.warm += 1;
        sed.copy_from_slice(pressure);
        // The run that warms a session up does not wait.
        if self.warm <= 1 {
            return Ok(());
        }
        self.gate.begun.send(()).unwrap();
        if pressure.iter().all(|&pa| pa <= FREE_PA) {
            return Ok(());
        }
        match self.gate.go.lock().unwrap().recv_timeout(Duration::from_secs(30)).unwrap() {
            Act::Finish => Ok(()),
            Act::Panic => panic!("as told"),
        }
    }
}
