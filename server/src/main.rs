//! The Papilla service; see `--help`.

mod allocator;
mod signals;

use std::{
    env,
    io::{self, Write},
    pin::pin,
    process::ExitCode,
};

use papilla_server::{
    Cli, Command, Config, ConfigError, Server, SettingError, StartError, Telemetry,
};
use serde_json::json;

use self::signals::{Request, Signals};

/// Exit code of a drain that took too long.
const DRAIN_TIMED_OUT: u8 = 5;

/// Exit code of a start that a signal ended, as shells have it for Ctrl-C.
const INTERRUPTED: u8 = 130;

fn main() -> ExitCode {
    allocator::begin();
    match run() {
        Ok(code) => code,
        Err(error) => {
            // Help and usage print themselves, with the exit code that is due.
            if let Some(ConfigError::Usage(usage)) = error.downcast_ref() {
                usage.exit();
            }
            // Without its sources: our errors say them themselves. Err: nobody reads it; the exit
            // code stands.
            let _ = writeln!(io::stderr(), "papilla-server: {error}");
            let of_start = error.downcast_ref::<StartError>().map(StartError::exit_code);
            let is_setting = error.is::<ConfigError>() || error.is::<SettingError>();
            ExitCode::from(of_start.unwrap_or(if is_setting { 2 } else { 1 }))
        }
    }
}

fn run() -> anyhow::Result<ExitCode> {
    let (cli, printed) = Cli::read_and_print(env::args_os())?;
    let config = &cli.settings;
    if cli.print_config {
        config.validate()?;
        print(&printed)?;
        return Ok(ExitCode::SUCCESS);
    }
    // It outlives the runtime: what the last tasks log and trace is still sent.
    let _telemetry = Telemetry::start(config)?;
    match cli.command {
        Some(Command::Check) => check(config),
        None => {
            // The service moves bytes on threads of its own. This one waits for signals and
            // watches over the drain: no client can keep it busy.
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
            let result = runtime.block_on(serve(config));
            // What still loads or renders is not waited for.
            runtime.shutdown_background();
            result
        }
    }
}

/// Writes to stdout what was asked for. Whoever closes a pipe has read enough of it.
fn print(text: &str) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(anyhow::anyhow!("stdout cannot be written: {error}"))
        }
        _ => Ok(()),
    }
}

fn check(config: &Config) -> anyhow::Result<ExitCode> {
    let report = papilla_server::check(config);
    let text = if config.json { serde_json::to_string(&report)? } else { report.to_string() };
    print(&format!("{text}\n"))?;
    Ok(ExitCode::from(report.exit_code()))
}

async fn serve(config: &Config) -> anyhow::Result<ExitCode> {
    let mut signals = Signals::listen()?;
    let starting = papilla_server::listen(config)?;
    tracing::info!(address = %starting.address(), "listening; the models are being loaded");
    let answers = starting.answers();
    let mut ready = pin!(starting.ready());
    let started = tokio::select! {
        biased;
        server = &mut ready => Some(server?),
        () = signals.end() => None,
    };
    let server = match started {
        Some(server) => server,
        // Clients have had answers: what they sent is answered before the end.
        None if answers() => return drain(ready.await?, &mut signals).await,
        None => return Ok(ExitCode::from(INTERRUPTED)),
    };
    if let Err(error) = announce(&server, config) {
        // Clients are served all the same.
        tracing::warn!(%error, "the start line cannot be written to stdout");
    }
    let mut giving = allocator::Giving::default();
    loop {
        tokio::select! {
            request = signals.next() => match request {
                Request::Reload => {
                    tracing::info!("SIGHUP: the models are loaded anew");
                    server.reload();
                }
                Request::End => break,
            },
            () = giving.next() => giving.look(server.sessions_over()),
        }
    }
    drain(server, &mut signals).await
}

/// Answers what was accepted, then ends; a second signal ends at once.
async fn drain(server: Server, signals: &mut Signals) -> anyhow::Result<ExitCode> {
    tracing::info!("draining; a second signal ends at once");
    tokio::select! {
        result = server.drain() => match result {
            Ok(()) => Ok(ExitCode::SUCCESS),
            Err(error) => {
                tracing::error!(%error, "drain incomplete");
                Ok(ExitCode::from(DRAIN_TIMED_OUT))
            }
        },
        () = signals.end() => Ok(ExitCode::from(DRAIN_TIMED_OUT)),
    }
}

/// Prints where the service is to be found.
fn announce(server: &Server, config: &Config) -> io::Result<()> {
    let address = format!("{}://{}", config.scheme(), server.address());
    let mut out = io::stdout().lock();
    if config.json {
        let line = json!({
            "event": "listening",
            "version": env!("CARGO_PKG_VERSION"),
            "address": address,
            "port": server.address().port(),
            "tiers": server.tiers(),
            "default_tier": server.default_tier(),
            "default_tier_for_pressure": server.default_tier_for_pressure(),
            "threads": server.threads(),
            "real_time": server.real_time(),
        });
        writeln!(out, "{line}")?;
    } else {
        let threads = server.threads();
        let plural = if threads == 1 { "" } else { "s" };
        let defaults = [server.default_tier(), server.default_tier_for_pressure()];
        let serves = match defaults {
            [tier, for_pressure] if tier == for_pressure => format!("tier {tier}"),
            [tier, for_pressure] => format!("tiers {tier} and, for pressure, {for_pressure}"),
        };
        let names = server.tiers().iter().map(String::as_str);
        let others: Vec<&str> = names.filter(|name| !defaults.contains(name)).collect();
        let by_name = match &others[..] {
            [] => String::new(),
            others => format!(", and by name {},", others.join(", ")),
        };
        writeln!(
            out,
            "Papilla {} serves {serves}{by_name} on {threads} thread{plural}.\nOpen {address}",
            env!("CARGO_PKG_VERSION"),
        )?;
    }
    out.flush()
}
