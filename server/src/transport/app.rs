//! The state that all routes and sessions share.

use std::{
    path::PathBuf,
    sync::Arc,
    sync::atomic::{AtomicU64, Ordering},
};

use papilla_metrics::{Metrics, Shed};
use papilla_proto::{ErrorCode, Problem, contact::DEFAULT_FINGER, error::shortened};
use papilla_session_contact::ContactAssets;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, SetOnce, watch};

use super::{
    gate::{Gate, Key, Principal},
    moves::Moves,
    posters::Posters,
};
use crate::{
    config::{Config, Timeouts},
    core::{
        buffers::Store,
        catalogue::{Catalogue, places},
        desk::Desk,
        fingers::Loaded,
        reload::Reloader,
        scheduler::{Pool, PoolHandle},
    },
    problem,
    progress::Progress,
};

/// Where the fingers beside the default one are, and how many of them may be loaded.
pub(crate) struct Fingers {
    pub(crate) folder: Option<PathBuf>,
    pub(crate) most: usize,
}

/// The shared state.
pub(crate) struct App {
    pub(crate) reloader: Arc<Reloader>,
    pub(crate) gate: Gate,
    pub(crate) moves: Moves,
    /// Largest body of a request, bytes.
    pub(crate) body_max: usize,
    pub(crate) metrics: Arc<Metrics>,
    pub(crate) pool: PoolHandle,
    pub(crate) timeouts: Timeouts,
    /// True once the server drains. Whoever must be waited for holds a receiver.
    pub(crate) drain: Arc<watch::Sender<bool>>,
    /// How far the start has come.
    pub(crate) progress: Arc<Progress>,
    /// Memory of sessions that are over.
    pub(crate) store: Store,
    /// The default finger's contact model, if there is one, once that is known.
    contact: SetOnce<Option<Arc<ContactAssets>>>,
    /// The fingers beside the default one.
    pub(crate) fingers: Fingers,
    /// Where hellos are worked out.
    pub(crate) desk: Desk<Option<Key>>,
    /// Accounts of clients that post maps.
    pub(crate) posters: Posters,
    places_for_fingers: Arc<Semaphore>,
    sessions: Arc<Semaphore>,
    requests: Arc<Semaphore>,
    requests_max: usize,
    next_session: AtomicU64,
}

impl App {
    pub(crate) fn new(
        config: &Config,
        catalogue: Arc<Catalogue>,
        metrics: Arc<Metrics>,
        pool: &Pool,
        (gate, moves, desk): (Gate, Moves, Desk<Option<Key>>),
        drain: Arc<watch::Sender<bool>>,
        progress: Arc<Progress>,
    ) -> Self {
        let (exchange, counted) = (pool.exchange(), Arc::clone(&metrics));
        let reloader = Reloader::new(config, catalogue, exchange, counted, Arc::clone(&drain));
        Self {
            reloader: Arc::new(reloader),
            gate,
            moves,
            desk,
            fingers: Fingers {
                folder: config.fingers.clone(),
                most: config.max_loaded_fingers.get(),
            },
            body_max: config.max_body_bytes,
            pool: pool.handle(&metrics),
            metrics,
            timeouts: config.timeouts(),
            drain,
            progress,
            store: Store::new(config.max_sessions.get()),
            contact: SetOnce::new(),
            posters: Posters::default(),
            places_for_fingers: Arc::new(Semaphore::new(config.max_fingers.get())),
            sessions: Arc::new(Semaphore::new(config.max_sessions.get())),
            requests: Arc::new(Semaphore::new(config.max_requests.get())),
            requests_max: config.max_requests.get(),
            next_session: AtomicU64::new(1),
        }
    }

    /// From here on it is known whether there is a contact model.
    pub(crate) fn set_contact(&self, contact: Option<ContactAssets>) {
        // Err: it is known already.
        let _ = self.contact.set(contact.map(Arc::new));
    }

    /// The default finger's contact model; none if there is none, or it is not loaded yet.
    pub(crate) fn contact(&self) -> Option<&Arc<ContactAssets>> {
        self.contact.get().and_then(Option::as_ref)
    }

