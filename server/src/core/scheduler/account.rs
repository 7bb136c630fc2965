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

/// The account that all fingers of a session share, or all HTTP requests of one client. `S` is the
/// kind of slot that waits.
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

    /// Only the queue calls this, while it holds its own lock, so nobody ever waits here.
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
    /// Some were long within the last [`HEAVY_FOR`], or no short one has been measured yet.
    Heavy,
}

/// What an account holds.
pub(super) struct Ledger<S> {
    /// When its next turn is due, on the virtual clock of the queue. The clock's unit is thread
    /// time.
    pub(super) due: Duration,
    /// Slots with a job, the longest wait first.
    pub(super) waiting: VecDeque<Arc<S>>,
    /// The heap that the account is in; None if it is in neither.
    pub(super) listed: Option<Weight>,
    running: usize,
    /// Estimated cost of its next frame, which is what the last measured one cost.
    estimate: Duration,
    has_been_short: bool,
    /// Moving average of a frame's processor time without the network; None before the first
    /// measured frame.
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

    /// Queues a slot; `clock` is the virtual time now. An account that comes back after a pause has
    /// no credit, and at most [`DEBT_MAX`] of debt.
    pub(super) fn enter(&mut self, slot: Arc<S>, clock: Duration) {
        if self.waiting.is_empty() && self.running == 0 {
            self.due = self.due.clamp(clock, clock + DEBT_MAX);
        }
        self.waiting.push_back(slot);
    }

    /// Gives the first slot to a thread, and charges the account the estimated cost in advance.
    /// Returns that charge too.
    pub(super) fn begin(&mut self) -> Option<(Arc<S>, Duration)> {
        let slot = self.waiting.pop_front()?;
        self.running += 1;
        self.due += self.estimate;
        Some((slot, self.estimate))
    }

    /// Ends a frame: what it really cost replaces the charge made in advance.
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
    /// Processor time of this frame without that of the network. None: the frame says nothing about
    /// the account, since nothing was rendered and it did not take long.
    pub(super) beside_network: Option<Duration>,
}
