//! The bounded queue of slots that wait for a thread: first come, first served.

use std::{
    collections::VecDeque,
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use super::Slot;

/// What a thread finds.
pub(super) enum Next {
    /// A slot with a job.
    Slot(Arc<Slot>),
    /// Nothing within the wait.
    Nothing,
    /// Nothing, and nothing will come.
    Closed,
}

/// Slots with a job, in the order of their arrival.
pub(super) struct Queue {
    state: Mutex<State>,
    arrival: Condvar,
    places: usize,
}

struct State {
    slots: VecDeque<Arc<Slot>>,
    closed: bool,
}

impl Queue {
    /// A queue of at most `places` slots; all its memory is taken here.
    pub(super) fn new(places: usize) -> Self {
        let state = State { slots: VecDeque::with_capacity(places), closed: false };
        Self { state: Mutex::new(state), arrival: Condvar::new(), places }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts a slot at the end; false if the queue is full or closed.
    pub(super) fn push(&self, slot: Arc<Slot>) -> bool {
        let mut state = self.state();
        if state.closed || state.slots.len() >= self.places {
            return false;
        }
        state.slots.push_back(slot);
        drop(state);
        self.arrival.notify_one();
        true
    }

    /// Puts back a slot that a thread has just served; closed or not, its job was accepted.
    pub(super) fn push_again(&self, slot: Arc<Slot>) {
        self.state().slots.push_back(slot);
        self.arrival.notify_one();
    }

    /// The slot that waits longest; waits up to `wait` for one.
    pub(super) fn pop(&self, wait: Duration) -> Next {
        let state = self.state();
        let (mut state, _) = self
            .arrival
            .wait_timeout_while(state, wait, |s| s.slots.is_empty() && !s.closed)
            .unwrap_or_else(PoisonError::into_inner);
        match state.slots.pop_front() {
            Some(slot) => Next::Slot(slot),
            None if state.closed => Next::Closed,
            None => Next::Nothing,
        }
    }

    /// How many slots wait.
    pub(super) fn len(&self) -> i64 {
        self.state().slots.len() as i64
    }

    /// Takes no more slots; those that wait are still served.
    pub(super) fn close(&self) {
        self.state().closed = true;
        self.arrival.notify_all();
    }
}
