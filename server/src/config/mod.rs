//! The settings of the service, from flags, environment and file: [`Config`].

mod error;
mod file;
mod print;
mod range;
mod rules;

use std::{
    net::SocketAddr,
    num::{NonZeroU32, NonZeroUsize},
    path::PathBuf,
};

use clap::{Args, Parser, Subcommand, ValueEnum};
use papilla_engine::Choice;
use serde::Serialize;

pub use error::{ConfigError, SettingError};
pub(crate) use rules::Timeouts;

/// How a line of the log is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum LogFormat {
    /// For people.
    #[default]
    Text,
    /// One JSON object a line: `timestamp`, `level`, `target`, `message`, and the members of the event.
    Json,
}

const HELP_TAIL: &str = "\
Every setting has three names: --max-sessions on the command line, PAPILLA_MAX_SESSIONS in the
environment, max_sessions in the file. The command line wins over the environment, the
environment over the file, the file over the default. --print-config shows what came of it.

Examples:
  papilla-server                               serve on http://127.0.0.1:7224
  papilla-server --config papilla.toml         settings from a file
  papilla-server check --models out/models     look at everything, serve nothing
  papilla-server --bind 0.0.0.0:8000 --tokens tokens.toml --tls-cert c.pem --tls-key k.pem
  papilla-server --models out/models --watch-models --json
  curl --data-binary @pressure.raw http://127.0.0.1:7224/v1/sed -o sed.raw

The start line goes to stdout, the log to stderr. SIGTERM or Ctrl-C drains: frames already
accepted are answered, then the process ends. A second signal ends it at once. SIGHUP loads the
models anew.

Exit codes:
  0  drained and ended; with `check`: everything is in order
  1  unexpected failure
  2  wrong usage, or a setting that cannot be used
  3  the models are missing or unusable
  4  the address cannot be bound
  5  the drain took longer than --drain-timeout-s, or a second signal ended it
  130  a signal ended the start";

/// Papilla service: pressure maps in, strain energy density maps out, in time.
#[derive(Debug, Clone, Parser)]
#[command(name = "papilla-server", version, after_help = HELP_TAIL)]
pub struct Cli {
    /// What to do; nothing named: serve.
    #[command(subcommand)]
    pub command: Option<Command>,

    /// Settings file, TOML; its fields are the settings below, with underscores.
    #[arg(long, env = "PAPILLA_CONFIG", value_name = "FILE")]
    pub config: Option<PathBuf>,

    /// Print the settings as they came out, as a file that --config reads, and end.
    #[arg(long)]
    pub print_config: bool,

    /// The settings.
    #[command(flatten)]
    pub settings: Config,
}

/// What the binary can do besides serving.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Subcommand)]
pub enum Command {
    /// Verify settings, models, atlas, port and calibration; report and end.
    Check,
}

/// The settings of the service.
#[derive(Debug, Clone, Args, Serialize)]
pub struct Config {
    /// Address to listen on; port 0 takes any free one.
    #[arg(long, env = "PAPILLA_BIND", default_value = "127.0.0.1:7224", value_name = "IP:PORT")]
    pub bind: SocketAddr,

    /// Serve an address that others can reach although no tokens are asked for.
    #[arg(long, env = "PAPILLA_ALLOW_ANYONE")]
    pub allow_anyone: bool,

    /// Folder of models to serve instead of the ones in the binary (index.json, atlas.json,
    /// NAME.onnx and NAME.json, and finger.contact for contact).
    #[arg(long, env = "PAPILLA_MODELS", value_name = "DIR")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub models: Option<PathBuf>,

    /// Contact model of `fe-datagen contact` instead of the one among the models.
    #[arg(long, env = "PAPILLA_CONTACT", value_name = "FILE")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact: Option<PathBuf>,

    /// Folder of fingers that hellos name beside the default one, which is that of the models: each a
    /// folder like that of models, with finger.toml, loaded when a client first names it.
    #[arg(long, env = "PAPILLA_FINGERS", value_name = "DIR")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fingers: Option<PathBuf>,

    /// Reload when the folder of models changes, or that of fingers.
    #[arg(long, env = "PAPILLA_WATCH_MODELS")]
    pub watch_models: bool,

    /// Inference threads; each owns a ready session of every tier [default: one per core].
    #[arg(long, env = "PAPILLA_THREADS", value_parser = |text: &str| range::parse::<NonZeroUsize>(text, &range::THREADS), value_name = "N")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threads: Option<NonZeroUsize>,

