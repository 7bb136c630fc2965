//! Budgets on machines that are slower than the shipped times say, become slower, and recover.

use papilla_engine::Backend;

use super::*;
use papilla_proto::contact::Input;

use crate::core::catalogue::testing;

/// Error and shipped time (us) of the tiers, fastest first.
const TIERS: [(f64, u64); 4] = [(0.07, 200), (0.03, 1400), (0.026, 4800), (0.025, 9400)];
const BUDGET_US: u32 = 11_000;
const FRAME: Duration = Duration::from_millis(11);

/// A session at 90 Hz on a machine whose times are `slower` times the shipped ones.
struct Simulated {
    catalogue: Catalogue,
    budget: Budget,
    counts: FrameCounts,
    tier: usize,
    now: Instant,
}

impl Simulated {
    fn new() -> Self {
        let tier = |(error, us): (f64, u64)| {
            let tier = testing::tier(testing::model("some", Backend::Tract, 1.0), error);
            tier.latency.expect(Duration::from_micros(us));
            tier
        };
        let catalogue = testing::catalogue(TIERS.map(tier).into());
        let tier = catalogue.choose(Some(BUDGET_US), &[], Input::Pressure).unwrap();
        let budget = Budget::new(BUDGET_US, Vec::new(), Input::Pressure);
        Self { catalogue, budget, counts: FrameCounts::default(), tier, now: Instant::now() }
    }

    /// Sends one frame. Returns whether it was late.
    fn frame(&mut self, slower: f64) -> bool {
        self.now += FRAME;
        let next = self.budget.next(&self.catalogue, self.tier, &self.counts, self.now);
        self.tier = next.unwrap_or(self.tier);
        let us = (slower * TIERS[self.tier].1 as f64) as u64;
        self.catalogue.tiers[self.tier].latency.learn(Duration::from_micros(us));
        let is_late = us + self.catalogue.overhead.us() > BUDGET_US.into();
        if is_late {
            self.counts.late(self.tier);
        } else {
            self.counts.good(self.tier);
        }
        is_late
    }

    /// Sends this many frames. Returns how many were late.
    fn late(&mut self, frames: usize, slower: f64) -> usize {
        (0..frames).filter(|_| self.frame(slower)).count()
    }
}

/// The calibration was skipped, and this machine is five times slower than shipped: 47 ms for the
/// tier that was chosen, 24 ms for the next.
#[test]
fn a_tier_that_answers_nothing_lasts_ten_frames() {
    let mut session = Simulated::new();
    assert_eq!(session.tier, 3, "by the shipped times");
    assert!(session.late(60, 5.0) <= 10);
    assert_eq!(session.tier, 1, "7 ms: the most accurate that fits, without a stop between");
    // The next session profits from what was measured.
    assert_eq!(session.catalogue.choose(Some(BUDGET_US), &[], Input::Pressure), Some(1));
}

#[test]
fn a_session_goes_up_again_when_the_machine_recovers() {
    let mut session = Simulated::new();
    assert_eq!(session.late(500, 1.0), 0);
    assert_eq!(session.tier, 3);
    assert!(session.late(500, 4.0) <= 20, "one fall, and at most one try too early");
    assert_eq!(session.tier, 1);
    session.late(6000, 1.0);
    assert_eq!(session.tier, 2, "9.4 ms and what is added leave no fifth of 11 ms");
}

/// The machine becomes four times slower. By its fastest run of before, a more accurate tier seems
/// to fit the budget, but it does not.
#[test]
fn tries_become_rare_where_they_fail() {
    let mut session = Simulated::new();
    session.late(500, 1.0);
    // Ten minutes at 90 Hz.
    let late = session.late(54_000, 4.0);
    assert!(late <= 160, "{late} late frames in ten minutes");
}

#[test]
fn the_fastest_tier_stays_however_late() {
    let mut session = Simulated::new();
    assert_eq!(session.late(300, 1000.0), 300);
    assert_eq!(session.tier, 0);
    assert_eq!(session.late(4000, 1.0), 0);
    assert_eq!(session.tier, 2);
}

/// Single late frames do not change the tier.
#[test]
fn a_hiccup_changes_nothing() {
    let mut session = Simulated::new();
    for _ in 0..100 {
        session.late(40, 1.0);
        session.late(2, 3.0);
    }
    assert_eq!(session.tier, 3);
}
