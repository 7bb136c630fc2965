//! Sessions that move to another connection: what they take along, encrypted, and how they go on
//! there.

use std::{
    sync::{Arc, Mutex, PoisonError},
    time::SystemTime,
};

use papilla_proto::{Hello, Resumption};
use papilla_session_contact::Finger;
use papilla_session_effects::Effects;
use papilla_session_state::{Reader, SealError, SealedFor, StateError, Writer};
use sha2::{Digest, Sha256};

use crate::transport::app::App;

/// The first byte of sealed data, which says whether there is no state to restore, a state behind
/// it, or none because it was too large.
const NOTHING: u8 = 0;
const STATE: u8 = 1;
const TOO_LARGE: u8 = 2;

/// Hash of those members of a hello on which the form of the session's state depends.
#[derive(Clone, Copy)]
pub(super) struct Shape([u8; 32]);

impl Shape {
    /// The shape for a hello. Members that do not change the state's form are left out: those that
    /// choose a tier, set bounds, or select what is shown.
    pub(super) fn of(hello: &Hello) -> Self {
        let plain = Hello::default();
        let shape = Hello {
            budget_us: None,
            tier: None,
            sample_type: plain.sample_type,
            pressure_scale_pa: None,
            atlas_hash: None,
            answer_sample_type: None,
            map: None,
            contact_pa: None,
            out_of_range: None,
            stale_after_us: None,
            contact_window: None,
            points: None,
            actuators: None,
            reconnect: None,
            resume: None,
            answer_layout: None,
            pressure: None,
            displacement: None,
            error_estimate: None,
            ..hello.clone()
        };
        // Never fails, since the hello was read from JSON.
        let text = serde_json::to_vec(&shape).unwrap_or_default();
        Self(Sha256::digest(text).into())
    }

    /// What a state is bound to: this shape, the tier of the first finger, and the atlases of all
    /// fingers.
    pub(super) fn on<'a>(
        &'a self,
        tier: &str,
        atlases: impl Iterator<Item = &'a str>,
    ) -> SealedFor {
        let parts: Vec<&[u8]> = atlases.map(str::as_bytes).chain([&self.0[..]]).collect();
        SealedFor::of(tier, &parts)
    }
}

/// The parts of a session that answers depend on.
#[derive(Clone)]
pub(super) struct Memory {
    pub(super) effects: Vec<Arc<Mutex<Effects>>>,
    pub(super) fingers: Vec<Arc<Mutex<Finger>>>,
}

impl Memory {
    fn save(&self) -> Vec<u8> {
        let mut state = Writer::default();
        let mut has_state = false;
        for effects in &self.effects {
            let effects = lock(effects);
            has_state |= effects.has_state();
            effects.save(&mut state);
        }
        for finger in &self.fingers {
            let finger = lock(finger);
            has_state |= finger.has_state();
            finger.save(&mut state);
        }
        let mut bytes = state.finish();
        bytes.insert(0, if has_state { STATE } else { NOTHING });
        bytes
    }

    fn restore(&self, bytes: &[u8]) -> Result<(), StateError> {
        let mut state = Reader::new(bytes);
        self.effects.iter().try_for_each(|effects| lock(effects).restore(&mut state))?;
        self.fingers.iter().try_for_each(|finger| lock(finger).restore(&mut state))?;
        state.end()
    }

    /// The sealed state. If it is too large, a sealed note that says so.
    ///
    /// # Errors
    /// The system gives no random numbers.
    pub(super) fn seal(&self, app: &App, terms: &SealedFor) -> Result<Vec<u8>, SealError> {
        let (keys, now) = (&app.moves.keys, SystemTime::now());
        match keys.seal(terms, &self.save(), now) {
            Err(SealError::TooLarge(_)) => keys.seal(terms, &[TOO_LARGE], now),
            result => result,
        }
    }

    /// Restores a sealed state, and returns what came of it. Unless that is `Resumed` or `Nothing`,
    /// this memory may be restored in part and must not be used.
    pub(super) fn resume(&self, app: &App, terms: &SealedFor, sealed: &[u8]) -> Resumption {
        let opened = match app.moves.keys.open(terms, sealed, SystemTime::now()) {
            Ok(opened) => opened,
            Err(why) => return why,
        };
        match opened.split_first() {
            Some((&STATE, state)) => match self.restore(state) {
                Ok(()) => Resumption::Resumed,
                Err(error) => {
                    tracing::warn!(%error, "a state that this service's key has sealed");
                    Resumption::OtherTerms
                }
            },
            Some((&TOO_LARGE, _)) => Resumption::TooLarge,
            _ => Resumption::Nothing,
        }
    }
}

fn lock<T>(of: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}
