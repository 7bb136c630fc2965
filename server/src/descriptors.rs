//! File descriptors: each connection takes one, and the system limits how many a process may have.

use crate::config::Config;

/// Those beside connections: listener, runtime, log, watched folder, files being read.
const BESIDE: u64 = 64;

/// What there is and what is due.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Descriptors {
    /// What the settings can make the process open.
    pub(crate) due: u64,
    /// What it may open; none: any number, or the system does not say.
    pub(crate) limit: Option<u64>,
}

impl Descriptors {
    /// What there is once [`raise`] has done its part: the hard limit.
    pub(crate) fn of(config: &Config) -> Self {
        Self { due: due(config), limit: hard_limit() }
    }

    /// Why they are too few, if they are.
    pub(crate) fn shortage(self) -> Option<String> {
        let Self { due, limit } = self;
        let limit = limit.filter(|limit| *limit < due)?;
        Some(format!(
            "max_connections can take {due} file descriptors, and the system gives this process \
             {limit}; beyond them connections wait. Raise the limit (`ulimit -Hn`, or LimitNOFILE= \
             of a unit) or name a smaller --max-connections"
        ))
    }
}

fn due(config: &Config) -> u64 {
    u64::try_from(config.max_connections.get()).unwrap_or(u64::MAX).saturating_add(BESIDE)
}

/// Raises the soft limit as far as connections need it and the hard limit allows; what is still
/// too few is said in the log.
pub(crate) fn raise(config: &Config) {
    let due = due(config);
    if let Err(error) = raise_to(due) {
        tracing::warn!(%error, "the limit of file descriptors cannot be raised");
    }
    if let Some(shortage) = Descriptors::of(config).shortage() {
        tracing::warn!("{shortage}");
    }
}

#[cfg(unix)]
fn raise_to(due: u64) -> std::io::Result<()> {
    use rlimit::Resource;
    let (soft, hard) = Resource::NOFILE.get()?;
    let wanted = due.min(hard);
    if soft >= wanted {
        return Ok(());
    }
    Resource::NOFILE.set(wanted, hard)?;
    tracing::info!(from = soft, to = wanted, "the limit of file descriptors is raised");
    Ok(())
}

#[cfg(unix)]
fn hard_limit() -> Option<u64> {
    // Err: then nothing is known of one.
    let (_, hard) = rlimit::Resource::NOFILE.get().ok()?;
    (hard != rlimit::INFINITY).then_some(hard)
}

#[cfg(not(unix))]
fn raise_to(_: u64) -> std::io::Result<()> {
    Ok(())
}

#[cfg(not(unix))]
fn hard_limit() -> Option<u64> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn too_few_are_named_with_what_to_do() {
        let of = |limit| Descriptors { due: 320, limit }.shortage();
        assert_eq!((of(None), of(Some(320)), of(Some(1 << 20))), (None, None, None));
        let shortage = of(Some(256)).unwrap();
        for word in ["320", "256", "ulimit", "--max-connections"] {
            assert!(shortage.contains(word), "{shortage}");
        }
    }
}
