//! How long each tier takes on this machine: calibrated at the start, then learnt from its runs.

use std::{
    sync::OnceLock,
    sync::atomic::{AtomicU64, Ordering},
    time::{Duration, Instant},
};

use bytes::BytesMut;
use papilla_engine::ladder::Percentiles;
use papilla_proto::{MAP_LEN, MAP_SIDE_PX, SampleType, check_pressure};

use crate::{
    StartError,
    codec::{self, Input, Map, Output, Quantity},
    effects,
    models::{Catalogue, Tier},
};

/// Runs of one tier after which its times are known well enough.
const RUNS_MAX: usize = 300;
/// Timed runs of a tier however slow it is.
const RUNS_MIN: usize = 2;
/// What handing a frame from socket to thread and back adds, us; seen on a virtual machine.
const HAND_OVER_US: u64 = 120;
/// What decoding, encoding and handing over add where no calibration has measured it, us.
const OVERHEAD_US: u64 = 500;

/// How long the inference of a tier takes on this machine.
#[derive(Debug)]
pub(crate) struct Speed {
    fastest_us: AtomicU64,
    typical_us: AtomicU64,
    calibrated_us: OnceLock<Percentiles>,
}

impl Default for Speed {
    fn default() -> Self {
        Self {
            fastest_us: AtomicU64::new(u64::MAX),
            typical_us: AtomicU64::new(0),
            calibrated_us: OnceLock::new(),
        }
    }
}

impl Speed {
    /// What to expect before any run: the shipped time.
    pub(crate) fn expect(&self, time: Duration) {
        self.typical_us.store(us(time), Ordering::Relaxed);
    }

    /// Takes the times of the calibration in place of what was expected.
    fn calibrate(&self, times: &mut [Duration]) {
        times.sort_unstable();
        let (Some(first), Some(last)) = (times.first(), times.last()) else { return };
        let middle = times[times.len() / 2];
        let high = times.get(times.len() * 99 / 100).unwrap_or(last);
        self.fastest_us.store(us(*first), Ordering::Relaxed);
        self.typical_us.store(us(middle), Ordering::Relaxed);
        let _ =
            self.calibrated_us.set(Percentiles { p50: us(middle) as f64, p99: us(*high) as f64 });
    }

    /// Takes note of one run.
    pub(crate) fn learn(&self, time: Duration) {
        let us = us(time);
        self.fastest_us.fetch_min(us, Ordering::Relaxed);
        // Threads may overwrite each other's update; a lost one does not matter to a mean.
        let typical = match self.typical_us.load(Ordering::Relaxed) {
            0 => us,
            old => (old * 15 + us) / 16,
        };
        self.typical_us.store(typical.max(1), Ordering::Relaxed);
    }

    /// Less time than any run took so far: half the fastest, so that one lucky
    /// run on an idle machine does not condemn a frame that could be in time.
    pub(crate) fn floor(&self) -> Duration {
        match self.fastest_us.load(Ordering::Relaxed) {
            u64::MAX => Duration::ZERO,
            us => Duration::from_micros(us / 2),
        }
    }

    /// A running mean, us.
    pub(crate) fn typical_us(&self) -> u64 {
        self.typical_us.load(Ordering::Relaxed)
    }

    /// What the calibration found, us; none if there was none.
    pub(crate) fn calibrated_us(&self) -> Option<Percentiles> {
        self.calibrated_us.get().copied()
    }
}

fn us(time: Duration) -> u64 {
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
}

/// A round press, half as hard as the tier was trained for.
pub(crate) fn round_press(pressure_max_pa: f32, pressure_pa: &mut [f32]) {
    let half = MAP_SIDE_PX as f32 / 2.0;
    for (i, pressure_pa) in pressure_pa.iter_mut().enumerate() {
        let (row, column) = ((i / MAP_SIDE_PX) as f32, (i % MAP_SIDE_PX) as f32);
        let squared = ((row - half).powi(2) + (column - half).powi(2)) / (0.4 * half).powi(2);
        *pressure_pa = 0.5 * pressure_max_pa * (1.0 - squared).max(0.0);
    }
}

