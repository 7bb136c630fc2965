//! What the host of a virtual machine withholds while a load runs: a frame whose core is not there
//! is late, whatever the service does.

use std::fs;

/// Processor time of all cores, in the system's ticks; none where it counts none (not Linux).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Ticks {
    pub(super) all: u64,
    pub(super) stolen: u64,
}

impl Ticks {
    /// Since the machine started.
    pub(super) fn now() -> Self {
        fs::read_to_string("/proc/stat")
            .ok()
            .and_then(|stat| Self::parse(&stat))
            .unwrap_or_default()
    }

    /// `cpu user nice system idle iowait irq softirq steal ...`, see proc_stat(5); guests' time is
    /// in the first two already.
    fn parse(stat: &str) -> Option<Self> {
        let line = stat.lines().find_map(|line| line.strip_prefix("cpu "))?;
        let ticks: Vec<u64> = line.split_whitespace().map_while(|n| n.parse().ok()).collect();
        Some(Self { all: ticks.get(..8)?.iter().sum(), stolen: ticks[7] })
    }

    pub(super) fn since(self, before: Self) -> Self {
        Self {
            all: self.all.saturating_sub(before.all),
            stolen: self.stolen.saturating_sub(before.stolen),
        }
    }

    /// Share that was withheld, percent; none of no time.
    pub(super) fn stolen_percent(self) -> Option<f64> {
        (self.all > 0).then(|| 100.0 * self.stolen as f64 / self.all as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_is_of_all_time_that_passed() {
        let at = |text: &str| Ticks::parse(text).unwrap();
        let before = at("cpu  100 0 50 800 10 0 0 40 7 0\ncpu0 1 2 3 4 5 6 7 8\n");
        let after = at("cpu  150 10 50 900 10 10 20 50 7 0\n");
        let percent = after.since(before).stolen_percent().unwrap();
        assert!((percent - 5.0).abs() < 1e-9, "{percent}");
        assert_eq!(after.since(after).stolen_percent(), None);
        for bad in ["", "cpu0 1 2 3 4 5 6 7 8\n", "cpu 1 2 3\n", "cpu 1 2 3 x 5 6 7 8\n"] {
            assert_eq!(Ticks::parse(bad), None, "{bad:?}");
        }
    }
}
