//! Which threads go first. With `--real-time` the service orders them itself:
//!
//! ```text
//! reading     SCHED_FIFO 20          moves bytes; a turn takes microseconds, and it sleeps between
//! rendering   SCHED_FIFO 10          where it leaves a processor to others,
//!             SCHED_OTHER, nice -10  where its threads could hold all of them
//! all else    SCHED_OTHER            hellos, reloads, metrics
//! ```
//!
//! A thread that renders needs milliseconds without a pause. At the priority of those that read it
//! keeps them from reading as long as frames come, and what it renders next has waited in the
//! system's buffers for seconds.

use std::{
    fmt,
    sync::{Arc, Mutex, PoisonError},
    thread,
};

use papilla_metrics::Metrics;
use serde::Serialize;

use crate::config::Config;

/// Niceness of work that frames must not wait for, and of rendering where it has no real-time
/// priority.
const BEHIND: i32 = 10;
const BEFORE: i32 = -10;

/// Real-time priorities of reading and of rendering, where the process does not bring its own.
const READING: u8 = 20;
const RENDERING: u8 = 10;

/// What a thread is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    /// Moves bytes.
    Reading,
    /// Renders frames.
    Rendering,
    /// Serves no frames, but somebody waits for it.
    Other,
    /// Works out what may take long.
    Behind,
}

/// What the system has granted of what `--real-time` asks for.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct RealTime {
    /// Priority of the threads that move bytes.
    pub reading: Grant,
    /// Priority of the inference threads.
    pub rendering: Grant,
    /// Memory that is not paged out.
    pub memory: Grant,
}

/// One of them.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Grant {
    /// Not asked for yet.
    #[default]
    Pending,
    /// What was granted.
    Granted(String),
    /// Why it was not, and what to do.
    Refused(String),
}

impl Grant {
    fn of(what: String, result: Result<(), String>, hint: &str) -> Self {
        match result {
            Ok(()) => Self::Granted(what),
            Err(error) => Self::Refused(format!("{what}: {error}; {hint}")),
        }
    }

    fn is_granted(&self) -> bool {
        matches!(self, Self::Granted(_))
    }
}

impl fmt::Display for Grant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Pending => f.write_str("pending"),
            Self::Granted(what) => f.write_str(what),
            Self::Refused(why) => write!(f, "refused, {why}"),
        }
    }
}

/// The order of the threads; each enters with its role.
#[derive(Clone)]
pub(crate) struct Priorities(Option<Arc<Order>>);

struct Order {
    /// Priority of the threads that read.
    reading: u8,
    /// Of those that render; none: a niceness.
    rendering: Option<u8>,
    found: Mutex<RealTime>,
}

impl Priorities {
    /// No order: every thread stays where it is.
    #[cfg(test)]
    pub(crate) fn none() -> Self {
        Self(None)
    }

    /// What the settings ask for. A process that was started at a real-time priority, as by `chrt`,
    /// is put in order within it: its threads would have one priority, all of them.
    pub(crate) fn of(config: &Config) -> Self {
        let inherited = os::real_time_priority();
        if let Some(priority) = inherited.filter(|_| !config.real_time) {
            tracing::warn!(
                "started at real-time priority {priority}: threads that read keep it, those that \
                 render go below, as with --real-time"
            );
        }
        if !config.real_time && inherited.is_none() {
            return Self(None);
        }
        let reading = inherited.unwrap_or(READING);
        let cores = thread::available_parallelism().map_or(1, usize::from);
        // On all processors it would leave nothing to whoever sends the frames.
        let leaves_one = config.thread_count() < cores;
        let rendering = leaves_one.then_some(RENDERING.min(reading.saturating_sub(1)));
        let rendering = rendering.filter(|&priority| priority > 0);
        let order = Order { reading, rendering, found: Mutex::default() };
        if config.real_time {
            let hint = "set LimitMEMLOCK=infinity in the unit, or give CAP_IPC_LOCK";
            let memory = Grant::of("memory locked".to_owned(), os::lock_memory(), hint);
            order.note(|found| found.memory = memory);
        }
        Self(Some(Arc::new(order)))
    }

    /// Gives the calling thread the place of its role.
    pub(crate) fn enter(&self, role: Role) {
        let Some(order) = &self.0 else {
            if role == Role::Behind {
                let _ = os::set_nice(BEHIND);
            }
            return;
        };
        match role {
            Role::Reading => {
                let priority = order.reading;
                let grant = fifo(priority);
                order.note(|found| found.reading = grant);
            }
            // Without a priority for those that read, this would be the wrong way round.
            Role::Rendering => {
                let may = order.look(|found| found.reading.is_granted());
                let grant = match order.rendering.filter(|_| may) {
                    Some(priority) => fifo(priority),
                    None => {
                        let hint = "set LimitNICE=-10 in the unit, or give CAP_SYS_NICE";
                        let what = format!("SCHED_OTHER, nice {BEFORE}");
                        Grant::of(what, os::set_normal(BEFORE), hint)
                    }
                };
                order.note(|found| found.rendering = grant);
            }
            Role::Other | Role::Behind => {
                let nice = if role == Role::Behind { BEHIND } else { 0 };
                if let Err(error) = os::set_normal(nice) {
                    tracing::debug!(error, ?role, "a thread keeps the priority it had");
                }
            }
        }
    }

