//! The slot of a finger, in which one frame waits: a newer frame replaces it.

use std::{
    mem,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use tokio::sync::mpsc;

use super::{Done, Job, account};
use crate::core::buffers::Recycler;

/// Where answers go, from the thread that rendered and on it.
pub(crate) trait Sink: Send + Sync {
    /// Takes an answer; must not wait.
    fn deliver(&self, done: Done);

    /// Whether its client is gone.
    fn is_gone(&self) -> bool;

    /// Takes the buffers of the slot, which is no more.
    fn take_back(&self, recycler: &mut Recycler);
}

/// A task that awaits answers: as many are kept as the channel has places.
impl Sink for mpsc::Sender<Done> {
    fn deliver(&self, done: Done) {
        // Err: whoever waited is gone, or (never, with places for all) does not fetch them.
        if let Err(mpsc::error::TrySendError::Full(_)) = self.try_send(done) {
            tracing::error!("a client's answers are not fetched; one was dropped");
        }
    }

    fn is_gone(&self) -> bool {
        self.is_closed()
    }

    /// They go with the slot.
    fn take_back(&self, _recycler: &mut Recycler) {}
}

/// What an offer came to.
#[derive(Debug)]
pub(crate) enum Offer {
    /// The slot is on its way to a thread already. The unstarted job whose
    /// place was taken, if there was one.
    Scheduled {
        /// The job that will not be run.
        replaced: Option<Job>,
    },
    /// The slot was idle: put it into the queue.
    Schedule,
}

/// The account of a session, or of one client's posts.
pub(crate) type Account = account::Account<Slot>;

/// The meeting point of one client and the pool.
///
/// A slot is in the queue or with a thread at most once, so a session never has
/// two frames under way, answers keep the order of the frames, and the queue is
/// bounded by the number of slots.
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
    /// An empty slot, whose answers are written into the buffers of `recycler` and go to `sink`;
    /// what they cost goes to `account`.
    pub(crate) fn new(recycler: Recycler, sink: Arc<dyn Sink>, account: Arc<Account>) -> Self {
        let state = State { waiting: None, scheduled: false, recycler };
        Self { state: Mutex::new(state), sink, account }
    }

    /// Whose frames these are.
    pub(super) fn account(&self) -> &Arc<Account> {
        &self.account
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // Every change below leaves the state whole, so a poisoned lock is usable.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts a job in; a job that waits is replaced.
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

    /// A thread takes the job, and the buffers for its answer.
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

    /// The thread is done; true if another job has come meanwhile and the slot
    /// must go into the queue again.
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
