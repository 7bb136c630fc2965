//! The log on stderr, and spans for a collector of traces (cargo feature `otlp`).
//!
//! Without a collector no spans are made, which costs one comparison each time.

use std::{
    future::Future,
    io::{self, IsTerminal},
    time::Duration,
};

use axum::http::{Method, StatusCode};
use papilla_proto::error::shortened;
use tracing::{Instrument, Level, Span, field::Empty};
use tracing_subscriber::{
    Layer,
    filter::{LevelFilter, Targets},
    layer::SubscriberExt,
    util::SubscriberInitExt,
};

use crate::config::{Config, LogFormat, SettingError};

/// Target of the spans: what goes to the collector, and not into the log.
const SPANS: &str = "papilla_spans";

/// Keeps the telemetry going; dropped, it sends what it still has.
#[derive(Default)]
pub struct Telemetry {
    #[cfg(feature = "otlp")]
    provider: Option<opentelemetry_sdk::trace::SdkTracerProvider>,
}

impl Telemetry {
    /// Starts the log and, with an endpoint, the traces. To be called outside of any runtime.
    ///
    /// # Errors
    /// The filter or the endpoint cannot be used.
    pub fn start(config: &Config) -> Result<Self, SettingError> {
        let refuse = |reason| SettingError { field: "log", reason };
        // Spans are asked for by their layer alone, whatever the log's filter lets through.
        let filter = filter(&config.log).map_err(refuse)?;
        let filter = filter.with_target(SPANS, LevelFilter::OFF);
        let log = tracing_subscriber::fmt::layer()
            .with_ansi(io::stderr().is_terminal())
            .with_writer(io::stderr)
            // It would be told to stderr as well, and that panics where nobody reads it.
            .log_internal_errors(false);
        let log = match config.log_format {
            LogFormat::Text => log.boxed(),
            LogFormat::Json => log.json().flatten_event(true).boxed(),
        };
        let log = log.with_filter(filter);
        let registry = tracing_subscriber::registry().with(log);
        let taken = |error: tracing_subscriber::util::TryInitError| refuse(error.to_string());
        #[cfg(feature = "otlp")]
        if let Some(endpoint) = &config.otlp_endpoint {
            let provider = otlp::provider(endpoint)
                .map_err(|reason| SettingError { field: "otlp_endpoint", reason })?;
            registry.with(otlp::layer(&provider)).try_init().map_err(taken)?;
            return Ok(Self { provider: Some(provider) });
        }
        registry.try_init().map_err(taken)?;
        Ok(Self::default())
    }
}

/// What `--log` says. A filter that leaves nothing of the service's own log is refused, unless it says
/// `off`: a slip in a name would silence it.
fn filter(text: &str) -> Result<Targets, String> {
    let wanted = "write a level (error, warn, info, debug, trace), or levels by module, as \
                  `info,papilla_server=debug`; `off` silences it";
    let is_name = |name: &str| {
        name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"_-:.".contains(&byte))
    };
    let mut parts = text.split(',').map(str::trim).filter(|part| !part.is_empty());
    let of = |part: &str| part.split_once('=').map_or(part, |(name, _)| name).trim().to_owned();
    if let Some(part) = parts.clone().find(|part| !is_name(&of(part))) {
        return Err(format!("'{}' is no level and no module; {wanted}", shortened(part)));
    }
    if parts.clone().next().is_none() {
        return Err(format!("an empty filter silences the service's log; {wanted}"));
    }
    let filter: Targets = text
        .parse()
        .map_err(|error| format!("'{}' is not a filter: {error}; {wanted}", shortened(text)))?;
    let own = env!("CARGO_CRATE_NAME");
    let is_meant = parts.any(|part| {
        let level = part.rsplit('=').next().unwrap_or_default().trim();
        level.eq_ignore_ascii_case("off") || of(part).starts_with(&format!("{own}::"))
    });
    if is_meant || filter.would_enable(own, &Level::ERROR) {
        return Ok(filter);
    }
    Err(format!("'{}' leaves nothing of the service's log; {wanted}", shortened(text)))
}

