//! The Papilla service: pressure maps in over HTTP or WebSocket, strain energy density
//! maps out, inside a latency budget.
//!
//! ```text
//! transport: net ─► front ─► routes ─┬─► http, oip ─┐
//!                                    └─► session ───┴─► slot (latest wins)
//! core:      scheduler: slot ─► queue ─► thread (own engine sessions, own buffers) ─► answer
//! ```
//!
//! It uses crates of the workspace: `papilla-codec` reads and writes maps, `papilla-session-effects`
//! computes what sessions ask for beside maps, `papilla-engine` runs the networks. Each layer uses
//! only those below it, and no modules import each other in a circle.
//!
//! **Invariant:** tokio only moves bytes, on threads of its own (`runtime`), so that clients cannot
//! starve the task that starts and drains the service. Decoding, inference and encoding run on the
//! threads of the pool. **Invariant:** every queue is bounded and every wait is timed.
//! **Invariant:** a frame that was accepted is answered exactly once.
//!
//! [`start`](fn@start) runs the whole service inside a process; the binary does little more:
//!
//! ```
//! let arguments = ["papilla-server", "--bind", "127.0.0.1:0", "--threads", "1"];
//! let config = papilla_server::Cli::read(arguments.map(Into::into))?.settings;
//! config.validate()?;
//! # async fn serve(config: papilla_server::Config) -> Result<(), Box<dyn std::error::Error>> {
//! let server = papilla_server::start(&config).await?;
//! println!("{} tiers on {}", server.tiers().len(), server.address());
//! server.drain().await?;
//! # Ok(())
//! # }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod check;
mod config;
mod core;
mod descriptors;
mod drain;
mod error;
#[cfg(any(test, fuzzing))]
#[doc(hidden)]
pub mod fuzz;
mod priority;
mod problem;
mod processor;
mod progress;
mod runtime;
mod start;
mod telemetry;
mod transport;

use std::{net::SocketAddr, sync::Arc, time::Duration};

pub use check::{Finding, Report, check};
pub use config::{Cli, Command, Config, ConfigError, SettingError};
pub use error::{DrainError, StartError};
use papilla_metrics::Metrics;
pub use priority::{Grant, RealTime};
pub use telemetry::Telemetry;
use tokio::{
    sync::watch,
    task::{JoinHandle, JoinSet, spawn_blocking},
    time::timeout,
};

use crate::{
    core::scheduler::Pool,
    priority::Priorities,
    progress::Progress,
    runtime::IoRuntime,
    start::Opened,
    transport::{
        app::App,
        front::Front,
        gate::{Gate, Places},
        moves::Moves,
        net::{self, ConnectionContext},
        tls,
    },
};

/// A service that listens, and loads its models.
///
/// Dropping it stops accepting.
pub struct Starting {
    address: SocketAddr,
    drain: EndOnDrop,
    drain_timeout: Duration,
    accepting: JoinHandle<()>,
    /// One task; dropped, it is given up.
    opening: JoinSet<Result<Opened, StartError>>,
    threads: usize,
    front: Arc<Front>,
    io: IoRuntime,
}

/// A running service.
///
/// Dropping it without [`drain`](Self::drain) stops accepting and lets the threads finish.
pub struct Server {
    address: SocketAddr,
    tiers: Vec<String>,
    default_tier: String,
    default_tier_for_pressure: String,
    threads: usize,
    real_time: Option<RealTime>,
    drain: EndOnDrop,
    drain_timeout: Duration,
    accepting: JoinHandle<()>,
    app: Arc<App>,
    pool: Option<Pool>,
    /// Dropped last: it cuts off what is left of connections.
    io: IoRuntime,
}

/// Longest wait for the job that a thread has in hand, once the drain is over.
const LAST_JOB: Duration = Duration::from_secs(1);

/// Tells everybody that the server drains when it is dropped.
struct EndOnDrop(Arc<watch::Sender<bool>>);

impl Drop for EndOnDrop {
    fn drop(&mut self) {
        self.0.send_replace(true);
    }
}

/// Listens, and begins to load the models.
///
/// From here on connections are taken: `/healthz` answers, `/readyz` says how far the start has
/// come, and other requests wait for the models, no longer than a client may take (`io_timeout_s`).
/// Must be called within a tokio runtime.
///
/// # Errors
/// Settings do not go together, or the address cannot be bound; each says what to do.
pub fn listen(config: &Config) -> Result<Starting, StartError> {
    config.validate()?;
    let (gate, moves) = (Gate::new(config)?, Moves::new(config)?);
    let tls = tls::acceptor(config)?;
    descriptors::raise(config);
    processor::Vectors::here().warn();
    let bind = |source| StartError::Bind { address: config.bind, source };
    let priorities = Priorities::of(config);
    let io = IoRuntime::start(&priorities).map_err(StartError::Thread)?;
    let listener = {
        let _within = io.enter();
        net::listen(config.bind).map_err(bind)?
    };
    let address = listener.local_addr().map_err(bind)?;
    let drain = Arc::new(watch::Sender::new(false));
    let (metrics, progress) = (Metrics::new(), Arc::<Progress>::default());
    let timeouts = config.timeouts();
    let front = Arc::new(Front::new(
        Arc::clone(&progress),
        Arc::clone(&metrics),
        Arc::clone(&drain),
        timeouts.io,
    ));
    let mut opening = JoinSet::new();
    let parts = start::Parts {
        config: config.clone(),
        gate,
        moves,
        metrics: Arc::clone(&metrics),
        progress,
        front: Arc::clone(&front),
        drain: Arc::clone(&drain),
        priorities,
    };
    opening.spawn_on(start::open(parts), io.handle());
    let context = ConnectionContext {
        front: Arc::clone(&front),
        metrics,
        drain: Arc::clone(&drain),
        timeouts,
        tls,
    };
    let places = Places::new(config.max_connections.get(), config.tokens.is_some());
    let accepting = io.handle().spawn(net::serve(listener, context, places));
    Ok(Starting {
        address,
        drain: EndOnDrop(drain),
        drain_timeout: config.drain_timeout(),
        accepting,
        opening,
        threads: config.thread_count(),
        front,
        io,
    })
}

