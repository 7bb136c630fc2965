//! Measures the time of the tiers: at the start, at a reload, and again while nobody is served.

use std::time::{Duration, Instant};

use bytes::BytesMut;
use papilla_codec::{Input, Map, Output, Quantity, decode, encode};
use papilla_engine::Model;
use papilla_proto::{MAP_LEN, SampleType, check_pressure};
use papilla_session_effects as effects;

use super::{Catalogue, Tier};
use crate::{
    StartError,
    core::latency::{probe_map, us},
};

/// The most timed runs of one tier.
const RUNS_MAX: usize = 300;
/// The fewest timed runs of one tier, however slow it is.
const RUNS_MIN: usize = 2;
/// What handing a frame from the socket to a thread and back adds, us; measured on a virtual
/// machine.
const HAND_OVER_US: u64 = 120;

/// Times every loaded tier that was not calibrated yet, on this thread and in about `time`
/// altogether. Each gets an equal share, but never less than [`RUNS_MIN`] runs after one that warms
/// it up.
///
/// With zero `time` nothing is measured, and the shipped times stand.
///
/// # Errors
/// A tier does not run.
pub(crate) fn calibrate(catalogue: &Catalogue, time: Duration) -> Result<(), StartError> {
    calibrate_noting(catalogue, time, &mut |_| ())
}

/// As [`calibrate`], and calls `note` with the name of each tier when it is done. The tiers that
/// are expected to be the fastest come first.
///
/// # Errors
/// A tier does not run.
pub(crate) fn calibrate_noting(
    catalogue: &Catalogue,
    time: Duration,
    note: &mut dyn FnMut(&str),
) -> Result<(), StartError> {
    if time.is_zero() {
        return Ok(());
    }
    let begun = Instant::now();
    let is_new = |tier: &&Tier| tier.is_loaded() && tier.latency.calibrated_us().is_none();
    let mut new: Vec<&Tier> = catalogue.tiers.iter().filter(is_new).collect();
    new.sort_by_key(|tier| tier.latency.typical_us());
    let share = time / u32::try_from(new.len()).unwrap_or(u32::MAX).max(1);
    let mut found = Vec::with_capacity(new.len());
    for tier in new {
        let Some(model) = tier.model() else { continue };
        measure(tier, model.as_ref(), share)?;
        let (us, backend) = (tier.latency.typical_us(), &model.info().backend);
        found.push(format!("{} {us} us in {backend}", tier.name));
        note(&tier.name);
    }
    if let Some(codec_us) = codec_us() {
        catalogue.overhead.set_us(codec_us + HAND_OVER_US);
    }
    measure_effects(catalogue);
    tracing::info!(
        tiers = found.join(", "),
        overhead_us = catalogue.overhead.us(),
        took_ms = begun.elapsed().as_millis(),
        "calibrated"
    );
    Ok(())
}

/// Measures what each effect costs on this finger.
pub(crate) fn measure_effects(catalogue: &Catalogue) {
    let pressure_max_pa = catalogue.tiers.first().map_or(1.0, |tier| tier.pressure_max_pa);
    let mut contact_pa = vec![0.0; MAP_LEN];
    probe_map(pressure_max_pa, &mut contact_pa);
    effects::measure(catalogue.finger(), &contact_pa);
}

/// Times a tier with its model, in about `share`.
///
/// # Errors
/// The tier does not run.
pub(crate) fn measure(tier: &Tier, model: &dyn Model, share: Duration) -> Result<(), StartError> {
    tier.latency.calibrate(&mut runs(tier, model, share)?);
    Ok(())
}

/// Times a tier again if it is loaded and no frame of it has been timed since the last call.
///
/// # Errors
/// The tier does not run.
pub(crate) fn remeasure(tier: &Tier) -> Result<(), StartError> {
    if let Some(model) = tier.model().filter(|_| tier.latency.is_idle()) {
        tier.latency.correct(&mut runs(tier, model.as_ref(), Duration::ZERO)?);
    }
    Ok(())
}

fn runs(tier: &Tier, model: &dyn Model, share: Duration) -> Result<Vec<Duration>, StartError> {
    let failed = |source| StartError::Engine { tier: tier.name.clone(), source };
    let [mut pressure_pa, mut sed_j_per_m3] = [0, 1].map(|_| vec![0.0; MAP_LEN]);
    let begun = Instant::now();
    let mut session = tier.warm_session(model, &mut pressure_pa, &mut sed_j_per_m3)?;
    let mut times = Vec::new();
    while times.len() < RUNS_MIN || (times.len() < RUNS_MAX && begun.elapsed() < share) {
        let start = Instant::now();
        session.infer(&pressure_pa, &mut sed_j_per_m3).map_err(failed)?;
        times.push(start.elapsed());
    }
    Ok(times)
}

/// Time of decoding, checking and encoding one f32 map, us: the least of eight runs.
fn codec_us() -> Option<u64> {
    let mut map = vec![0.0; MAP_LEN];
    probe_map(1e4, &mut map);
    let payload: Vec<u8> = map.iter().flat_map(|value| value.to_le_bytes()).collect();
    let mut buffer = BytesMut::with_capacity(payload.len());
    let samples = Output::Samples(SampleType::F32);
    let input = Input::Samples { sample_type: SampleType::F32, scale: 1.0 };
    let mut least: Option<Duration> = None;
    for _ in 0..8 {
        let start = Instant::now();
        decode(input, &payload, &mut map).ok()?;
        check_pressure(&map, 1e4).ok()?;
        buffer.clear();
        let sed = Map { quantity: Quantity::Sed, values: &map, source: "" };
        encode(samples, sed, &mut buffer).ok()?;
        let time = start.elapsed();
        least = Some(least.map_or(time, |least| least.min(time)));
    }
    least.map(us)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_codec_can_be_timed() {
        assert!(codec_us().is_some_and(|us| us > 0));
    }
}
