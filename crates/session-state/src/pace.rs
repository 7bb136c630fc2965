//! Whether a client gives times in another unit than us.
//!
//! A live client's clock runs as fast as the clock here. If its times are in ms, it seems to run a
//! thousand times too slow, and if they are in ns, as much too fast. Series that are replayed may run at
//! any speed, so that only a pace within a hundredth of these two counts, over two seconds at least.

use std::time::{Duration, Instant};

/// How long a pace is measured.
const SPAN: Duration = Duration::from_secs(2);
/// Frames in a span: few say nothing of how times are made.
const FRAMES: u32 = 16;
/// Paces of times in ms and in ns.
const OTHER_UNITS: [f64; 2] = [1e-3, 1e3];
/// Share of such a pace by which one may differ from it: frames do not come evenly.
const NEAR: f64 = 0.01;

/// How fast the times in a client's frames rise.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pace {
    /// The first frame of the span: its stamp, us, when it came, and how many came since.
    first: Option<(u64, Instant, u32)>,
    is_of_another_unit: bool,
}

impl Pace {
    /// Takes the stamp of a frame that came at `now`.
    pub fn take(&mut self, stamp_us: u64, now: Instant) {
        let Some((first_us, begun, frames)) = &mut self.first else {
            self.first = Some((stamp_us, now, 0));
            return;
        };
        *frames += 1;
        let passed = now.saturating_duration_since(*begun);
        let Some(rise_us) = stamp_us.checked_sub(*first_us) else {
            // The clock was set.
            return self.forget();
        };
        if passed < SPAN || *frames < FRAMES {
            return;
        }
        let pace = rise_us as f64 / (1e6 * passed.as_secs_f64());
        self.is_of_another_unit = OTHER_UNITS.iter().any(|other| (pace / other - 1.0).abs() < NEAR);
        self.first = Some((stamp_us, now, 0));
    }

    /// Whether the times of the last span were in ms or ns.
    #[must_use]
    pub fn is_of_another_unit(&self) -> bool {
        self.is_of_another_unit
    }

    /// Nothing is known of the frames that come now.
    pub fn forget(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames at `hz` for three spans, stamped in units of `unit_us`, that are `late_us` late every
    /// third time: which of them were of another unit.
    fn told(hz: f64, unit_us: f64, late_us: f64, speed: f64) -> Vec<bool> {
        let (begun, mut pace) = (Instant::now(), Pace::default());
        let frame = |n: u32| {
            let sent_us = 1e6 * f64::from(n) / hz;
            let late_us = if n % 3 == 1 { late_us } else { 0.0 };
            pace.take(
                (5e15 + speed * sent_us / unit_us) as u64,
                begun + Duration::from_secs_f64(1e-6 * (sent_us + late_us)),
            );
            pace.is_of_another_unit()
        };
        (0..(3.0 * SPAN.as_secs_f64() * hz) as u32).map(frame).collect()
    }

    #[test]
    fn times_in_ms_or_ns_are_found_within_two_spans() {
        for (unit_us, is_wrong) in [(1.0, false), (1e3, true), (1e-3, true)] {
            for hz in [30.0, 90.0, 1000.0] {
                for late_us in [0.0, 4000.0] {
                    let told = told(hz, unit_us, late_us, 1.0);
                    let span = told.len() / 3;
                    assert!(told[..9 * span / 10].iter().all(|t| !t), "{unit_us} us, {hz} Hz");
                    let after = told[2 * span..].iter().all(|t| *t == is_wrong);
                    assert!(after, "{unit_us} us, {hz} Hz, {late_us} us late");
                }
            }
        }
    }

    #[test]
    fn a_series_is_replayed_at_any_speed() {
        for speed in [0.0, 2e-3, 0.01, 0.1, 10.0, 100.0, 980.0, 1020.0, 5000.0] {
            assert!(told(200.0, 1.0, 500.0, speed).iter().all(|t| !t), "{speed} times");
        }
    }

    #[test]
    fn few_frames_tell_nothing_and_a_clock_that_is_set_begins_anew() {
        assert!(told(2.5, 1e3, 0.0, 1.0).iter().all(|t| !t), "15 frames in 6 s");
        let (begun, mut pace) = (Instant::now(), Pace::default());
        let at = |ms: u64| begun + Duration::from_millis(ms);
        (0..300).for_each(|n| pace.take(1000 + 10 * n, at(10 * n)));
        assert!(pace.is_of_another_unit());
        pace.take(0, at(3000));
        assert!(!pace.is_of_another_unit());
        (1..300).for_each(|n| pace.take(10_000 * n, at(3000 + 10 * n)));
        assert!(!pace.is_of_another_unit());
    }
}
