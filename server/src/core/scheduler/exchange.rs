//! How a reload hands new models to the threads without stopping them.
//!
//! Engine sessions of the new models are made and warmed on another thread. Each inference thread
//! finds them in its inbox before its next job; until then it goes on with the old ones.

use std::sync::{
    Arc, Mutex, PoisonError,
    atomic::{AtomicBool, Ordering},
};

use papilla_engine::{Model, Session};
use papilla_proto::MAP_LEN;

use crate::{
    StartError,
    core::catalogue::{Catalogue, Tier},
};

/// The engine session with which a thread runs a tier; None while the tier's model is not loaded.
pub(crate) type TierSession = Option<Box<dyn Session>>;

/// New engine sessions, each with the place of its tier in the catalogue.
pub(crate) type Sessions = Vec<(usize, TierSession)>;

/// A finger's new catalogue, and the sessions that are new with it.
type Delivery = (Arc<Catalogue>, Sessions);

/// The catalogue and the engine sessions with which a thread renders one finger.
pub(super) struct OfFinger {
    pub(super) catalogue: Arc<Catalogue>,
    /// One for each tier, in the catalogue's order.
    pub(super) sessions: Vec<TierSession>,
}

/// The deliveries that wait for one inference thread.
#[derive(Default)]
pub(crate) struct Inbox {
    /// Whether anything waits. Read before every job, so that the lock is taken only if something
    /// does.
    full: AtomicBool,
    /// At most one for each finger: a later delivery is merged into the one that waits.
    deliveries: Mutex<Vec<Delivery>>,
}

impl Inbox {
    fn put(&self, catalogue: &Arc<Catalogue>, sessions: Sessions) {
        let mut deliveries = self.deliveries.lock().unwrap_or_else(PoisonError::into_inner);
        match deliveries.iter_mut().find(|(waiting, _)| waiting.place == catalogue.place) {
            Some((waiting, its_sessions)) => {
                *waiting = Arc::clone(catalogue);
                its_sessions.extend(sessions);
            }
            None => deliveries.push((Arc::clone(catalogue), sessions)),
        }
        self.full.store(true, Ordering::Release);
    }

    /// Takes all deliveries that wait. If there are none, it costs one atomic load.
    pub(super) fn collect(&self, fingers: &mut Vec<OfFinger>) {
        if !self.full.load(Ordering::Acquire) {
            return;
        }
        let mut deliveries = self.deliveries.lock().unwrap_or_else(PoisonError::into_inner);
        self.full.store(false, Ordering::Release);
        let waiting = std::mem::take(&mut *deliveries);
        drop(deliveries);
        // In the order of the deliveries, so that fingers and places are only ever appended at the
        // end.
        for (catalogue, arrived) in waiting {
            let place = catalogue.place;
            if place == fingers.len() {
                fingers.push(OfFinger { catalogue: Arc::clone(&catalogue), sessions: Vec::new() });
            }
            let Some(finger) = fingers.get_mut(place) else { continue };
            finger.catalogue = catalogue;
            for (place, session) in arrived {
                match finger.sessions.get_mut(place) {
                    Some(old) => *old = session,
                    None => finger.sessions.push(session),
                }
            }
        }
    }
}

/// The inboxes of all inference threads.
pub(crate) struct Exchange {
    inboxes: Vec<Arc<Inbox>>,
}

impl Exchange {
    pub(super) fn new(inboxes: Vec<Arc<Inbox>>) -> Self {
        Self { inboxes }
    }

    /// Makes warm sessions of the tiers whose place is `fresh`, for every thread. A tier that is
    /// not loaded gets its place with no session.
    ///
    /// # Errors
    /// A tier does not run.
    pub(crate) fn prepare(
        &self,
        catalogue: &Catalogue,
        fresh: impl Fn(usize) -> bool,
    ) -> Result<Vec<Sessions>, StartError> {
        let tiers = catalogue.tiers.iter().enumerate().filter(|(place, _)| fresh(*place));
        let fresh: Vec<_> =
            tiers.map(|(place, tier)| (place, tier, tier.model().map(Arc::as_ref))).collect();
        self.sessions(&fresh)
    }

    /// Makes warm sessions of the one tier at `place` with this model, for every thread.
    ///
    /// # Errors
    /// The tier does not run.
    pub(crate) fn prepare_one(
        &self,
        catalogue: &Catalogue,
        place: usize,
        model: &dyn Model,
    ) -> Result<Vec<Sessions>, StartError> {
        self.sessions(&[(place, &catalogue.tiers[place], Some(model))])
    }

    /// Makes warm sessions of these tiers for every thread. A tier without a model gets its place
    /// with no session.
    fn sessions(
        &self,
        tiers: &[(usize, &Tier, Option<&dyn Model>)],
    ) -> Result<Vec<Sessions>, StartError> {
        let [mut pressure_pa, mut sed_j_per_m3] = [0, 1].map(|_| vec![0.0; MAP_LEN]);
        let mut all = Vec::with_capacity(self.inboxes.len());
        for _ in &self.inboxes {
            let mut sessions = Sessions::new();
            for &(place, tier, model) in tiers {
                let session = model
                    .map(|model| tier.warm_session(model, &mut pressure_pa, &mut sed_j_per_m3));
                sessions.push((place, session.transpose()?));
            }
            all.push(sessions);
        }
        Ok(all)
    }

    /// Puts a new catalogue, and the sessions that [`prepare`](Self::prepare) made, into the
    /// inboxes.
    pub(crate) fn hand_over(&self, catalogue: &Arc<Catalogue>, sessions: Vec<Sessions>) {
        for (inbox, sessions) in self.inboxes.iter().zip(sessions) {
            inbox.put(catalogue, sessions);
        }
    }
}