    /// Real-time priorities, reading above rendering, and memory that is not paged out; what the
    /// system refuses is said at the start. Linux.
    #[arg(long, env = "PAPILLA_REAL_TIME")]
    pub real_time: bool,

    /// Tier for clients that name neither a tier nor a budget [default: index.json's].
    #[arg(long, env = "PAPILLA_DEFAULT_TIER", value_name = "NAME")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub default_tier: Option<String>,

    /// What runs the networks: tract, ort (ONNX Runtime; needs a binary built with the cargo feature
    /// `ort`, and ORT_DYLIB_PATH), or for each tier the one that is faster here: auto.
    #[arg(long, env = "PAPILLA_BACKEND", default_value = "auto", value_name = "NAME")]
    pub backend: Choice,

    /// Time for measuring the tiers on this machine at the start, milliseconds; slow tiers take
    /// two runs each whatever they need. 0: none, the shipped times stand.
    #[arg(long, env = "PAPILLA_CALIBRATION_MS", value_parser = |text: &str| range::parse::<u64>(text, &range::CALIBRATION_MS), default_value = "1500", value_name = "MS")]
    pub calibration_ms: u64,

    /// Log filter, as `info` or `papilla_server=debug`.
    #[arg(long, env = "PAPILLA_LOG", default_value = "info", value_name = "FILTER")]
    pub log: String,

    /// How a line of the log is written: text, or json, one object a line, for programs that collect
    /// logs.
    #[arg(long, env = "PAPILLA_LOG_FORMAT", default_value = "text", value_name = "FORMAT")]
    pub log_format: LogFormat,

    /// Print the start line, or the report of `check`, as JSON.
    #[arg(long, env = "PAPILLA_JSON")]
    pub json: bool,

    /// Collector of traces, as http://127.0.0.1:4318; needs a binary built with the cargo
    /// feature `otlp`.
    #[arg(long, env = "PAPILLA_OTLP_ENDPOINT", value_name = "URL")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub otlp_endpoint: Option<String>,

    /// File of bearer tokens, TOML: [[token]] with name, token or sha256, max_sessions, admin.
    #[arg(long, env = "PAPILLA_TOKENS", value_name = "FILE")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tokens: Option<PathBuf>,

    /// Certificate chain, PEM; with --tls-key the service speaks TLS and nothing else.
    #[arg(long, env = "PAPILLA_TLS_CERT", value_name = "FILE")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tls_cert: Option<PathBuf>,

    /// Private key of the certificate, PEM.
    #[arg(long, env = "PAPILLA_TLS_KEY", value_name = "FILE")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tls_key: Option<PathBuf>,

    /// Origin whose pages may use the service, as https://lab.example; can be repeated. The
    /// service's own page always may.
    #[arg(long, env = "PAPILLA_ALLOW_ORIGIN", value_name = "ORIGIN", value_delimiter = ',')]
    pub allow_origin: Vec<String>,

    /// Folder whose files are served at /xr in place of the WebXR scene in the binary; with an
    /// index.html, as `npm run build` makes it in clients/web.
    #[arg(long, env = "PAPILLA_XR_DIR", value_name = "DIR")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub xr_dir: Option<PathBuf>,

    /// Sessions whose clients follow are asked to open another connection after a random time, from
    /// two thirds to four thirds of this, seconds, so that new machines get their share; up to a
    /// day. 0: never.
    #[arg(long, env = "PAPILLA_RECONNECT_AFTER_S", value_parser = |text: &str| range::parse::<u64>(text, &range::RECONNECT_S), default_value = "1800", value_name = "S")]
    pub reconnect_after_s: u64,

    /// Keys that seal what such a session takes along, 64 hexadecimal digits a line; the first seals,
    /// all open. The same file on all machines [default: a key of this process alone].
    #[arg(long, env = "PAPILLA_STATE_KEYS", value_name = "FILE")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub state_keys: Option<PathBuf>,

    /// Greatest number of open sessions; further ones are answered 503; 1 to 10000.
    #[arg(long, env = "PAPILLA_MAX_SESSIONS", value_parser = |text: &str| range::parse::<NonZeroUsize>(text, &range::PLACES), default_value = "64", value_name = "N")]
    pub max_sessions: NonZeroUsize,

