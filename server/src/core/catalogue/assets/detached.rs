//! Runs work that may never end, such as reading from a drive that does not answer. It gets a
//! thread of its own, which is given up if it takes too long.

use std::{
    io,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicUsize, Ordering},
        mpsc::{self, RecvTimeoutError},
    },
    thread,
    time::{Duration, Instant},
};

/// How often the caller checks whether to go on waiting.
const LOOK_AROUND: Duration = Duration::from_millis(50);

/// The most abandoned threads that may hang at a time. Beyond that no new work is started.
pub(super) const STRANDED_MAX: usize = 4;

/// Why there is no result.
#[derive(Debug)]
pub(super) enum Unfinished {
    /// `is_to_stop` became true.
    Stopped,
    /// It took longer than `wait_max`.
    Late,
    /// Too many abandoned threads still hang.
    Stranded,
    /// Its thread could not be started, or panicked.
    Broken(io::Error),
}

/// Number of threads that were abandoned and still hang.
static STRANDED: AtomicUsize = AtomicUsize::new(0);

/// Runs `work` on a thread of its own and waits for it, until `wait_max` has passed or `is_to_stop`
/// is true. A thread that is abandoned then goes on by itself; the end of the process does not wait
/// for it.
pub(super) fn detached<T: Send + 'static>(
    work: impl FnOnce() -> T + Send + 'static,
    wait_max: Duration,
    is_to_stop: &dyn Fn() -> bool,
) -> Result<T, Unfinished> {
    if STRANDED.load(Ordering::Relaxed) >= STRANDED_MAX {
        return Err(Unfinished::Stranded);
    }
    let (done, result) = mpsc::sync_channel(1);
    let over = Arc::new(AtomicBool::new(false));
    let end = End(Arc::clone(&over));
    let begun = Instant::now();
    let thread = thread::Builder::new().name("papilla-read".to_owned()).spawn(move || {
        let _end = end;
        // Fails if the caller has stopped waiting.
        let _ = done.send(work());
    });
    thread.map_err(Unfinished::Broken)?;
    let fault = loop {
        match result.recv_timeout(LOOK_AROUND) {
            Ok(value) => return Ok(value),
            Err(RecvTimeoutError::Disconnected) => {
                return Err(Unfinished::Broken(io::Error::other("the reading panicked")));
            }
            Err(RecvTimeoutError::Timeout) if is_to_stop() => break Unfinished::Stopped,
            Err(RecvTimeoutError::Timeout) if begun.elapsed() >= wait_max => {
                break Unfinished::Late;
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
    };
    STRANDED.fetch_add(1, Ordering::Relaxed);
    take_off(&over);
    Err(fault)
}

/// Marks the end of the thread when it is dropped, also by a panic.
struct End(Arc<AtomicBool>);

impl Drop for End {
    fn drop(&mut self) {
        take_off(&self.0);
    }
}

/// Called twice for abandoned work: by the thread when it ends, and by the caller when it has
/// counted the thread as hanging. The second call takes the thread off the count.
fn take_off(over: &AtomicBool) {
    if over.swap(true, Ordering::AcqRel) {
        STRANDED.fetch_sub(1, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WAIT_MAX: Duration = Duration::from_secs(60);

    #[test]
    fn what_never_ends_is_given_up_and_blocks_what_comes_later_only_in_numbers() {
        let never = || false;
        assert_eq!(detached(|| 7, WAIT_MAX, &never).unwrap(), 7);
        let panicked = detached(|| assert_eq!(1, 2), WAIT_MAX, &never);
        assert!(matches!(panicked, Err(Unfinished::Broken(_))), "{panicked:?}");
        let mut held = Vec::new();
        for turn in 0..STRANDED_MAX {
            let (end, ended) = mpsc::channel::<()>();
            let work = move || {
                let _ = ended.recv();
            };
            let fault = if turn == 0 {
                detached(work, WAIT_MAX, &|| true)
            } else {
                detached(work, Duration::ZERO, &never)
            };
            let due = if turn == 0 { "Stopped" } else { "Late" };
            assert_eq!(format!("{:?}", fault.unwrap_err()), due);
            if turn + 1 < STRANDED_MAX {
                assert_eq!(detached(|| 7, WAIT_MAX, &never).unwrap(), 7, "a later one is blocked");
            }
            held.push(end);
        }
        let refused = detached(|| 7, WAIT_MAX, &never);
        assert!(matches!(refused, Err(Unfinished::Stranded)), "{refused:?}");
        // The drive answers at last.
        drop(held);
        let begun = Instant::now();
        while detached(|| 7, WAIT_MAX, &never).is_err() {
            assert!(begun.elapsed() < Duration::from_secs(60), "they are counted for ever");
            thread::sleep(Duration::from_millis(5));
        }
    }
}
