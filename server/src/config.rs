//! What the service can be told on the command line or by the environment.

use std::{net::SocketAddr, num::NonZeroUsize, path::PathBuf, time::Duration};

use clap::Parser;

const HELP_TAIL: &str = "\
Examples:
  papilla-server                               serve on http://127.0.0.1:7224
  papilla-server --bind 0.0.0.0:8000           serve the whole network (there is no password)
  papilla-server --models out/models --json    other models; machine-readable start line
  curl --data-binary @pressure.raw http://127.0.0.1:7224/v1/sed -o sed.raw

The start line goes to stdout, the log to stderr. SIGTERM or Ctrl-C drains: frames already
accepted are answered, then the process ends. A second signal ends it at once.

Exit codes:
  0  drained and ended
  1  unexpected failure
  2  wrong usage
  3  the models are missing or unusable
  4  the address cannot be bound
  5  the drain took longer than --drain-timeout-s";

/// Papilla service: pressure maps in, strain energy density maps out, in time.
#[derive(Debug, Clone, Parser)]
#[command(name = "papilla-server", version, after_help = HELP_TAIL)]
pub struct Config {
    /// Address to listen on; port 0 takes any free one.
    #[arg(long, env = "PAPILLA_BIND", default_value = "127.0.0.1:7224", value_name = "IP:PORT")]
    pub bind: SocketAddr,

    /// Folder of models to serve instead of the ones in the binary (index.json, atlas.json,
    /// NAME.onnx and NAME.json).
    #[arg(long, env = "PAPILLA_MODELS", value_name = "DIR")]
    pub models: Option<PathBuf>,

    /// Inference threads; each owns a ready session of every tier [default: one per core].
    #[arg(long, env = "PAPILLA_THREADS", value_name = "N")]
    pub threads: Option<NonZeroUsize>,

    /// Tier for clients that name neither a tier nor a budget [default: index.json's].
    #[arg(long, env = "PAPILLA_DEFAULT_TIER", value_name = "NAME")]
    pub default_tier: Option<String>,

    /// Time for measuring the tiers on this machine at the start, milliseconds; slow tiers take
    /// two runs each whatever they need. 0: none, the shipped times stand.
    #[arg(long, env = "PAPILLA_CALIBRATION_MS", default_value = "1500", value_name = "MS")]
    pub calibration_ms: u64,

    /// Log filter, as `info` or `papilla_server=debug`.
    #[arg(long, env = "PAPILLA_LOG", default_value = "info", value_name = "FILTER")]
    pub log: String,

    /// Print the start line as JSON.
    #[arg(long)]
    pub json: bool,

    /// Greatest number of open sessions; further ones are answered 503.
    #[arg(long, default_value = "64", value_name = "N")]
    pub max_sessions: NonZeroUsize,

    /// Greatest number of posted maps that wait or run; further ones are answered 503.
    #[arg(long, default_value = "64", value_name = "N")]
    pub max_requests: NonZeroUsize,

    /// Greatest number of open connections; further ones wait to be accepted.
    #[arg(long, default_value = "256", value_name = "N")]
    pub max_connections: NonZeroUsize,

    /// A client that owes the server bytes (a request, a hello, room for an answer) for this
    /// long is dropped, seconds; so is a connection kept alive for nothing.
    #[arg(long, default_value = "10", value_name = "S")]
    pub io_timeout_s: u64,

    /// A session silent for this long is closed, seconds. Pings count, and any WebSocket
    /// library answers them.
    #[arg(long, default_value = "60", value_name = "S")]
    pub idle_timeout_s: u64,

    /// Time for the drain, seconds; longer than --io-timeout-s, or a slow client can outlast it.
    #[arg(long, default_value = "15", value_name = "S")]
    pub drain_timeout_s: u64,
}

impl Default for Config {
    /// The defaults of the command line, on any free port of the loopback.
    ///
    /// The environment is not read.
    fn default() -> Self {
        let n = |n| NonZeroUsize::new(n).unwrap_or(NonZeroUsize::MIN);
        Self {
            bind: SocketAddr::from(([127, 0, 0, 1], 0)),
            models: None,
            threads: None,
            default_tier: None,
            calibration_ms: 1500,
            log: "info".to_owned(),
            json: false,
            max_sessions: n(64),
            max_requests: n(64),
            max_connections: n(256),
            io_timeout_s: 10,
            idle_timeout_s: 60,
            drain_timeout_s: 15,
        }
    }
}

/// The times the service runs by.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Timeouts {
    /// For a client that owes bytes.
    pub(crate) io: Duration,
    /// For a silent session.
    pub(crate) idle: Duration,
}

impl Config {
    pub(crate) fn timeouts(&self) -> Timeouts {
        Timeouts {
            io: Duration::from_secs(self.io_timeout_s.max(1)),
            idle: Duration::from_secs(self.idle_timeout_s.max(1)),
        }
    }

    pub(crate) fn calibration(&self) -> Duration {
        Duration::from_millis(self.calibration_ms)
    }

    pub(crate) fn drain_timeout(&self) -> Duration {
        Duration::from_secs(self.drain_timeout_s)
    }

    pub(crate) fn thread_count(&self) -> usize {
        self.threads
            .map(NonZeroUsize::get)
            .or_else(|| std::thread::available_parallelism().ok().map(NonZeroUsize::get))
            .unwrap_or(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_and_command_line_agree() {
        let parsed = Config::parse_from(["papilla-server"]);
        let expected = Config { bind: parsed.bind, ..Config::default() };
        assert_eq!(format!("{parsed:?}"), format!("{expected:?}"));
        assert_eq!(parsed.bind.to_string(), "127.0.0.1:7224");
    }

    #[test]
    fn the_command_line_is_sound() {
        use clap::CommandFactory;
        Config::command().debug_assert();
        assert!(Config::try_parse_from(["papilla-server", "--threads", "0"]).is_err());
        assert!(Config::try_parse_from(["papilla-server", "--bind", "nowhere"]).is_err());
    }
}