/// Measures on this thread every tier that was not measured yet, in about `time` altogether: an
/// equal share each, but never less than [`RUNS_MIN`] runs after one that warms it.
///
/// With no time, the shipped times stand.
///
/// # Errors
/// A tier does not run.
pub(crate) fn calibrate(catalogue: &Catalogue, time: Duration) -> Result<(), StartError> {
    if time.is_zero() {
        return Ok(());
    }
    let new = || catalogue.tiers.iter().filter(|tier| tier.speed.calibrated_us().is_none());
    let share = time / u32::try_from(new().count()).unwrap_or(u32::MAX).max(1);
    for tier in new() {
        let mut times = runs(tier, share)?;
        tier.speed.calibrate(&mut times);
        tracing::info!(tier = %tier.name, typical_us = tier.speed.typical_us(), runs = times.len(), "calibrated");
    }
    if let Some(codec_us) = codec_us() {
        catalogue.overhead.0.store(codec_us + HAND_OVER_US, Ordering::Relaxed);
    }
    effects::measure(catalogue);
    Ok(())
}

fn runs(tier: &Tier, share: Duration) -> Result<Vec<Duration>, StartError> {
    let failed = |source| StartError::Engine { tier: tier.name.clone(), source };
    let [mut pressure_pa, mut sed_j_per_m3] = [0, 1].map(|_| vec![0.0; MAP_LEN]);
    let begun = Instant::now();
    let mut session = tier.warm_session(&mut pressure_pa, &mut sed_j_per_m3)?;
    let mut times = Vec::new();
    while times.len() < RUNS_MIN || (times.len() < RUNS_MAX && begun.elapsed() < share) {
        let start = Instant::now();
        session.infer(&pressure_pa, &mut sed_j_per_m3).map_err(failed)?;
        times.push(start.elapsed());
    }
    Ok(times)
}

/// Time of decoding, checking and encoding one f32 map, us: the least of several.
fn codec_us() -> Option<u64> {
    let mut map = vec![0.0; MAP_LEN];
    round_press(1e4, &mut map);
    let payload: Vec<u8> = map.iter().flat_map(|value| value.to_le_bytes()).collect();
    let mut buffer = BytesMut::with_capacity(payload.len());
    let samples = Output::Samples(SampleType::F32);
    let input = Input::Samples { sample_type: SampleType::F32, scale: 1.0 };
    let mut least: Option<Duration> = None;
    for _ in 0..8 {
        let start = Instant::now();
        codec::decode(input, &payload, &mut map).ok()?;
        check_pressure(&map, 1e4).ok()?;
        buffer.clear();
        let sed = Map { quantity: Quantity::Sed, values: &map, value_max: 1e4, source: "" };
        codec::encode(samples, sed, &mut buffer).ok()?;
        let time = start.elapsed();
        least = Some(least.map_or(time, |least| least.min(time)));
    }
    least.map(us)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_calibration_replaces_what_was_shipped_and_runs_are_learnt_from() {
        let speed = Speed::default();
        assert_eq!((speed.typical_us(), speed.floor()), (0, Duration::ZERO));
        speed.expect(Duration::from_micros(900));
        assert_eq!((speed.typical_us(), speed.calibrated_us()), (900, None));
        let mut times: Vec<Duration> = (1..=100).rev().map(Duration::from_micros).collect();
        speed.calibrate(&mut times);
        assert_eq!(speed.typical_us(), 51);
        assert_eq!(speed.calibrated_us(), Some(Percentiles { p50: 51.0, p99: 100.0 }));
        speed.learn(Duration::from_micros(211));
        assert_eq!(speed.typical_us(), 61);
        assert_eq!(speed.floor(), Duration::ZERO, "half of 1 us");
    }

    #[test]
    fn the_codec_can_be_timed() {
        assert!(codec_us().is_some_and(|us| us > 0));
    }
}
