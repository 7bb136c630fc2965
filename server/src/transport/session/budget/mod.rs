//! Keeps the budget of a session: changes its tier as the times on this machine change.

use std::{
    sync::atomic::{AtomicU32, AtomicUsize, Ordering},
    time::{Duration, Instant},
};

use papilla_proto::contact::Input;

use crate::core::catalogue::Catalogue;

/// Late frames after which a session changes to a faster tier. Two more may be on their way then.
const LATE_MOST: u32 = 8;
/// Consecutive frames in time after which earlier late frames are forgotten.
const GOOD_LEAST: u32 = 32;
/// Time between two changes before a more accurate tier is tried. It doubles each time the tier
/// that was tried cannot keep the budget, so that a session does not swing.
const TRY_AFTER: Duration = Duration::from_secs(2);
const TRY_AFTER_MOST: Duration = Duration::from_secs(64);
/// Greatest share of the budget that a more accurate tier may be expected to take to be tried.
const SHARE_TO_CLIMB: f64 = 0.8;

/// Counts of late frames and of frames in time. They are updated where answers are sent.
#[derive(Debug, Default)]
pub(super) struct FrameCounts {
    /// Number of the tier that the counts are for. Answers of an earlier tier are not counted.
    tier: AtomicUsize,
    late: AtomicU32,
    good: AtomicU32,
}

impl FrameCounts {
    /// Counts a late frame of this tier.
    pub(super) fn late(&self, tier: usize) {
        if tier == self.tier.load(Ordering::Relaxed) {
            self.late.fetch_add(1, Ordering::Relaxed);
            self.good.store(0, Ordering::Relaxed);
        }
    }

    /// Counts a frame of this tier that was in time.
    pub(super) fn good(&self, tier: usize) {
        if tier == self.tier.load(Ordering::Relaxed)
            && self.good.fetch_add(1, Ordering::Relaxed) >= GOOD_LEAST
        {
            self.late.store(0, Ordering::Relaxed);
        }
    }

    fn begin(&self, tier: usize) {
        self.tier.store(tier, Ordering::Relaxed);
        self.late.store(0, Ordering::Relaxed);
        self.good.store(0, Ordering::Relaxed);
    }
}

/// The choice of tier of a session that named a budget and no tier.
#[derive(Debug)]
pub(super) struct Budget {
    budget_us: u32,
    /// Effects that the tier has to render.
    effects: Vec<String>,
    /// What frames hold.
    input: Input,
    changed: Option<Instant>,
    try_after: Duration,
    /// Whether the last change was to a more accurate tier.
    has_climbed: bool,
}

impl Budget {
    pub(super) fn new(budget_us: u32, effects: Vec<String>, input: Input) -> Self {
        Self { budget_us, effects, input, changed: None, try_after: TRY_AFTER, has_climbed: false }
    }

    /// The place of the tier to change to for the next frame; None: stay with `tier`. Allocates
    /// nothing.
    pub(super) fn next(
        &mut self,
        catalogue: &Catalogue,
        tier: usize,
        counts: &FrameCounts,
        now: Instant,
    ) -> Option<usize> {
        let Some(changed) = self.changed else {
            self.changed = Some(now);
            counts.begin(catalogue.tier_number(tier));
            return None;
        };
        let since = now.saturating_duration_since(changed);
        let next = if counts.late.load(Ordering::Relaxed) >= LATE_MOST {
            let faster = self.faster(catalogue, tier);
            if faster.is_none() {
                counts.begin(catalogue.tier_number(tier));
            }
            faster
        } else if since >= self.try_after && counts.good.load(Ordering::Relaxed) >= GOOD_LEAST {
            self.more_accurate(catalogue, tier)
        } else {
            None
        }?;
        let error = |tier: usize| catalogue.tiers[tier].error(self.input);
        let climbs = error(next) < error(tier);
        self.try_after = match (self.has_climbed, climbs) {
            (true, false) => (2 * self.try_after).min(TRY_AFTER_MOST),
            // The tier that was tried before has kept the budget.
            (true, true) => TRY_AFTER,
            (false, _) => self.try_after,
        };
        (self.changed, self.has_climbed) = (Some(now), climbs);
        counts.begin(catalogue.tier_number(next));
        Some(next)
    }

    /// Among the tiers that are faster than this one, the most accurate that is expected to keep
    /// the budget, or else the fastest. None: no tier is faster.
    fn faster(&self, catalogue: &Catalogue, tier: usize) -> Option<usize> {
        let time_us = catalogue.predicted_latency_us(tier);
        let is_faster = |place: usize| catalogue.predicted_latency_us(place) < time_us;
        catalogue.choose_among(self.budget_us, &self.effects, self.input, is_faster)
    }

    /// Among the tiers that are more accurate than this one and may keep the budget, the most
    /// accurate.
    fn more_accurate(&self, catalogue: &Catalogue, tier: usize) -> Option<usize> {
        let most_us = SHARE_TO_CLIMB * f64::from(self.budget_us);
        let error = |tier: usize| catalogue.tiers[tier].error(self.input);
        catalogue
            .for_budgets(&self.effects, self.input)
            .filter(|&place| error(place) < error(tier))
            .filter(|&place| catalogue.hoped_latency_us(place, tier) as f64 <= most_us)
            .min_by(|&a, &b| error(a).total_cmp(&error(b)))
    }
}

#[cfg(test)]
mod tests;
