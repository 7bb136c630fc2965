//! The log on stderr, and spans for a collector of traces (cargo feature `otlp`).
//!
//! Without a collector nobody wants the spans, and making one costs a comparison.

use std::{
    future::Future,
    io::{self, IsTerminal},
    time::Duration,
};

use axum::http::{Method, StatusCode};
use tracing::{Instrument, Span, field::Empty};
use tracing_subscriber::{
    Layer,
    filter::{LevelFilter, Targets},
    layer::SubscriberExt,
    util::SubscriberInitExt,
};

use crate::config::{Config, SettingError};

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
        let filter: Targets = config
            .log
            .parse()
            .map_err(|error| refuse(format!("'{}' is not a filter: {error}", config.log)))?;
        let filter = filter.with_target(SPANS, LevelFilter::OFF);
        let log = tracing_subscriber::fmt::layer()
            .with_ansi(io::stderr().is_terminal())
            .with_writer(io::stderr)
            .with_filter(filter);
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
