//! How long a tier takes on this machine, as calibration and frames measure it.

use std::{
    sync::OnceLock,
    sync::atomic::{AtomicU32, AtomicU64, AtomicUsize, Ordering},
    time::Duration,
};

use papilla_engine::ladder::Percentiles;
use papilla_proto::MAP_SIDE_PX;

/// What decoding, encoding and handing over add to an inference, us, until a calibration has
/// measured it.
const OVERHEAD_US: u64 = 500;

/// Number of last runs whose median is the typical time of a tier: eight slow runs change it.
const WINDOW: usize = 16;
/// Of this many frames in a row that are expected to be late, one is rendered all the same.
const PROBE_EVERY: u32 = 16;

/// How long the inference of a tier takes on this machine.
#[derive(Debug)]
pub(crate) struct Latency {
    fastest_us: AtomicU64,
    /// The time stated in the card or ladder that came with the model; 0: none.
    expected_us: AtomicU64,
    /// Times of the last runs. Until there are enough, the other places hold the expected or
    /// calibrated time.
    window_us: [AtomicU64; WINDOW],
    runs: AtomicUsize,
    /// `runs` at the last call of [`is_idle`](Self::is_idle).
    runs_seen: AtomicUsize,
    /// Number of frames since the last run that were expected to be late.
    expected_late: AtomicU32,
    calibrated_us: OnceLock<Percentiles>,
}

impl Default for Latency {
    fn default() -> Self {
        Self {
            fastest_us: AtomicU64::new(u64::MAX),
            expected_us: AtomicU64::new(0),
            window_us: [const { AtomicU64::new(0) }; WINDOW],
            runs: AtomicUsize::new(0),
            runs_seen: AtomicUsize::new(0),
            expected_late: AtomicU32::new(0),
            calibrated_us: OnceLock::new(),
        }
    }
}

impl Latency {
    /// Sets the time that is expected before any run: the shipped one.
    pub(crate) fn expect(&self, time: Duration) {
        self.expected_us.store(us(time), Ordering::Relaxed);
        self.fill(us(time));
    }

    /// The shipped time, us; if there is none, the typical time.
    pub(crate) fn expected_us(&self) -> u64 {
        match self.expected_us.load(Ordering::Relaxed) {
            0 => self.typical_us().max(1),
            us => us,
        }
    }

    /// Typical time over shipped time.
    pub(crate) fn slowdown(&self) -> f64 {
        self.typical_us() as f64 / self.expected_us() as f64
    }

    /// The fastest run on this machine, us; None before the first run.
    pub(crate) fn fastest_us(&self) -> Option<u64> {
        Some(self.fastest_us.load(Ordering::Relaxed)).filter(|&us| us < u64::MAX)
    }

    /// Whether at least one run on this machine has been timed.
    pub(crate) fn is_measured(&self) -> bool {
        self.fastest_us().is_some()
    }

    fn fill(&self, us: u64) {
        self.window_us.iter().for_each(|place| place.store(us, Ordering::Relaxed));
    }

    /// Takes the times of the calibration in place of what was expected.
    pub(crate) fn calibrate(&self, times: &mut [Duration]) {
        times.sort_unstable();
        let (Some(first), Some(last)) = (times.first(), times.last()) else { return };
        let middle = times[times.len() / 2];
        let high = times.get(times.len() * 99 / 100).unwrap_or(last);
        self.fastest_us.fetch_min(us(*first), Ordering::Relaxed);
        self.fill(us(middle));
        let _ =
            self.calibrated_us.set(Percentiles { p50: us(middle) as f64, p99: us(*high) as f64 });
    }

    /// Takes the times of a later measurement if they are shorter. Longer ones say only that the
    /// machine is busier now; a shorter one shows that the tier can be that fast.
    pub(crate) fn correct(&self, times: &mut [Duration]) {
        times.sort_unstable();
        let (Some(first), Some(middle)) = (times.first(), times.get(times.len() / 2)) else {
            return;
        };
        self.fastest_us.fetch_min(us(*first), Ordering::Relaxed);
        if us(*middle) < self.typical_us() {
            self.fill(us(*middle));
        }
    }

    /// Whether no frame has been timed since the last call.
    pub(crate) fn is_idle(&self) -> bool {
        let runs = self.runs.load(Ordering::Relaxed);
        self.runs_seen.swap(runs, Ordering::Relaxed) == runs
    }

    /// Whether the typical time is more than one and a half times the fastest run.
    pub(crate) fn has_been_faster(&self) -> bool {
        self.fastest_us().is_some_and(|us| self.typical_us() > us + us / 2)
    }

    /// Whether any frame has been timed.
    pub(crate) fn is_used(&self) -> bool {
        self.runs.load(Ordering::Relaxed) > 0
    }

    /// Records the time of a frame's inference.
    pub(crate) fn learn(&self, time: Duration) {
        let us = us(time);
        self.fastest_us.fetch_min(us, Ordering::Relaxed);
        let run = self.runs.fetch_add(1, Ordering::Relaxed);
        self.window_us[run % WINDOW].store(us, Ordering::Relaxed);
        self.expected_late.store(0, Ordering::Relaxed);
    }

