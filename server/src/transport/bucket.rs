//! Token buckets: how often something may happen.

use std::time::{Duration, Instant};

/// How fast a bucket fills, and how much it holds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rate {
    /// Time in which one token flows back.
    pub(crate) refill: Duration,
    /// Time in which an empty bucket fills.
    pub(crate) depth: Duration,
}

impl Rate {
    /// `per_s` a second, after a `burst` at once.
    pub(crate) fn new(per_s: u32, burst: u32) -> Self {
        let refill = Duration::from_secs(1) / per_s.max(1);
        Self { refill, depth: refill * burst.max(1) }
    }
}

/// A bucket, kept as the time at which it is full again: so it fills by itself.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bucket {
    full_at: Instant,
}

impl Bucket {
    /// A full one.
    pub(crate) fn full(now: Instant) -> Self {
        Self { full_at: now }
    }

    pub(crate) fn is_full(&self, now: Instant) -> bool {
        self.full_at <= now
    }

    /// Takes a token.
    ///
    /// # Errors
    /// There is none; the time until there is.
    pub(crate) fn take(&mut self, rate: Rate, now: Instant) -> Result<(), Duration> {
        let next = self.full_at.max(now) + rate.refill;
        match next.saturating_duration_since(now + rate.depth) {
            Duration::ZERO => {
                self.full_at = next;
                Ok(())
            }
            wait => Err(wait),
        }
    }
}
