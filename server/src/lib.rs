//! The Papilla service: pressure maps in over HTTP or WebSocket, strain energy density
//! maps out, inside a latency budget.
//!
//! ```text
//! net ──► http ──┐                        ┌── worker (own sessions, own buffers)
//!    └──► session ─► slot (latest wins) ─► queue ─┼── worker
//!                                                 └── worker
//! ```
//!
//! **Invariant:** tokio only moves bytes; decoding, inference and encoding run on the pool's
//! own threads. It does so on threads of the service's own (`runtime`), so that whoever
//! starts and drains it is not starved by clients. **Invariant:** every queue is bounded and every wait is timed.
//! **Invariant:** a frame that was accepted is answered exactly once.
//!
//! [`start`] runs the whole service inside a process; the binary does little more.

mod app;
mod assets;
mod bucket;
mod check;
mod codec;
mod config;
mod effects;
mod error;
#[cfg(any(test, fuzzing))]
#[doc(hidden)]
pub mod fuzz;
mod gate;
mod golden;
mod http;
mod metrics;
mod models;
mod negotiate;
mod net;
mod oip;
mod pool;
mod problem;
mod reload;
mod replay;
mod runtime;
mod session;
mod speed;
mod telemetry;
mod tls;

use std::{net::SocketAddr, sync::Arc, time::Duration};

pub use check::{Finding, Report, check};
pub use config::{Cli, Command, Config, ConfigError, SettingError};
pub use error::{DrainError, StartError};
pub use telemetry::Telemetry;
use tokio::{
    sync::watch,
    task::{JoinHandle, spawn_blocking},
    time::timeout,
};

use crate::{
    app::App, assets::Assets, gate::Gate, metrics::Metrics, models::Catalogue, net::Line,
    pool::Pool, runtime::IoRuntime,
};

/// A running service.
///
/// Dropping it without [`drain`](Self::drain) stops accepting and lets the threads finish.
pub struct Server {
    address: SocketAddr,
    tiers: Vec<String>,
    default_tier: String,
    threads: usize,
    drain: Arc<watch::Sender<bool>>,
    drain_timeout: Duration,
    accepting: JoinHandle<()>,
    app: Arc<App>,
    pool: Option<Pool>,
    /// Dropped last: it cuts off what is left of connections.
    io: IoRuntime,
}

/// Longest wait for the job that a thread has in hand, once the drain is over.
const LAST_JOB: Duration = Duration::from_secs(1);

/// Starts the service: loads the models, measures them on this machine, warms every thread,
/// binds, accepts.
///
/// Must be called within a tokio runtime. When it returns, the service is ready.
///
/// # Errors
/// Settings do not go together, the models are missing or unusable, a thread cannot be started, or the address cannot be
/// bound; each says what to do.
pub async fn start(config: &Config) -> Result<Server, StartError> {
    config.validate()?;
    let (gate, tls) = (Gate::new(config)?, tls::acceptor(config)?);
    let loading = config.clone();
    let (catalogue, metrics, pool) =
        spawn_blocking(move || load(&loading)).await.map_err(|_| StartError::WorkerPanicked)??;
    let bind = |source| StartError::Bind { address: config.bind, source };
    let io = IoRuntime::start().map_err(StartError::Thread)?;
    let listener = {
        let _within = io.enter();
        net::listen(config.bind).map_err(bind)?
    };
    let address = listener.local_addr().map_err(bind)?;
    let drain = Arc::new(watch::Sender::new(false));
    let tiers = catalogue.tiers.iter().map(|tier| tier.name.clone()).collect();
    let default_tier = catalogue.tiers[catalogue.default].name.clone();
    let app = Arc::new(App::new(config, catalogue, metrics, &pool, gate, Arc::clone(&drain)));
    if let (true, Some(folder)) = (config.watch_models, &config.models) {
        reload::watch(Arc::clone(&app), folder).map_err(|error| {
            let reason = format!("{} cannot be watched: {error}", folder.display());
            SettingError { field: "watch_models", reason }
        })?;
    }
    let router = http::router(Arc::clone(&app), &config.allow_origin, config.xr_dir.as_deref());
    let line = Line { router, app: Arc::clone(&app), tls };
    let accepting = io.spawn(net::serve(listener, line, config.max_connections.get()));
    Ok(Server {
        address,
        tiers,
        default_tier,
        threads: config.thread_count(),
        drain,
        drain_timeout: config.drain_timeout(),
        accepting,
        app,
        pool: Some(pool),
        io,
    })
}

type Loaded = (Arc<Catalogue>, Arc<Metrics>, Pool);

fn load(config: &Config) -> Result<Loaded, StartError> {
    let assets = Assets::of(config)?;
    let catalogue = Arc::new(Catalogue::load(&assets, config.default_tier.as_deref(), None)?);
    // Before the threads start: they would take time from what is measured.
    speed::calibrate(&catalogue, config.calibration())?;
    let metrics = Metrics::new();
    metrics.name_tiers(&catalogue);
    // A slot is in the queue at most once, so this many places are always enough.
    let places = config.max_sessions.get() + config.max_requests.get();
    let pool = Pool::start(&catalogue, &metrics, config.thread_count(), places)?;
    Ok((catalogue, metrics, pool))
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

    /// Name of the tier taken for clients that name neither tier nor budget.
    #[must_use]
    pub fn default_tier(&self) -> &str {
        &self.default_tier
    }

    /// Number of inference threads.
    #[must_use]
    pub fn threads(&self) -> usize {
        self.threads
    }

    /// Loads the models anew, as `POST /v1/admin/reload` does; the log says what came of it.
    pub fn reload(&self) {
        self.io.spawn(reload::once(Arc::clone(&self.app)));
    }

    /// Ends the service: takes nothing new, answers every accepted frame, tells
    /// every session, and waits for all of them and for the threads.
    ///
    /// Waits on the runtime of the caller, which no client can keep busy.
    ///
    /// # Errors
    /// Not done within the configured time; what was left is cut off.
    pub async fn drain(mut self) -> Result<(), DrainError> {
        self.drain.send_replace(true);
        let accepting = &mut self.accepting;
        let drain = &self.drain;
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

impl Drop for Server {
    fn drop(&mut self) {
        self.drain.send_replace(true);
    }
}

/// Method (lower case) and path of every HTTP route, as the OpenAPI document writes them.
#[must_use]
pub fn routes() -> Vec<(String, String)> {
    http::route_list()
}
