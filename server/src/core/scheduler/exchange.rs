//! How a reload brings new models to the threads without stopping them.
//!
//! The sessions are made and warmed elsewhere. A thread finds them in its inbox before its next
//! job; until then it serves with the old ones.

use std::sync::{
    Arc, Mutex, PoisonError,
    atomic::{AtomicBool, Ordering},
};

use papilla_engine::Session;
use papilla_proto::MAP_LEN;

use crate::{StartError, core::catalogue::Catalogue};

/// New sessions, each with its tier's place.
type Sessions = Vec<(usize, Box<dyn Session>)>;

/// The next catalogue, and the sessions it takes beyond those of the last.
type Delivery = (Arc<Catalogue>, Sessions);

/// What waits for one thread.
#[derive(Default)]
pub(crate) struct Inbox {
    /// Looked at before every job, so that the lock need not be.
    full: AtomicBool,
    delivery: Mutex<Option<Delivery>>,
}

impl Inbox {
    fn put(&self, catalogue: &Arc<Catalogue>, sessions: Sessions) {
        let mut delivery = self.delivery.lock().unwrap_or_else(PoisonError::into_inner);
        let mut waiting = delivery.take().map(|(_, waiting)| waiting).unwrap_or_default();
        waiting.extend(sessions);
        *delivery = Some((Arc::clone(catalogue), waiting));
        self.full.store(true, Ordering::Release);
    }

    /// Takes what waits; nearly free if there is nothing.
    pub(super) fn collect(
        &self,
        catalogue: &mut Arc<Catalogue>,
        sessions: &mut Vec<Box<dyn Session>>,
    ) {
        if !self.full.load(Ordering::Acquire) {
            return;
        }
        let mut delivery = self.delivery.lock().unwrap_or_else(PoisonError::into_inner);
        self.full.store(false, Ordering::Release);
        let Some((new, arrived)) = delivery.take() else { return };
        drop(delivery);
        // In the order of the deliveries, so that places are only ever appended at the end.
        for (place, session) in arrived {
            match sessions.get_mut(place) {
                Some(old) => *old = session,
                None => sessions.push(session),
            }
        }
        *catalogue = new;
    }
}

/// The way to all threads.
pub(crate) struct Exchange {
    inboxes: Vec<Arc<Inbox>>,
}

impl Exchange {
    pub(super) fn new(inboxes: Vec<Arc<Inbox>>) -> Self {
        Self { inboxes }
    }

    /// Warm sessions of the tiers that are `fresh`, for every thread.
    ///
    /// # Errors
    /// A tier does not run.
    pub(crate) fn prepare(
        &self,
        catalogue: &Catalogue,
        fresh: impl Fn(usize) -> bool,
    ) -> Result<Vec<Sessions>, StartError> {
        let [mut pressure_pa, mut sed_j_per_m3] = [0, 1].map(|_| vec![0.0; MAP_LEN]);
        let mut all = Vec::with_capacity(self.inboxes.len());
        for _ in &self.inboxes {
            let mut sessions = Sessions::new();
            for (place, tier) in catalogue.tiers.iter().enumerate().filter(|(i, _)| fresh(*i)) {
                let session = tier.warm_session(&mut pressure_pa, &mut sed_j_per_m3)?;
                sessions.push((place, session));
            }
            all.push(sessions);
        }
        Ok(all)
    }

    /// Puts what [`prepare`](Self::prepare) made into the inboxes.
    pub(crate) fn hand_over(&self, catalogue: &Arc<Catalogue>, sessions: Vec<Sessions>) {
        for (inbox, sessions) in self.inboxes.iter().zip(sessions) {
            inbox.put(catalogue, sessions);
        }
    }
}