/// Starts the service and waits until it is ready: [`listen`], then [`Starting::ready`].
///
/// # Errors
/// As of those two.
pub async fn start(config: &Config) -> Result<Server, StartError> {
    listen(config)?.ready().await
}

impl Starting {
    /// The address it listens on, with the port the system chose.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Tells whether clients are answered already. It can be asked while [`ready`](Self::ready)
    /// runs: the service answers a moment before that returns.
    pub fn answers(&self) -> impl Fn() -> bool + use<> {
        let front = Arc::clone(&self.front);
        move || front.is_open()
    }

    /// Waits until the models are loaded and measured on this machine, and every thread is warm.
    ///
    /// # Errors
    /// The models are missing or unusable, a thread cannot be started, or the folder cannot be
    /// watched; each says what to do. Nothing is accepted any more then.
    pub async fn ready(mut self) -> Result<Server, StartError> {
        let opened = match self.opening.join_next().await {
            Some(Ok(opened)) => opened?,
            Some(Err(_)) | None => return Err(StartError::WorkerPanicked),
        };
        Ok(Server {
            address: self.address,
            tiers: opened.tiers,
            default_tier: opened.default_tier,
            default_tier_for_pressure: opened.default_tier_for_pressure,
            threads: self.threads,
            real_time: opened.real_time,
            drain: self.drain,
            drain_timeout: self.drain_timeout,
            accepting: self.accepting,
            app: opened.app,
            pool: Some(opened.pool),
            io: self.io,
        })
    }
}

impl Server {
    /// The address it listens on, with the port the system chose.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Names of the tiers.
    #[must_use]
    pub fn tiers(&self) -> &[String] {
        &self.tiers
    }

    /// Name of the tier taken for clients that give poses or gaps and name neither tier nor budget.
    #[must_use]
    pub fn default_tier(&self) -> &str {
        &self.default_tier
    }

    /// The same for clients that give pressure.
    #[must_use]
    pub fn default_tier_for_pressure(&self) -> &str {
        &self.default_tier_for_pressure
    }

    /// Number of inference threads.
    #[must_use]
    pub fn threads(&self) -> usize {
        self.threads
    }

    /// What the system has granted of `--real-time`; none: it was not asked for.
    #[must_use]
    pub fn real_time(&self) -> Option<&RealTime> {
        self.real_time.as_ref()
    }

    /// Sessions that have ended so far.
    #[must_use]
    pub fn sessions_over(&self) -> u64 {
        let metrics = &self.app.metrics;
        let open = u64::try_from(metrics.sessions_open.get()).unwrap_or_default();
        metrics.sessions.get().saturating_sub(open)
    }

    /// Loads the models anew, as `POST /v1/admin/reload` does; the log says what came of it.
    pub fn reload(&self) {
        self.io.handle().spawn(core::reload::once(Arc::clone(&self.app.reloader)));
    }

    /// Ends the service: takes nothing new, answers every accepted frame, tells
    /// every session, and waits for all of them and for the threads.
    ///
    /// Waits on the runtime of the caller, which no client can keep busy.
    ///
    /// # Errors
    /// Not done within the configured time; what was left is cut off.
    pub async fn drain(mut self) -> Result<(), DrainError> {
        let drain = Arc::clone(&self.drain.0);
        drain.send_replace(true);
        let accepting = &mut self.accepting;
        let all = async {
            // Err: it panicked; nothing is accepted then either.
            let _ = accepting.await;
            // Connections and sessions each hold a receiver.
            drain.closed().await;
        };
        let result = timeout(self.drain_timeout, all).await;
        if let Some(mut pool) = self.pool.take() {
            // Err: the job takes too long; the thread is left to it.
            let _ = timeout(LAST_JOB, spawn_blocking(move || pool.stop())).await;
        }
        result.map_err(|_| DrainError { seconds: self.drain_timeout.as_secs() })
    }
}

/// Method (lower case) and path of every HTTP route, as the OpenAPI document writes them.
#[must_use]
pub fn routes() -> Vec<(String, String)> {
    transport::routes::list()
}
