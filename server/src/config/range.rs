//! The range of each number among the settings. It is checked where the number is read, and again
//! when the service starts.

use std::{ops::RangeInclusive, str::FromStr};

use papilla_metrics::BUNDLES_MAX;

use super::{Config, SettingError};

/// Each place for a session or a posted map takes some MiB.
pub(super) const PLACES: RangeInclusive<u64> = 1..=10_000;
/// With the default finger all places that there are for fingers.
pub(super) const LOADED_FINGERS: RangeInclusive<u64> = 1..=BUNDLES_MAX as u64 - 1;
/// More than a system gives one process as file descriptors unasked.
pub(super) const CONNECTIONS: RangeInclusive<u64> = 1..=100_000;
pub(super) const THREADS: RangeInclusive<u64> = 1..=1024;
/// Up to ten minutes.
pub(super) const CALIBRATION_MS: RangeInclusive<u64> = 0..=600_000;
pub(super) const RATE_PER_S: RangeInclusive<u64> = 0..=1_000_000;
pub(super) const RATE_BURST: RangeInclusive<u64> = 1..=1_000_000;
/// Up to a day.
pub(super) const TIMEOUT_S: RangeInclusive<u64> = 1..=86_400;
/// Up to a day; 0 asks nobody.
pub(super) const RECONNECT_S: RangeInclusive<u64> = 0..=86_400;
/// Up to a day; 0 waits for nobody.
pub(super) const DRAIN_S: RangeInclusive<u64> = 0..=86_400;

/// Reads a whole number of `range`.
///
/// # Errors
/// It is none; the range is named.
pub(super) fn parse<T: FromStr>(text: &str, range: &RangeInclusive<u64>) -> Result<T, String> {
    let number = text.parse::<u64>().ok().filter(|number| range.contains(number));
    number.and_then(|_| text.parse().ok()).ok_or_else(|| due(range))
}

fn due(range: &RangeInclusive<u64>) -> String {
    format!("a whole number from {} to {} is due", range.start(), range.end())
}

/// Checks the numbers of settings that no layer has read.
///
/// # Errors
/// The first setting beyond its range; the range is named.
pub(super) fn check(config: &Config) -> Result<(), SettingError> {
    let count = |number: usize| u64::try_from(number).unwrap_or(u64::MAX);
    for (field, value, range) in [
        ("max_sessions", count(config.max_sessions.get()), PLACES),
        ("max_fingers", count(config.max_fingers.get()), PLACES),
        ("max_loaded_fingers", count(config.max_loaded_fingers.get()), LOADED_FINGERS),
        ("max_requests", count(config.max_requests.get()), PLACES),
        ("max_connections", count(config.max_connections.get()), CONNECTIONS),
        ("threads", count(config.threads.map_or(1, |threads| threads.get())), THREADS),
        ("calibration_ms", config.calibration_ms, CALIBRATION_MS),
        ("rate_per_s", config.rate_per_s.into(), RATE_PER_S),
        ("rate_burst", config.rate_burst.map_or(1, |burst| burst.get().into()), RATE_BURST),
        ("reconnect_after_s", config.reconnect_after_s, RECONNECT_S),
        ("io_timeout_s", config.io_timeout_s, TIMEOUT_S),
        ("idle_timeout_s", config.idle_timeout_s, TIMEOUT_S),
        ("drain_timeout_s", config.drain_timeout_s, DRAIN_S),
    ] {
        if !range.contains(&value) {
            return Err(SettingError { field, reason: format!("not {value}; {}", due(&range)) });
        }
    }
    Ok(())
}
