//! Time that a thread had of a processor. What others took of it meanwhile is no session's fault.

use std::time::Duration;

/// Processor time of the calling thread.
#[cfg(unix)]
pub(super) fn thread_time() -> Duration {
    use rustix::time::{ClockId, clock_gettime};

    let time = clock_gettime(ClockId::ThreadCPUTime);
    let seconds = u64::try_from(time.tv_sec).unwrap_or_default();
    Duration::from_secs(seconds) + Duration::from_nanos(time.tv_nsec.unsigned_abs())
}

/// Where threads are not timed: time since the first call.
#[cfg(not(unix))]
pub(super) fn thread_time() -> Duration {
    use std::{sync::OnceLock, time::Instant};

    static BEGUN: OnceLock<Instant> = OnceLock::new();
    BEGUN.get_or_init(Instant::now).elapsed()
}
