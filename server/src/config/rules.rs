//! Rules between settings: what a single setting does not show.

use std::{num::NonZeroUsize, time::Duration};

use papilla_engine::Choice;
use papilla_proto::MAP_LEN;

use super::{Config, SettingError, range};

/// The times the service runs by.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Timeouts {
    /// For a client that owes bytes.
    pub(crate) io: Duration,
    /// For a silent session.
    pub(crate) idle: Duration,
}

impl Config {
    /// Checks every number against its range, and what one setting alone cannot tell.
    ///
    /// # Errors
    /// The first setting that is beyond its range or at odds with another, and what would do.
    pub fn validate(&self) -> Result<(), SettingError> {
        range::check(self)?;
        let refuse = |field, reason: String| Err(SettingError { field, reason });
        if !self.bind.ip().is_loopback() && self.tokens.is_none() && !self.allow_anyone {
            let reason = format!(
                "{} can be reached by others, and nobody is asked for a token; give --tokens \
                 FILE, or --allow-anyone if that is what you want",
                self.bind
            );
            return refuse("bind", reason);
        }
        match (&self.tls_cert, &self.tls_key) {
            (Some(_), None) => {
                return refuse("tls_key", "a certificate needs its key as well".to_owned());
            }
            (None, Some(_)) => {
                return refuse("tls_cert", "a key needs its certificate as well".to_owned());
            }
            _ => {}
        }
        if self.watch_models && self.models.is_none() && self.fingers.is_none() {
            let reason = "the models in the binary cannot change; name a folder with --models, or \
                          with --fingers";
            return refuse("watch_models", reason.to_owned());
        }
        if let Some(folder) = self.fingers.as_ref().filter(|folder| !folder.is_dir()) {
            let reason = format!(
                "{} is no folder; it holds a folder for each finger, which is called as the finger",
                folder.display()
            );
            return refuse("fingers", reason);
        }
        if let Some(folder) = self.xr_dir.as_ref().filter(|dir| !dir.join("index.html").is_file()) {
            let reason = format!(
                "{} has no index.html; `npm run build` in clients/web makes a folder that has",
                folder.display()
            );
            return refuse("xr_dir", reason);
        }
        let least = MAP_LEN * 4;
        let greatest = 64 << 20;
        if !(least..=greatest).contains(&self.max_body_bytes) {
            let found = self.max_body_bytes;
            let reason = format!("{found} is not between {least} (one raw map) and {greatest}");
            return refuse("max_body_bytes", reason);
        }
        for origin in &self.allow_origin {
            if !is_origin(origin) {
                let reason = format!("'{origin}' is not scheme://host[:port] without a path");
                return refuse("allow_origin", reason);
            }
        }
        if let Choice::Only(backend) = self.backend {
            backend.require().or_else(|error| refuse("backend", error.to_string()))?;
        }
        if self.otlp_endpoint.is_some() && !cfg!(feature = "otlp") {
            let reason = "this binary was built without the cargo feature 'otlp'";
            return refuse("otlp_endpoint", reason.to_owned());
        }
        Ok(())
    }

    pub(crate) fn timeouts(&self) -> Timeouts {
        Timeouts {
            io: Duration::from_secs(self.io_timeout_s),
            idle: Duration::from_secs(self.idle_timeout_s),
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

    /// The scheme of the service's addresses.
    #[must_use]
    pub fn scheme(&self) -> &'static str {
        if self.tls_cert.is_some() { "https" } else { "http" }
    }
}

/// Whether `text` is an origin as browsers write it, RFC 6454 6.2.
fn is_origin(text: &str) -> bool {
    text.split_once("://").is_some_and(|(scheme, host)| {
        matches!(scheme, "http" | "https")
            && !host.is_empty()
            && host.bytes().all(|b| b.is_ascii_alphanumeric() || b"-._:[]".contains(&b))
    })
}
