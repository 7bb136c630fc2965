//! How a scheduler asks a process to leave: it stores where it stands and goes.

use anyhow::Context as _;
use signal_hook::consts::SIGTERM;
use signal_hook::flag;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Exit code that asks to be started again, to go on from what is stored; `EX_TEMPFAIL` of
/// `sysexits.h`.
pub(super) const REQUEUE: u8 = 75;

/// A flag that is true once the process has been asked to leave: by USR1, as a scheduler warns
/// before its time is up, or by TERM. A second TERM ends the process at once.
pub(super) fn stop() -> anyhow::Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    let termed = Arc::new(AtomicBool::new(false));
    let context = "cannot listen for signals";
    // In this order: the first TERM finds it false.
    flag::register_conditional_shutdown(SIGTERM, REQUEUE.into(), Arc::clone(&termed))
        .context(context)?;
    flag::register(SIGTERM, termed).context(context)?;
    flag::register(SIGTERM, Arc::clone(&stop)).context(context)?;
    #[cfg(unix)]
    flag::register(signal_hook::consts::SIGUSR1, Arc::clone(&stop)).context(context)?;
    Ok(stop)
}
