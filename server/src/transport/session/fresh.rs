//! Which frames are stale: too old, when they arrive, to be worth computing.

use std::time::{Duration, Instant};

use papilla_session_state::Clock;

/// How fast the shortest delay seen so far is forgotten, s/s. Clocks drift by some 50e-6 at most.
const DRIFT: f64 = 200e-6;

/// After this many stale frames in a row it is assumed that the client's clock was set, and the
/// comparison begins anew.
const IN_A_ROW_MAX: u32 = 64;

/// What is remembered to tell the stale frames of a finger.
///
/// The clocks of client and server have unrelated zeros, so the delay of a frame is measured
/// against the fastest frame so far.
#[derive(Debug)]
pub(super) struct Freshness {
    begun: Instant,
    /// Longest delay of a frame that is not stale, us; None: no delay makes a frame stale.
    stale_after_us: Option<u32>,
    /// The newest sequence number accepted so far; None before the first.
    newest: Option<u32>,
    fastest: Option<Fastest>,
    in_a_row: u32,
    /// Interpolates the times of a client's clock that ticks coarsely, so that a frame at the end
    /// of a tick does not count as delayed.
    clock: Clock,
}

#[derive(Debug, Clone, Copy)]
struct Fastest {
    /// Server's clock minus client's, us.
    lag_us: i64,
    at: Instant,
}

impl Freshness {
    pub(super) fn new(stale_after_us: Option<u32>) -> Self {
        let begun = Instant::now();
        let clock = Clock::new();
        Self { begun, stale_after_us, newest: None, fastest: None, in_a_row: 0, clock }
    }

    /// Whether a frame is stale: delayed too long, or older than one accepted before. If it is not
    /// stale, it becomes the newest.
    ///
    /// Sequence numbers wrap around: one is newer if it lies less than half of all numbers ahead.
    pub(super) fn is_stale(
        &mut self,
        sequence: u32,
        client_time_us: u64,
        received: Instant,
    ) -> bool {
        let held_up = self.is_held_up(client_time_us, received);
        let overtaken = self
            .newest
            .is_some_and(|newest| sequence.wrapping_sub(newest).wrapping_sub(1) >= u32::MAX / 2);
        if !(held_up || overtaken) {
            self.newest = Some(sequence);
        }
        held_up || overtaken
    }

    fn is_held_up(&mut self, client_time_us: u64, received: Instant) -> bool {
        let Some(stale_after_us) = self.stale_after_us else { return false };
        let client_time_us = self.clock.time_us(client_time_us);
        let since_begun = received.saturating_duration_since(self.begun);
        // A client's clock may begin anywhere, so the difference may wrap around.
        let lag_us = (since_begun.as_micros() as i64).wrapping_sub(client_time_us as i64);
        let best_us = self.fastest.map_or(lag_us, |Fastest { lag_us, at }| {
            let passed = received.saturating_duration_since(at);
            lag_us.wrapping_add(drift_us(passed))
        });
        let delay_us = lag_us.wrapping_sub(best_us);
        if delay_us > i64::from(stale_after_us) && self.in_a_row < IN_A_ROW_MAX {
            self.in_a_row += 1;
            return true;
        }
        if delay_us <= 0 || self.in_a_row >= IN_A_ROW_MAX {
            self.fastest = Some(Fastest { lag_us, at: received });
        }
        self.in_a_row = 0;
        false
    }
}

fn drift_us(passed: Duration) -> i64 {
    (passed.as_secs_f64() * 1e6 * DRIFT) as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_newer_sequences_are_fresh_and_they_may_wrap() {
        let mut fresh = Freshness::new(None);
        let now = Instant::now();
        let stale: Vec<bool> = [5, 6, 6, 4, 9, 8, 10, u32::MAX, 11]
            .into_iter()
            .map(|sequence| fresh.is_stale(sequence, 0, now))
            .collect();
        assert_eq!(stale, [false, false, true, true, false, true, false, true, false]);
        let mut fresh = Freshness::new(None);
        let wrapping = [u32::MAX - 1, u32::MAX, 0, 1, u32::MAX];
        let stale = wrapping.map(|sequence| fresh.is_stale(sequence, 0, now));
        assert_eq!(stale, [false, false, false, false, true]);
    }

    /// Sends a frame every 10 ms, with a client's clock that begins at `clock_us` and delays of
    /// `delays_ms`. Returns which were stale.
    fn stale(fresh: &mut Freshness, clock_us: u64, delays_ms: &[u64]) -> Vec<bool> {
        let begun = fresh.begun;
        let first = fresh.newest.map_or(0, |newest| newest + 1);
        (first..)
            .zip(delays_ms)
            .map(|(n, delay_ms)| {
                let sent_ms = 10 * u64::from(n);
                let received = begun + Duration::from_millis(sent_ms + delay_ms);
                fresh.is_stale(n, clock_us.wrapping_add(1000 * sent_ms), received)
            })
            .collect()
    }

    #[test]
    fn a_frame_that_was_held_up_is_stale_whatever_the_clocks() {
        for clock_us in [0, 1_700_000_000_000_000, i64::MAX as u64 - 25_000, u64::MAX - 5000] {
            let mut fresh = Freshness::new(Some(5000));
            let found = stale(&mut fresh, clock_us, &[3, 2, 4, 7, 8, 2]);
            // Against the fastest frame, with 2 ms: 7 ms is 5 ms later, 8 ms is 6 ms later.
            assert_eq!(found, [false, false, false, false, true, false], "{clock_us}");
        }
    }

    /// The clock ticks every 16.7 ms. Frames at the end of a tick must not count as delayed.
    #[test]
    fn the_end_of_a_coarse_tick_is_not_held_up() {
        let mut fresh = Freshness::new(Some(5000));
        let begun = fresh.begun;
        let late = (0..300_u32).filter(|&n| {
            let sent_us = 11_111 * u64::from(n);
            let received = begun + Duration::from_micros(sent_us + 300);
            fresh.is_stale(n, sent_us / 16_667 * 16_667, received) && n > 40
        });
        assert_eq!(late.count(), 0);
    }

    #[test]
    fn clocks_may_drift_and_be_set() {
        let mut fresh = Freshness::new(Some(5000));
        let begun = fresh.begun;
        // 100 ppm for an hour: 360 ms in all, a frame a second.
        for n in 0..3600_u32 {
            let sent_us = 1_000_000 * u64::from(n);
            let received = begun + Duration::from_micros(sent_us + sent_us / 10_000);
            assert!(!fresh.is_stale(n, sent_us, received), "after {n} s");
        }
        // The clock is set back by a second. Frames are stale at first, until the new time is
        // accepted.
        let received = |n: u32| begun + Duration::from_millis(3_600_500 + u64::from(n));
        let stale = (0..100)
            .filter(|&n| {
                let time_us = 3_599_000_000 + 1000 * u64::from(n);
                fresh.is_stale(4000 + n, time_us, received(n))
            })
            .count();
        assert_eq!(stale, IN_A_ROW_MAX as usize);
    }
}
