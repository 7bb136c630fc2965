//! The Papilla service; see `--help`.

use std::{
    io::{self, Write},
    process::ExitCode,
};

use clap::Parser;
use papilla_server::{Config, Server, StartError};
use serde_json::json;
use tokio::signal::unix::{SignalKind, signal};
use tracing_subscriber::EnvFilter;

/// Exit code of a drain that took too long.
const DRAIN_TIMED_OUT: u8 = 5;

fn main() -> ExitCode {
    let config = Config::parse();
    match run(&config) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("papilla-server: {error:#}");
            let start = error.downcast_ref::<StartError>();
            ExitCode::from(start.map_or(1, StartError::exit_code))
        }
    }
}

fn run(config: &Config) -> anyhow::Result<ExitCode> {
    let filter = EnvFilter::try_new(&config.log)
        .map_err(|error| anyhow::anyhow!("--log '{}' is no filter: {error}", config.log))?;
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(io::stderr).init();
    // The runtime only moves bytes: two threads keep one slow turn from stopping all sessions.
    let runtime =
        tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?;
    runtime.block_on(serve(config))
}

async fn serve(config: &Config) -> anyhow::Result<ExitCode> {
    let mut terminate = signal(SignalKind::terminate())?;
    let mut interrupt = signal(SignalKind::interrupt())?;
    let server = papilla_server::start(config).await?;
    announce(&server, config.json)?;
    tokio::select! {
        _ = terminate.recv() => {}
        _ = interrupt.recv() => {}
    }
    tracing::info!("draining; a second signal ends at once");
    tokio::select! {
        result = server.drain() => match result {
            Ok(()) => Ok(ExitCode::SUCCESS),
            Err(error) => {
                tracing::error!(%error, "drain incomplete");
                Ok(ExitCode::from(DRAIN_TIMED_OUT))
            }
        },
        _ = terminate.recv() => Ok(ExitCode::from(DRAIN_TIMED_OUT)),
        _ = interrupt.recv() => Ok(ExitCode::from(DRAIN_TIMED_OUT)),
    }
}

/// Prints where the service is to be found.
fn announce(server: &Server, as_json: bool) -> io::Result<()> {
    let address = format!("http://{}", server.address());
    let mut out = io::stdout().lock();
    if as_json {
        let line = json!({
            "event": "listening",
            "version": env!("CARGO_PKG_VERSION"),
            "address": address,
            "port": server.address().port(),
            "tiers": server.tiers(),
            "default_tier": server.default_tier(),
            "threads": server.threads(),
        });
        writeln!(out, "{line}")?;
    } else {
        let threads = server.threads();
        let plural = if threads == 1 { "" } else { "s" };
        writeln!(
            out,
            "Papilla {} serves tier {} of {} on {threads} thread{plural}.\nOpen {address}",
            env!("CARGO_PKG_VERSION"),
            server.default_tier(),
            server.tiers().join(", "),
        )?;
    }
    out.flush()
}
