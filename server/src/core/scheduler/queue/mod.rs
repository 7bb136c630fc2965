//! The bounded queue of slots that wait for a thread. Sessions take turns, by their accounts.
//!
//! Start-time fair queuing (Goyal, Vin & Cheng 1996): a virtual clock gives each account the time
//! of its next turn, and every frame moves this time on by the thread time that the frame took. So
//! the session that has cost least goes first, ten fingers of one session share what one session
//! gets, and the choice takes the logarithm of the number of accounts.
//!
//! A turn cannot be taken back once a frame is begun. Therefore heavy accounts ([`Weight`]) may
//! hold all threads but one as long as light accounts send frames. However many heavy ones there
//! are, a light frame finds a thread.

use std::{
    cmp::Ordering,
    collections::BinaryHeap,
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use super::{
    Account, Slot,
    account::{Ledger, Spent, Weight},
};

/// How long after the last frame of a light account a thread is kept free for the next one.
const LIGHT_FOR: Duration = Duration::from_secs(2);

/// What a thread finds when it asks for work.
pub(super) enum Next {
    /// A slot with a job.
    Turn(Turn),
    /// No slot had its turn within the wait.
    Nothing,
    /// The queue is closed and empty: the thread ends.
    Closed,
}

/// A slot whose turn it is. [`Queue::done`] ends the turn.
pub(super) struct Turn {
    pub(super) slot: Arc<Slot>,
    weight: Weight,
    /// What its account was charged in advance.
    charged: Duration,
}

/// The slots that have a job, ordered by what their accounts have cost.
pub(super) struct Queue {
    state: Mutex<State>,
    arrival: Condvar,
    places: usize,
    threads: usize,
}

struct State {
    light: BinaryHeap<Entry>,
    heavy: BinaryHeap<Entry>,
    slots: usize,
    /// The virtual clock: when the turn that was taken last was due.
    clock: Duration,
    arrivals: u64,
    /// Turns of heavy accounts that have not ended.
    heavy_running: usize,
    /// Threads that wait for an arrival: only they have to be woken, and a wake-up is a call of the
    /// system whether anybody waits or not.
    asleep: usize,
    light_seen: Option<Instant>,
    light_for: Duration,
    closed: bool,
}

/// An account in a heap. The order is reversed, so that the greatest entry is the one that is due
/// first; of equals it is the one that came first.
struct Entry {
    due: Duration,
    arrival: u64,
    account: Arc<Account>,
}

impl Entry {
    fn rank(&self) -> (Duration, u64) {
        (self.due, self.arrival)
    }
}

impl Ord for Entry {
    fn cmp(&self, other: &Self) -> Ordering {
        other.rank().cmp(&self.rank())
    }
}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Entry {
    fn eq(&self, other: &Self) -> bool {
        self.rank() == other.rank()
    }
}

impl Eq for Entry {}

impl State {
    fn heap(&mut self, weight: Weight) -> &mut BinaryHeap<Entry> {
        match weight {
            Weight::Light => &mut self.light,
            Weight::Heavy => &mut self.heavy,
        }
    }

    /// Puts an account with waiting slots into the heap of its weight.
    fn list(&mut self, account: &Arc<Account>, ledger: &mut Ledger<Slot>, now: Instant) {
        let weight = ledger.weight(now);
        self.arrivals += 1;
        let (due, arrival) = (ledger.due, self.arrivals);
        self.heap(weight).push(Entry { due, arrival, account: Arc::clone(account) });
        ledger.listed = Some(weight);
    }

    fn enter(&mut self, slot: Arc<Slot>, now: Instant) {
        let account = Arc::clone(slot.account());
        let mut ledger = account.ledger();
        ledger.enter(slot, self.clock);
        self.slots += 1;
        if ledger.weight(now) == Weight::Light {
            self.light_seen = Some(now);
        }
        if ledger.listed.is_none() {
            self.list(&account, &mut ledger, now);
        }
    }

    /// Whether a heavy account may take a thread.
    fn is_heavy_free(&self, threads: usize, now: Instant) -> bool {
        let is_light_about = self
            .light_seen
            .is_some_and(|seen| now.saturating_duration_since(seen) < self.light_for);
        let kept_free = usize::from(threads > 1 && is_light_about && !self.closed);
        self.heavy_running < threads - kept_free
    }

    /// The slot whose turn it is, if a thread may take one.
    fn next(&mut self, threads: usize, now: Instant) -> Option<Turn> {
        loop {
            let heavy = self.heavy.peek().filter(|_| self.is_heavy_free(threads, now));
            let weight = match (self.light.peek(), heavy) {
                (None, None) => return None,
                (Some(light), Some(heavy)) if light.rank() > heavy.rank() => Weight::Heavy,
                (Some(_), _) => Weight::Light,
                (None, Some(_)) => Weight::Heavy,
            };
            let Entry { due, account, .. } = self.heap(weight).pop()?;
            let mut ledger = account.ledger();
            ledger.listed = None;
            if ledger.due > due || ledger.weight(now) != weight {
                // Its due time or its weight has changed since, so it is listed anew.
                self.list(&account, &mut ledger, now);
                continue;
            }
            self.clock = self.clock.max(ledger.due);
            let Some((slot, charged)) = ledger.begin() else { continue };
            self.slots -= 1;
            self.heavy_running += usize::from(weight == Weight::Heavy);
            if !ledger.waiting.is_empty() {
                self.list(&account, &mut ledger, now);
            }
            return Some(Turn { slot, weight, charged });
        }
    }

    fn end(&mut self, turn: Turn, spent: Spent, is_again: bool, now: Instant) {
        let Turn { slot, weight, charged } = turn;
        self.heavy_running -= usize::from(weight == Weight::Heavy);
        let account = Arc::clone(slot.account());
        let mut ledger = account.ledger();
        ledger.end(charged, spent, now);
        if is_again {
            ledger.waiting.push_back(slot);
            self.slots += 1;
        }
        let is_light = ledger.weight(now) == Weight::Light;
        if is_light {
            self.light_seen = Some(now);
        }
        if is_light && ledger.listed == Some(Weight::Heavy) {
            // The search is linear, but as a rule it happens once for an account: after its first
            // short frame.
            self.heavy.retain(|entry| !Arc::ptr_eq(&entry.account, &account));
            ledger.listed = None;
        }
        if ledger.listed.is_none() && !ledger.waiting.is_empty() {
            self.list(&account, &mut ledger, now);
        }
    }
}

impl Queue {
    /// A queue of at most `places` slots for this many threads. All its memory is taken here.
    pub(super) fn new(places: usize, threads: usize) -> Self {
        let state = State {
            light: BinaryHeap::with_capacity(places),
            heavy: BinaryHeap::with_capacity(places),
            slots: 0,
            clock: Duration::ZERO,
            arrivals: 0,
            heavy_running: 0,
            asleep: 0,
            light_seen: None,
            light_for: LIGHT_FOR,
            closed: false,
        };
        Self { state: Mutex::new(state), arrival: Condvar::new(), places, threads }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Queues a slot. False: the queue is full or closed.
    pub(super) fn push(&self, slot: Arc<Slot>) -> bool {
        let mut state = self.state();
        if state.closed || state.slots >= self.places {
            return false;
        }
        state.enter(slot, Instant::now());
        let is_asleep = state.asleep > 0;
        drop(state);
        if is_asleep {
            self.arrival.notify_one();
        }
        true
    }

    /// Ends a turn. With `is_again` the slot has another job and waits again, even if the queue is
    /// full or closed: that job was accepted before.
    pub(super) fn done(&self, turn: Turn, spent: Spent, is_again: bool) {
        let mut state = self.state();
        state.end(turn, spent, is_again, Instant::now());
        // Another thread may now have work: the slot waits again, or a heavy account waited for a
        // heavy turn to end. If nothing waits, nobody is woken.
        let is_to_wake = state.asleep > 0 && (state.slots > 0 || state.closed);
        drop(state);
        if is_to_wake {
            self.arrival.notify_one();
        }
    }

    /// The slot whose turn it is; waits up to `wait` for one.
    pub(super) fn pop(&self, wait: Duration) -> Next {
        let end = Instant::now() + wait;
        let mut state = self.state();
        loop {
            let now = Instant::now();
            if let Some(turn) = state.next(self.threads, now) {
                return Next::Turn(turn);
            }
            if state.closed && state.slots == 0 {
                return Next::Closed;
            }
            let left = end.saturating_duration_since(now);
            if left.is_zero() {
                return Next::Nothing;
            }
            state.asleep += 1;
            let woken = self.arrival.wait_timeout(state, left);
            (state, _) = woken.unwrap_or_else(PoisonError::into_inner);
            state.asleep -= 1;
        }
    }

    /// How many slots wait.
    pub(super) fn len(&self) -> i64 {
        self.state().slots as i64
    }

    /// Takes no more slots; those that wait are still served.
    pub(super) fn close(&self) {
        self.state().closed = true;
        self.arrival.notify_all();
    }
}

#[cfg(test)]
impl Queue {
    /// Light accounts count for a long time: a test that is held up must not see them expire.
    pub(super) fn remember_light(&self) {
        self.state().light_for = Duration::from_secs(3600);
    }
}

#[cfg(test)]
mod tests;
