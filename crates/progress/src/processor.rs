//! Processor time (what work costs does not depend on what else the machine does), and the line of
//! a report that says when and on what it was made.

use std::time::{SystemTime, UNIX_EPOCH};

/// Date (UTC) and processor, for the pages of reports.
#[must_use]
pub fn today_here() -> String {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let [year, month, day] = date((since.as_secs() / 86_400) as i64);
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info
        .lines()
        .find_map(|line| line.strip_prefix("model name")?.split_once(':'))
        .map_or(std::env::consts::ARCH, |(_, name)| name.trim());
    format!("{year}-{month:02}-{day:02}, {name}")
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

/// Of this thread, s. Where the system does not tell (Windows), time that has passed.
#[cfg(unix)]
#[must_use]
pub fn thread_s() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Since this was first asked, s: the system does not tell the thread's own.
#[cfg(not(unix))]
#[must_use]
pub fn thread_s() -> f64 {
    static BEGUN: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    BEGUN.get_or_init(std::time::Instant::now).elapsed().as_secs_f64()
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