impl Drop for Telemetry {
    fn drop(&mut self) {
        #[cfg(feature = "otlp")]
        if let Some(Err(error)) = self.provider.take().map(|provider| provider.shutdown()) {
            tracing::warn!(%error, "the last traces were not sent");
        }
    }
}

#[cfg(feature = "otlp")]
mod otlp {
    use opentelemetry::trace::TracerProvider;
    use opentelemetry_otlp::{Protocol, SpanExporter, WithExportConfig};
    use opentelemetry_sdk::{Resource, trace::SdkTracerProvider};
    use tracing::Subscriber;
    use tracing_subscriber::{Layer, filter::Targets, registry::LookupSpan};

    /// A provider that sends spans in batches, from a thread of its own.
    pub(super) fn provider(endpoint: &str) -> Result<SdkTracerProvider, String> {
        let exporter = SpanExporter::builder()
            .with_http()
            .with_protocol(Protocol::HttpBinary)
            .with_endpoint(format!("{}/v1/traces", endpoint.trim_end_matches('/')))
            .build()
            .map_err(|error| error.to_string())?;
        let resource = Resource::builder().with_service_name("papilla-server").build();
        Ok(SdkTracerProvider::builder()
            .with_batch_exporter(exporter)
            .with_resource(resource)
            .build())
    }

    pub(super) fn layer<S>(provider: &SdkTracerProvider) -> impl Layer<S>
    where
        S: Subscriber + for<'a> LookupSpan<'a>,
    {
        let filter = Targets::new().with_target(super::SPANS, tracing::Level::TRACE);
        tracing_opentelemetry::layer().with_tracer(provider.tracer("papilla")).with_filter(filter)
    }
}

/// The span of one HTTP request, named by its route.
pub(crate) fn request_span(method: &Method, route: &str) -> Span {
    tracing::trace_span!(
        target: SPANS,
        "request",
        otel.name = %format_args!("{method} {route}"),
        otel.kind = "server",
        http.request.method = %method,
        http.route = route,
        http.response.status_code = Empty,
        papilla.tier = Empty,
        papilla.queue_us = Empty,
        papilla.infer_us = Empty,
        papilla.total_us = Empty,
    )
}

/// Runs `work` inside of the span.
pub(crate) fn within<F: Future>(span: &Span, work: F) -> impl Future<Output = F::Output> {
    work.instrument(span.clone())
}

/// Notes the status of the answer.
pub(crate) fn answered(span: &Span, status: StatusCode) {
    span.record("http.response.status_code", status.as_u16());
}

/// Notes in the current span how long a map took: in the queue, in the network, altogether.
pub(crate) fn rendered(tier: &str, times: [Duration; 3]) {
    let span = Span::current();
    if span.is_disabled() {
        return;
    }
    span.record("papilla.tier", tier);
    let names = ["papilla.queue_us", "papilla.infer_us", "papilla.total_us"];
    for (name, time) in names.into_iter().zip(times) {
        span.record(name, u64::try_from(time.as_micros()).unwrap_or(u64::MAX));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_filter_that_silences_the_service_by_a_slip_is_refused() {
        for good in [
            "info",
            "papilla_server=debug",
            "warn,hyper=trace",
            "off",
            "debug",
            "INFO",
            "papilla_server::core=info,warn",
            "off,notify=debug",
            "papilla_server",
            "papilla_server::core=info",
        ] {
            filter(good).unwrap_or_else(|error| panic!("{good}: {error}"));
        }
        for bad in [
            "[[[",
            "info,[[[",
            "",
            "verbose",
            "papilla_sever=debug",
            "hyper=debug",
            "papilla=loud",
            "papilla_server[span]=info",
        ] {
            let error = filter(bad).unwrap_err();
            assert!(error.contains("papilla_server=debug"), "{bad}: {error}");
        }
    }
}
