//! Signals by which a scheduler asks a process to end: the process stores its state and ends.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Exit code that asks to be started again, to go on from what is stored; `EX_TEMPFAIL` of
/// `sysexits.h`.
pub(super) const REQUEUE: u8 = 75;

/// Exit code of a command that INT has ended, as shells give it.
pub(super) const INTERRUPTED: u8 = 130;

/// A flag that is true once the process has been asked to leave: by USR1, as a scheduler warns
/// before its time is up, or by TERM. A second TERM ends the process at once. To be called before
/// any thread is started.
///
/// A thread of its own waits for the signals, which all others block: METIS has handlers of its
/// own while it orders, which would take a TERM for an error of its own.
#[cfg(unix)]
pub(super) fn stop() -> anyhow::Result<Arc<AtomicBool>> {
    use nix::sys::signal::Signal;
    once([Signal::SIGTERM, Signal::SIGUSR1], Signal::SIGTERM, REQUEUE)
}

/// As [`stop`], by INT (Ctrl-C) or TERM. A second INT ends the process at once, with
/// [`INTERRUPTED`].
#[cfg(unix)]
pub(super) fn interrupt() -> anyhow::Result<Arc<AtomicBool>> {
    use nix::sys::signal::Signal;
    once([Signal::SIGINT, Signal::SIGTERM], Signal::SIGINT, INTERRUPTED)
}

/// A flag that is true once one of `signals` has come; the second `last` ends the process with `code`.
#[cfg(unix)]
fn once(
    signals: [nix::sys::signal::Signal; 2],
    last: nix::sys::signal::Signal,
    code: u8,
) -> anyhow::Result<Arc<AtomicBool>> {
    use anyhow::Context as _;
    use nix::sys::signal::SigSet;
    use std::sync::atomic::Ordering;

    let stop = Arc::new(AtomicBool::new(false));
    let signals: SigSet = signals.into_iter().collect();
    signals.thread_block().context("cannot block signals")?;
    let asked = Arc::clone(&stop);
    let wait = move || {
        let mut seen = false;
        while let Ok(signal) = signals.wait() {
            if signal == last && std::mem::replace(&mut seen, true) {
                std::process::exit(code.into());
            }
            asked.store(true, Ordering::Relaxed);
        }
    };
    std::thread::Builder::new().spawn(wait).context("cannot wait for signals")?;
    Ok(stop)
}

/// A flag that stays false: there are no such signals.
#[cfg(not(unix))]
pub(super) fn interrupt() -> anyhow::Result<Arc<AtomicBool>> {
    Ok(Arc::default())
}

/// A flag that stays false: there are no such signals.
#[cfg(not(unix))]
pub(super) fn stop() -> anyhow::Result<Arc<AtomicBool>> {
    Ok(Arc::default())
}