    /// Greatest number of fingers of all sessions, of up to 20 MiB each, but for one of each session
    /// that sends maps of pressure; further ones are refused; 1 to 10000.
    #[arg(long, env = "PAPILLA_MAX_FINGERS", value_parser = |text: &str| range::parse::<NonZeroUsize>(text, &range::PLACES), default_value = "64", value_name = "N")]
    pub max_fingers: NonZeroUsize,

    /// Greatest number of fingers of --fingers that are loaded; a further one is refused; 1 to 63. Each
    /// may have 256 MiB of files.
    #[arg(long, env = "PAPILLA_MAX_LOADED_FINGERS", value_parser = |text: &str| range::parse::<NonZeroUsize>(text, &range::LOADED_FINGERS), default_value = "8", value_name = "N")]
    pub max_loaded_fingers: NonZeroUsize,

    /// Greatest number of posted maps that wait or run; further ones are answered 503; 1 to 10000.
    #[arg(long, env = "PAPILLA_MAX_REQUESTS", value_parser = |text: &str| range::parse::<NonZeroUsize>(text, &range::PLACES), default_value = "64", value_name = "N")]
    pub max_requests: NonZeroUsize,

    /// Greatest number of open connections; further ones wait to be accepted; 1 to 100000.
    #[arg(long, env = "PAPILLA_MAX_CONNECTIONS", value_parser = |text: &str| range::parse::<NonZeroUsize>(text, &range::CONNECTIONS), default_value = "256", value_name = "N")]
    pub max_connections: NonZeroUsize,

    /// Largest body of a request, bytes; a JSON map with every digit takes about 1.2 MB.
    #[arg(long, env = "PAPILLA_MAX_BODY_BYTES", default_value = "2097152", value_name = "N")]
    pub max_body_bytes: usize,

    /// Requests a second that one client (its token, or its address) may send, sessions opened
    /// included; further ones are answered 429. 0: any.
    #[arg(long, env = "PAPILLA_RATE_PER_S", value_parser = |text: &str| range::parse::<u32>(text, &range::RATE_PER_S), default_value = "1000", value_name = "N")]
    pub rate_per_s: u32,

    /// Requests a client may send at once before the rate holds [default: one second's worth].
    #[arg(long, env = "PAPILLA_RATE_BURST", value_parser = |text: &str| range::parse::<NonZeroU32>(text, &range::RATE_BURST), value_name = "N")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_burst: Option<NonZeroU32>,

    /// A client that owes the server bytes (a request, a hello, room for an answer) for this
    /// long is dropped, seconds; so is a connection kept alive for nothing.
    #[arg(long, env = "PAPILLA_IO_TIMEOUT_S", value_parser = |text: &str| range::parse::<u64>(text, &range::TIMEOUT_S), default_value = "10", value_name = "S")]
    pub io_timeout_s: u64,

    /// A session silent for this long is closed, seconds. Pings count, and any WebSocket
    /// library answers them.
    #[arg(long, env = "PAPILLA_IDLE_TIMEOUT_S", value_parser = |text: &str| range::parse::<u64>(text, &range::TIMEOUT_S), default_value = "60", value_name = "S")]
    pub idle_timeout_s: u64,

    /// Time for the drain, seconds; longer than --io-timeout-s, or a slow client can outlast it.
    #[arg(long, env = "PAPILLA_DRAIN_TIMEOUT_S", value_parser = |text: &str| range::parse::<u64>(text, &range::DRAIN_S), default_value = "15", value_name = "S")]
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
            allow_anyone: false,
            models: None,
            contact: None,
            fingers: None,
            watch_models: false,
            threads: None,
            real_time: false,
            default_tier: None,
            backend: Choice::Auto,
            calibration_ms: 1500,
            log: "info".to_owned(),
            log_format: LogFormat::Text,
            json: false,
            otlp_endpoint: None,
            tokens: None,
            tls_cert: None,
            tls_key: None,
            allow_origin: Vec::new(),
            xr_dir: None,
            reconnect_after_s: 1800,
            state_keys: None,
            max_sessions: n(64),
            max_fingers: n(64),
            max_loaded_fingers: n(8),
            max_requests: n(64),
            max_connections: n(256),
            max_body_bytes: 2 << 20,
            rate_per_s: 1000,
            rate_burst: None,
            io_timeout_s: 10,
            idle_timeout_s: 60,
            drain_timeout_s: 15,
        }
    }
}

#[cfg(test)]
mod tests;