    /// Whether a frame with `left` until its deadline should be dropped, since no run can be
    /// expected to end in time: `left` is at most half of the fastest run. The half is there so
    /// that one lucky run on an idle machine does not condemn frames that could be in time.
    ///
    /// One frame in [`PROBE_EVERY`] is let through all the same. Otherwise a tier whose frames are
    /// all dropped would never be timed again, and a time taken on a busy machine would stand for
    /// good.
    pub(crate) fn will_miss(&self, left: Duration) -> bool {
        if left.is_zero() {
            return true;
        }
        let is_enough = match self.fastest_us.load(Ordering::Relaxed) {
            u64::MAX => true,
            fastest_us => left > Duration::from_micros(fastest_us / 2),
        };
        !is_enough
            && self.expected_late.fetch_add(1, Ordering::Relaxed) % PROBE_EVERY != PROBE_EVERY - 1
    }

    /// The median of the last runs, us.
    pub(crate) fn typical_us(&self) -> u64 {
        let mut window = [0; WINDOW];
        for (time, place) in window.iter_mut().zip(&self.window_us) {
            *time = place.load(Ordering::Relaxed);
        }
        *window.select_nth_unstable(WINDOW / 2).1
    }

    /// The percentiles that the calibration found, us; None if the tier was not calibrated.
    pub(crate) fn calibrated_us(&self) -> Option<Percentiles> {
        self.calibrated_us.get().copied()
    }
}

/// Whole microseconds, at least one.
pub(crate) fn us(time: Duration) -> u64 {
    u64::try_from(time.as_micros()).unwrap_or(u64::MAX).max(1)
}

/// What decoding, encoding and handing over add to an inference, us.
#[derive(Debug)]
pub(crate) struct Overhead(AtomicU64);

impl Default for Overhead {
    fn default() -> Self {
        Self(AtomicU64::new(OVERHEAD_US))
    }
}

impl Overhead {
    pub(crate) fn us(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }

    /// Sets what a calibration has measured.
    pub(crate) fn set_us(&self, us: u64) {
        self.0.store(us, Ordering::Relaxed);
    }
}

/// Fills in the map that tiers and effects are timed on: a round contact whose peak is half of the
/// greatest pressure of the training.
pub(crate) fn probe_map(pressure_max_pa: f32, pressure_pa: &mut [f32]) {
    let half = MAP_SIDE_PX as f32 / 2.0;
    for (i, pressure_pa) in pressure_pa.iter_mut().enumerate() {
        let (row, column) = ((i / MAP_SIDE_PX) as f32, (i % MAP_SIDE_PX) as f32);
        let squared = ((row - half).powi(2) + (column - half).powi(2)) / (0.4 * half).powi(2);
        *pressure_pa = 0.5 * pressure_max_pa * (1.0 - squared).max(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    #[test]
    fn a_calibration_replaces_what_was_shipped() {
        let latency = Latency::default();
        assert_eq!((latency.typical_us(), latency.will_miss(ms(1))), (0, false));
        latency.expect(Duration::from_micros(900));
        assert_eq!((latency.typical_us(), latency.calibrated_us()), (900, None));
        let mut times: Vec<Duration> = (1..=100).rev().map(Duration::from_micros).collect();
        latency.calibrate(&mut times);
        assert_eq!(latency.typical_us(), 51);
        assert_eq!(latency.calibrated_us(), Some(Percentiles { p50: 51.0, p99: 100.0 }));
    }

    /// The machine was busy while the tier was measured: 40 ms, where it takes 10.
    #[test]
    fn a_disturbed_calibration_does_not_last() {
        let latency = Latency::default();
        latency.calibrate(&mut [ms(40); 3]);
        assert_eq!(latency.typical_us(), 40_000);
        // With 15 ms left frames are expected to be late, and one in a few is tried.
        let tried = (0..64).filter(|_| !latency.will_miss(ms(15))).count();
        assert_eq!(tried, 4);
        latency.learn(ms(10));
        assert!((0..64).all(|_| !latency.will_miss(ms(15))));
        assert!((0..8).all(|_| latency.will_miss(ms(4))), "half of 10 ms is not there");
        assert!((0..64).all(|_| latency.will_miss(Duration::ZERO)), "the deadline has passed");
        // Real frames take the place of the calibration, and a hiccup does not count.
        (0..WINDOW).for_each(|_| latency.learn(ms(10)));
        latency.learn(ms(2000));
        assert_eq!(latency.typical_us(), 10_000);
    }

    #[test]
    fn a_second_look_finds_what_a_busy_start_has_hidden() {
        let latency = Latency::default();
        latency.calibrate(&mut [ms(40); 3]);
        latency.correct(&mut [ms(50), ms(60)]);
        assert_eq!(latency.typical_us(), 40_000, "busier than at the start");
        latency.correct(&mut [ms(9), ms(10)]);
        assert_eq!(latency.typical_us(), 10_000);
        assert!(!latency.will_miss(ms(5)), "half of 9 ms is there");
        // Frames know better, while there are any.
        assert!(latency.is_idle());
        (0..WINDOW).for_each(|_| latency.learn(ms(40)));
        assert!(!latency.is_idle() && latency.is_idle() && latency.has_been_faster());
        latency.correct(&mut [ms(10), ms(10)]);
        assert!(latency.typical_us() == 10_000 && !latency.has_been_faster());
    }
}
