//! The slot of a finger, in which one frame waits: a newer frame replaces it.

use std::{
    mem,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use tokio::sync::mpsc;

use super::{Done, Job, account};
use crate::core::buffers::Recycler;

/// Where a thread delivers the answers of a slot.
pub(crate) trait Sink: Send + Sync {
    /// Takes an answer. It must not block.
    fn deliver(&self, done: Done);

    /// Whether its client is gone.
    fn is_gone(&self) -> bool;

    /// Takes the buffers of the slot, which is being dropped.
    fn take_back(&self, recycler: &mut Recycler);
}

/// A task that awaits answers. The channel holds as many as it has places.
impl Sink for mpsc::Sender<Done> {
    fn deliver(&self, done: Done) {
        // `Closed`: the client is gone. `Full` never happens with a place for every answer.
        if let Err(mpsc::error::TrySendError::Full(_)) = self.try_send(done) {
            tracing::error!("a client's answers are not fetched; one was dropped");
        }
    }

    fn is_gone(&self) -> bool {
        self.is_closed()
    }

    /// The buffers are freed with the slot.
    fn take_back(&self, _recycler: &mut Recycler) {}
}

/// The result of [`Slot::offer`].
#[derive(Debug)]
pub(crate) enum Offer {
    /// The slot is in the queue or with a thread already. `replaced` is the job that waited in it,
    /// if there was one.
    Scheduled {
        /// The job that will not be run.
        replaced: Option<Job>,
    },
    /// The slot was idle: put it into the queue.
    Schedule,
}

/// The account of a session, or of one client's HTTP requests.
pub(crate) type Account = account::Account<Slot>;

/// Where one finger of a session, or one HTTP request, leaves its next frame for the pool.
///
/// A slot is in the queue or with a thread at most once. Therefore a finger never has two frames
/// being rendered, its answers keep the order of its frames, and the number of slots bounds the
/// queue.
pub(crate) struct Slot {
    state: Mutex<State>,
    sink: Arc<dyn Sink>,
    account: Arc<Account>,
}

#[derive(Debug)]
struct State {
    waiting: Option<Job>,
    /// In the queue or with a thread.
    scheduled: bool,
    recycler: Recycler,
}

impl Slot {
    /// An empty slot. Its answers are written into the buffers of `recycler` and go to `sink`, and
    /// their cost is charged to `account`.
    pub(crate) fn new(recycler: Recycler, sink: Arc<dyn Sink>, account: Arc<Account>) -> Self {
        let state = State { waiting: None, scheduled: false, recycler };
        Self { state: Mutex::new(state), sink, account }
    }

    /// The account that its frames are charged to.
    pub(super) fn account(&self) -> &Arc<Account> {
        &self.account
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // Every change below leaves the state whole, so a poisoned lock is usable.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts a job in. A job that waits there is replaced.
    pub(crate) fn offer(&self, job: Job) -> Offer {
        let mut state = self.state();
        let replaced = state.waiting.replace(job);
        if mem::replace(&mut state.scheduled, true) {
            Offer::Scheduled { replaced }
        } else {
            Offer::Schedule
        }
    }

    /// Takes the job back out of a slot that could not be scheduled.
    pub(crate) fn retract(&self) -> Option<Job> {
        let mut state = self.state();
        state.scheduled = false;
        state.waiting.take()
    }

    /// Gives a thread the job and the buffers for its answer. None: there is no job, and the slot
    /// is idle from now on.
    pub(super) fn take(&self) -> Option<(Job, Recycler)> {
        let mut state = self.state();
        match state.waiting.take() {
            Some(job) => Some((job, mem::take(&mut state.recycler))),
            None => {
                state.scheduled = false;
                None
            }
        }
    }

    /// Delivers the answer. True: another job has come meanwhile, so the slot must go into the
    /// queue again.
    pub(super) fn finish(&self, done: Done, recycler: Recycler) -> bool {
        self.sink.deliver(done);
        let mut state = self.state();
        state.recycler = recycler;
        state.scheduled = state.waiting.is_some();
        state.scheduled
    }

    /// Whether the client is gone.
    pub(super) fn is_abandoned(&self) -> bool {
        self.sink.is_gone()
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        let state = self.state.get_mut().unwrap_or_else(PoisonError::into_inner);
        self.sink.take_back(&mut state.recycler);
    }
}
