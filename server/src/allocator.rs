//! The allocator, and how it gives memory back to the system: what the start has used to load
//! models, and that of closed sessions.
//!
//! glibc would keep this memory in its arenas. mimalloc gives it back, but only when a thread
//! allocates. In a service without clients no thread does: after sixty fingers 700 MiB stayed. So
//! the service asks mimalloc for it when sessions have ended.
//!
//! What is freed waits for a second, to be used again. The start uses much and keeps little. What it
//! keeps would come to lie here and there in memory that was used before, and hold all of it: 27 MiB
//! with the shipped models. So nothing waits during the start.

use std::{ffi::c_long, time::Duration};

use tokio::time::{Interval, MissedTickBehavior, interval};

/// mimalloc's option of how long freed memory waits, ms, by its place in the list of `mimalloc.h`:
/// the binding does not name it.
const WAIT: libmimalloc_sys::mi_option_t = 15;

/// How long it waits once the service has started, ms: as mimalloc has it.
const WAIT_MS: c_long = 1000;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Prepares for the start, before there is any other thread: pages are small, and what is freed does
/// not wait.
pub(crate) fn begin() {
    take_small_pages();
    collect(0);
}

/// Has the system give memory in pages of 4 KiB. mimalloc asks for pages of 2 MiB, each of which is
/// there as a whole for the little that stays of what the start has used: 27 of 48 MB with one
/// network. Neither networks nor contact get slower by it.
#[cfg(target_os = "linux")]
fn take_small_pages() {
    // Err: the system has no pages of 2 MiB.
    let _ = rustix::thread::disable_transparent_huge_pages(true);
}

/// Other systems give pages as they do.
#[cfg(not(target_os = "linux"))]
fn take_small_pages() {}

/// How often sessions that are over are looked for.
const LOOK: Duration = Duration::from_secs(3);

/// Looks after the last session's end at which memory is given back: a hello's thread, whose memory
/// the session had, ends up to ten seconds later.
const LOOKS: u32 = 5;

/// Gives memory back for some time after the start and after each session's end.
pub(crate) struct Giving {
    ticks: Interval,
    over: u64,
    left: u32,
}

impl Default for Giving {
    fn default() -> Self {
        let mut ticks = interval(LOOK);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        // What the start has used to load, compare and measure models, and no longer does.
        Self { ticks, over: 0, left: LOOKS }
    }
}

impl Giving {
    /// Waits for the next look.
    pub(crate) async fn next(&mut self) {
        self.ticks.tick().await;
    }

    /// Gives back what is free, if the service has started or sessions have ended lately; `over` counts them.
    pub(crate) fn look(&mut self, over: u64) {
        if over != self.over {
            (self.over, self.left) = (over, LOOKS);
        }
        if self.left > 0 {
            self.left -= 1;
            collect(WAIT_MS);
        }
    }
}

/// Gives back all memory that is free in this thread and in threads that have ended. From now on what
/// is freed waits for so long, ms.
#[allow(unsafe_code, reason = "the binding of mimalloc has no safe form of it")]
fn collect(wait_ms: c_long) {
    // SAFETY: neither takes a pointer, and any thread may call them at any time; an option is one
    // word, which other threads read as it was or as it is.
    unsafe {
        libmimalloc_sys::mi_option_set(WAIT, wait_ms);
        libmimalloc_sys::mi_collect(true);
    }
}