    /// A finger as it is served now.
    ///
    /// # Errors
    /// There is none of this name, or it is not loaded.
    pub(crate) fn finger(&self, name: &str) -> Result<Loaded, Problem> {
        if name == DEFAULT_FINGER {
            return Ok(Loaded { catalogue: self.catalogue(), contact: self.contact().cloned() });
        }
        self.reloader.finger(name).map(|named| named.loaded).ok_or_else(|| {
            // Its first use came to nothing, or a reload came between.
            let name = shortened(name);
            let message = format!("finger '{name}' is not loaded; try again in a moment");
            Problem::new(ErrorCode::Overloaded, message)
        })
    }

    /// The name of the tier of this number; empty if there is none.
    pub(crate) fn tier_name(&self, number: usize) -> String {
        let (finger, place) = places(number);
        let catalogue = self.reloader.catalogue_at(finger);
        let tier = catalogue.as_ref().and_then(|catalogue| catalogue.tiers.get(place));
        tier.map(|tier| tier.name.clone()).unwrap_or_default()
    }

    /// Whether it is known by now if there is a contact model.
    pub(crate) fn knows_contact(&self) -> bool {
        self.contact.get().is_some()
    }

    /// Waits until that is known.
    pub(crate) async fn wait_for_contact(&self) {
        self.contact.wait().await;
    }

    /// What there is to render with now; it may be replaced at any time, so whoever needs it
    /// twice keeps it.
    pub(crate) fn catalogue(&self) -> Arc<Catalogue> {
        self.reloader.catalogue()
    }

    /// Whether nobody is served: no session is open and no posted map is under way.
    pub(crate) fn is_idle(&self) -> bool {
        let is_any_posted = self.requests.available_permits() < self.requests_max;
        self.metrics.sessions_open.get() == 0 && !is_any_posted
    }

    /// Whether new work is refused.
    pub(crate) fn is_draining(&self) -> bool {
        *self.drain.borrow()
    }

    /// A place for one session of this principal.
    ///
    /// # Errors
    /// All are taken, or all that the principal may have, or the server drains.
    pub(crate) fn admit_session(&self, principal: &Principal) -> Result<SessionPlace, Problem> {
        let holder =
            principal.holder.as_ref().and_then(|holder| Some((holder, holder.sessions.as_ref()?)));
        let of_token = holder.map(|(holder, places)| {
            Arc::clone(places).try_acquire_owned().map_err(|_| {
                self.metrics.shed(Shed::TokenSessions);
                let message = format!("token '{}' has all the sessions it may have", holder.name);
                Problem::new(ErrorCode::Overloaded, message)
            })
        });
        let of_token = of_token.transpose()?;
        let of_all = self.admit(&self.sessions, "session", Shed::Sessions)?;
        Ok(SessionPlace { _of_all: of_all, _of_token: of_token })
    }

    /// Places for the fingers of a session.
    ///
    /// # Errors
    /// Too few are left.
    pub(crate) fn admit_fingers(&self, count: usize) -> Result<OwnedSemaphorePermit, Problem> {
        let count = u32::try_from(count).unwrap_or(u32::MAX);
        Arc::clone(&self.places_for_fingers).try_acquire_many_owned(count).map_err(|_| {
            self.metrics.shed(Shed::Sessions);
            let message = "places for fingers are taken (max_fingers); try again in a moment";
            Problem::new(ErrorCode::Overloaded, message).at("fingers")
        })
    }

    /// A place for one posted map.
    ///
    /// # Errors
    /// All are taken, or the server drains.
    pub(crate) fn admit_request(&self) -> Result<OwnedSemaphorePermit, Problem> {
        self.admit(&self.requests, "request", Shed::Requests)
    }

    fn admit(
        &self,
        places: &Arc<Semaphore>,
        what: &str,
        shed: Shed,
    ) -> Result<OwnedSemaphorePermit, Problem> {
        if self.is_draining() {
            return Err(problem::shutting_down());
        }
        Arc::clone(places).try_acquire_owned().map_err(|_| {
            self.metrics.shed(shed);
            let message = format!("every {what} place is taken; try again in a moment");
            Problem::new(ErrorCode::Overloaded, message)
        })
    }

    /// A number no other session of this run has.
    pub(crate) fn session_number(&self) -> u64 {
        self.next_session.fetch_add(1, Ordering::Relaxed)
    }
}

/// A place for one session; given back when it is dropped.
pub(crate) struct SessionPlace {
    _of_all: OwnedSemaphorePermit,
    _of_token: Option<OwnedSemaphorePermit>,
}
