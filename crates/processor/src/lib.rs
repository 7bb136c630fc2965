//! Processor time of a thread (what work costs does not depend on what else the machine does), which
//! processor this is, and the line of a report that says when and on what it was made.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Processor time of this thread. Unlike wall time it does not count interruptions, which are
/// frequent on a busy machine. Where the system does not tell it (Windows), wall time is used.
#[cfg(unix)]
#[must_use]
pub fn thread_time() -> Duration {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    let seconds = u64::try_from(now.tv_sec).unwrap_or_default();
    Duration::new(seconds, u32::try_from(now.tv_nsec).unwrap_or_default())
}

/// Wall time since the first call, since the system does not tell the thread's own time.
#[cfg(not(unix))]
#[must_use]
pub fn thread_time() -> Duration {
    static BEGUN: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    BEGUN.get_or_init(std::time::Instant::now).elapsed()
}

/// [`thread_time`], s.
#[must_use]
pub fn thread_s() -> f64 {
    thread_time().as_secs_f64()
}

/// Name, family and model of the processor, as Linux tells them; `unknown` elsewhere. A virtual
/// machine may tell no more than the maker by name; family and model then say which it is.
#[must_use]
pub fn described() -> String {
    let [name, family, model] =
        ["model name", "cpu family", "model"].map(|key| entry(key).unwrap_or("unknown".into()));
    format!("{name} (family {family}, model {model})")
}

/// Date (UTC) and processor, for the pages of reports.
#[must_use]
pub fn today_here() -> String {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let [year, month, day] = date((since.as_secs() / 86_400) as i64);
    let name = entry("model name").unwrap_or(std::env::consts::ARCH.into());
    format!("{year}-{month:02}-{day:02}, {name}")
}

/// What Linux tells of the first core under this name.
fn entry(key: &str) -> Option<String> {
    let info = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let mut entries = info.lines().filter_map(|line| line.split_once(':'));
    entries.find(|(name, _)| name.trim() == key).map(|(_, value)| value.trim().to_owned())
}

/// Year, month and day of a day since 1970-01-01 (Hinnant, 'chrono-compatible low-level date
/// algorithms': `civil_from_days`).
fn date(days: i64) -> [i64; 3] {
    let z = days + 719_468;
    let (era, of_era) = (z.div_euclid(146_097), z.rem_euclid(146_097));
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let shifted = (5 * of_year + 2) / 153;
    let month = if shifted < 10 { shifted + 3 } else { shifted - 9 };
    [year + era * 400 + i64::from(month <= 2), month, of_year - (153 * shifted + 2) / 5 + 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_have_dates() {
        for (days, expected) in [
            (0, [1970, 1, 1]),
            (59, [1970, 3, 1]),
            (11_016, [2000, 2, 29]),
            (20_780, [2026, 11, 23]),
            (47_540, [2100, 2, 28]),
            (47_541, [2100, 3, 1]),
        ] {
            assert_eq!(date(days), expected, "{days}");
        }
    }
}