    /// Says what came of it, once every thread has entered; none: nothing was asked for.
    pub(crate) fn report(&self, metrics: &Metrics) -> Option<RealTime> {
        let found = self.0.as_ref()?.look(RealTime::clone);
        let RealTime { reading, rendering, memory } = &found;
        let grants = [("reading", reading), ("rendering", rendering), ("memory", memory)];
        for (what, grant) in grants {
            metrics.real_time(what, grant.is_granted());
            match grant {
                Grant::Granted(_) => tracing::info!("real time: {what} {grant}"),
                Grant::Refused(_) => tracing::warn!("real time: {what} {grant}"),
                Grant::Pending => {}
            }
        }
        Some(found)
    }
}

impl Order {
    fn note(&self, change: impl FnOnce(&mut RealTime)) {
        change(&mut self.found.lock().unwrap_or_else(PoisonError::into_inner));
    }

    fn look<T>(&self, look: impl FnOnce(&RealTime) -> T) -> T {
        look(&self.found.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

fn fifo(priority: u8) -> Grant {
    let hint = "set LimitRTPRIO=20 in the unit, or give CAP_SYS_NICE";
    Grant::of(format!("SCHED_FIFO {priority}"), os::set_fifo(priority), hint)
}

#[cfg(target_os = "linux")]
mod os {
    use rustix::{
        mm::{MlockAllFlags, mlockall},
        process::{Resource, Rlimit, getrlimit, setpriority_process, setrlimit},
        thread::{CapabilitySet, capabilities, gettid},
    };
    use thread_priority::{
        NormalThreadSchedulePolicy, RealtimeThreadSchedulePolicy, ThreadPriority,
        ThreadSchedulePolicy, set_thread_priority_and_policy, thread_native_id,
        thread_schedule_policy, thread_schedule_policy_param,
    };

    const FIFO: ThreadSchedulePolicy =
        ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    const OTHER: ThreadSchedulePolicy =
        ThreadSchedulePolicy::Normal(NormalThreadSchedulePolicy::Other);

    /// What the crate for priorities makes niceness 0 of.
    const NICE_0: u8 = 48;

    fn set(priority: u8, policy: ThreadSchedulePolicy) -> Result<(), String> {
        let priority = priority.try_into().map(ThreadPriority::Crossplatform)?;
        set_thread_priority_and_policy(thread_native_id(), priority, policy)
            .map_err(|error| error.to_string())
    }

    /// The real-time priority of the calling thread, if it has one.
    pub(super) fn real_time_priority() -> Option<u8> {
        let (policy, params) = thread_schedule_policy_param(thread_native_id()).ok()?;
        let ThreadSchedulePolicy::Realtime(_) = policy else { return None };
        u8::try_from(params.sched_priority).ok().filter(|&priority| priority > 0)
    }

    pub(super) fn set_fifo(priority: u8) -> Result<(), String> {
        set(priority, FIFO)
    }

    /// No real-time priority, and this niceness.
    pub(super) fn set_normal(nice: i32) -> Result<(), String> {
        if thread_schedule_policy() != Ok(OTHER) {
            set(NICE_0, OTHER)?;
        }
        set_nice(nice)
    }

    pub(super) fn set_nice(nice: i32) -> Result<(), String> {
        setpriority_process(Some(gettid()), nice).map_err(|error| error.to_string())
    }

    /// Keeps what is touched in memory. Only without a limit: beyond one, the system would refuse
    /// memory to the service itself.
    pub(super) fn lock_memory() -> Result<(), String> {
        let unlimited = Rlimit { current: None, maximum: None };
        let is_capable =
            capabilities(None).is_ok_and(|sets| sets.effective.contains(CapabilitySet::IPC_LOCK));
        if let Some(bytes) = getrlimit(Resource::Memlock).current.filter(|_| !is_capable)
            && setrlimit(Resource::Memlock, unlimited).is_err()
        {
            return Err(format!("the limit of locked memory is {bytes} bytes"));
        }
        let flags = MlockAllFlags::CURRENT | MlockAllFlags::FUTURE | MlockAllFlags::ONFAULT;
        mlockall(flags).map_err(|error| error.to_string())
    }
}

/// Elsewhere than on Linux priorities are of other kinds, and stay.
#[cfg(not(target_os = "linux"))]
mod os {
    const NONE: &str = "only Linux is known to order threads so";

    pub(super) fn real_time_priority() -> Option<u8> {
        None
    }

    pub(super) fn set_fifo(_: u8) -> Result<(), String> {
        Err(NONE.to_owned())
    }

    pub(super) fn set_normal(_: i32) -> Result<(), String> {
        Err(NONE.to_owned())
    }

    pub(super) fn set_nice(_: i32) -> Result<(), String> {
        Err(NONE.to_owned())
    }

    pub(super) fn lock_memory() -> Result<(), String> {
        Err(NONE.to_owned())
    }
}
