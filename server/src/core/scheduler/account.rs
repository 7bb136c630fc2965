//! Accounts: what the frames of a session have cost the threads. They decide which session has the
//! next turn.

use std::{
    collections::VecDeque,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

/// A frame is *long* if it takes more thread time than this beside its network. The time of the
/// network depends on the models that the operator offers, all else on what a client sends.
pub(super) const LONG: Duration = Duration::from_millis(10);

/// A single frame that takes this many times [`LONG`] makes its account heavy. The first frame of a
/// contact on pixels takes less.
const ALONE: u32 = 3;

/// Number of frames of the moving average: if it is long, the account is heavy.
const AVERAGED: u32 = 8;

/// How long an account with long frames stays heavy.
const HEAVY_FOR: Duration = Duration::from_secs(10);

/// Greatest debt that an account keeps when it comes back after a pause.
const DEBT_MAX: Duration = Duration::from_secs(1);

/// Cost that is assumed for a frame until one has been measured.
const FIRST_ESTIMATE: Duration = Duration::from_millis(1);

/// The account that all fingers of a session share, or all posts of one client; `S` is what waits.
pub(crate) struct Account<S>(Mutex<Ledger<S>>);

impl<S> Default for Account<S> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<S> Account<S> {
    /// An account without debts, with room for the slots of as many fingers.
    pub(crate) fn new(fingers: usize) -> Arc<Self> {
        let ledger = Ledger { waiting: VecDeque::with_capacity(fingers), ..Ledger::default() };
        Arc::new(Self(Mutex::new(ledger)))
    }

    /// Only the queue asks, under its own lock, so that nobody waits here.
    pub(super) fn ledger(&self) -> MutexGuard<'_, Ledger<S>> {
        // Every change leaves the ledger whole, so a poisoned lock is usable.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Whether frames of an account may hold the last free thread.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Weight {
    /// Its frames have been short.
    Light,
    /// They were long not long ago, or none has been measured yet.
    Heavy,
}

/// What an account holds.
pub(super) struct Ledger<S> {
    /// When its next turn is due, by the virtual clock of the queue: thread time that it was given.
    pub(super) due: Duration,
    /// Slots with a job, the longest wait first.
    pub(super) waiting: VecDeque<Arc<S>>,
    /// The heap that it is in, if any.
    pub(super) listed: Option<Weight>,
    running: usize,
    /// What its next frame is taken to cost.
    estimate: Duration,
    has_been_short: bool,
    /// Work beside the network, averaged over frames.
    mean: Option<Duration>,
    heavy_until: Option<Instant>,
}

impl<S> Default for Ledger<S> {
    fn default() -> Self {
        Self {
            due: Duration::ZERO,
            waiting: VecDeque::new(),
            listed: None,
            running: 0,
            estimate: FIRST_ESTIMATE,
            has_been_short: false,
            mean: None,
            heavy_until: None,
        }
    }
}

impl<S> Ledger<S> {
    pub(super) fn weight(&self, now: Instant) -> Weight {
        let is_heavy = !self.has_been_short || self.heavy_until.is_some_and(|until| now < until);
        if is_heavy { Weight::Heavy } else { Weight::Light }
    }

    /// Takes a slot in at a time of the virtual clock. A pause earns nothing, and not all debts
    /// outlast it.
    pub(super) fn enter(&mut self, slot: Arc<S>, clock: Duration) {
        if self.waiting.is_empty() && self.running == 0 {
            self.due = self.due.clamp(clock, clock + DEBT_MAX);
        }
        self.waiting.push_back(slot);
    }

    /// A thread takes the first slot; what its frame will cost is charged as far as one can tell.
    pub(super) fn begin(&mut self) -> Option<(Arc<S>, Duration)> {
        let slot = self.waiting.pop_front()?;
        self.running += 1;
        self.due += self.estimate;
        Some((slot, self.estimate))
    }

    /// A thread is done: what the frame cost takes the place of the estimate.
    pub(super) fn end(&mut self, charged: Duration, spent: Spent, now: Instant) {
        self.running = self.running.saturating_sub(1);
        self.due = self.due.saturating_sub(charged) + spent.busy;
        let Some(beside_network) = spent.beside_network else { return };
        self.estimate = spent.busy;
        let mean = self
            .mean
            .map_or(beside_network, |mean| (mean * (AVERAGED - 1) + beside_network) / AVERAGED);
        self.mean = Some(mean);
        if mean > LONG || beside_network > LONG * ALONE {
            self.heavy_until = Some(now + HEAVY_FOR);
        } else {
            self.has_been_short = true;
        }
    }
}

/// What a frame cost.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spent {
    /// Time that a thread was held.
    pub(super) busy: Duration,
    /// The part of it that was not the network's; none: nothing was rendered.
    pub(super) beside_network: Option<Duration>,
}
