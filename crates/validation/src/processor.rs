//! Processor time: what work costs does not depend on what else the machine does.

/// Of this thread, s.
#[must_use]
pub fn thread_s() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Of all processes that this one has started and waited for, s; `None` where the system
/// does not say (it takes Linux).
#[must_use]
pub fn children_s() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The second field, in brackets, may hold spaces; cutime and cstime are the 14th and
    // 15th after it, in ticks of 10 ms.
    let fields = stat.rsplit_once(')')?.1.split_whitespace();
    let ticks: Option<f64> = fields.skip(13).take(2).map(|f| f.parse::<f64>().ok()).sum();
    ticks.map(|t| t / 100.0)
}
