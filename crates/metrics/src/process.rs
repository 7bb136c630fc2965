//! What the process takes of the machine, under the names every Prometheus client uses.
//!
//! Read from `/proc` when a scraper asks; on other systems these lines are left out.

use std::{
    fmt, fs,
    time::{SystemTime, UNIX_EPOCH},
};

use prometheus_client::{
    collector::Collector,
    encoding::{DescriptorEncoder, EncodeMetric},
    metrics::{counter::ConstCounter, gauge::ConstGauge},
};

/// Length of a clock tick in `/proc/self/stat`, s: 100 a second on every Linux machine.
const TICK_S: f64 = 0.01;

/// The collector.
#[derive(Debug)]
pub(crate) struct Process {
    started_s: f64,
}

impl Default for Process {
    fn default() -> Self {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Self { started_s: now.as_secs_f64() }
    }
}

/// Memory, descriptors and processor time of this process.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Usage {
    resident_bytes: u64,
    virtual_bytes: u64,
    open_fds: u64,
    cpu_s: f64,
}

impl Usage {
    /// None if the system has no such files.
    fn read() -> Option<Self> {
        let status = fs::read_to_string("/proc/self/status").ok()?;
        let bytes = |name: &str| {
            let line = status.lines().find_map(|line| line.strip_prefix(name))?;
            let kilobytes: u64 = line.trim().strip_suffix(" kB")?.trim().parse().ok()?;
            Some(kilobytes * 1024)
        };
        let stat = fs::read_to_string("/proc/self/stat").ok()?;
        // The second field, the name, may hold spaces; utime and stime are 14th and 15th.
        let (_, rest) = stat.rsplit_once(')')?;
        let mut ticks = rest.split_ascii_whitespace().skip(11).map(str::parse::<u64>);
        let cpu_ticks = ticks.next()?.ok()? + ticks.next()?.ok()?;
        Some(Self {
            resident_bytes: bytes("VmRSS:")?,
            virtual_bytes: bytes("VmSize:")?,
            open_fds: fs::read_dir("/proc/self/fd").ok()?.count() as u64,
            cpu_s: cpu_ticks as f64 * TICK_S,
        })
    }
}

/// Resident memory of this process, bytes; none if the system does not say.
#[must_use]
pub fn resident_bytes() -> Option<u64> {
    Usage::read().map(|usage| usage.resident_bytes)
}

impl Collector for Process {
    fn encode(&self, mut encoder: DescriptorEncoder<'_>) -> Result<(), fmt::Error> {
        let mut gauge = |name: &str, help: &str, value: f64| {
            let gauge = ConstGauge::new(value);
            gauge.encode(encoder.encode_descriptor(name, help, None, gauge.metric_type())?)
        };
        gauge("process_start_time_seconds", "When the process started, Unix time", self.started_s)?;
        let Some(usage) = Usage::read() else { return Ok(()) };
        let resident = usage.resident_bytes as f64;
        gauge("process_resident_memory_bytes", "Memory in use", resident)?;
        let reserved = usage.virtual_bytes as f64;
        gauge("process_virtual_memory_bytes", "Memory reserved", reserved)?;
        gauge("process_open_fds", "Open file descriptors", usage.open_fds as f64)?;
        let cpu = ConstCounter::new(usage.cpu_s);
        let help = "Processor time, user and system";
        cpu.encode(encoder.encode_descriptor(
            "process_cpu_seconds",
            help,
            None,
            cpu.metric_type(),
        )?)
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn usage_is_of_this_process() {
        let before = Usage::read().unwrap();
        let files = [(); 64].map(|()| fs::File::open("/proc/self/stat").unwrap());
        let block = vec![1_u8; 64 << 20];
        let after = Usage::read().unwrap();
        assert!(block.iter().all(|&byte| byte == 1));
        assert!(after.resident_bytes > before.resident_bytes + (32 << 20), "{before:?} {after:?}");
        // Other tests open and close files meanwhile, but not so many.
        assert!(after.open_fds > before.open_fds + 32, "{before:?} {after:?}");
        assert!(after.virtual_bytes >= after.resident_bytes);
        drop(files);
    }
}
