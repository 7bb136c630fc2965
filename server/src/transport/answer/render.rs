//! The way of a posted map through the inference threads.

use std::{sync::Arc, time::Duration};

use axum::{
    http::{HeaderMap, HeaderName, HeaderValue},
    response::Response,
};
use bytes::BytesMut;
use papilla_metrics::{Stage, Transport};
use papilla_proto::{ErrorCode, LikelyError, Problem, flags};
use tokio::{sync::mpsc, time::timeout};

use crate::{
    core::{
        buffers::Recycler,
        scheduler::{Done, Job, Outcome, Slot, is_past},
    },
    problem, telemetry,
    transport::{app::App, gate::Key},
};

/// Longest wait for the pool; only a fault of our own can take so long.
const POOL_WAIT_MAX: Duration = Duration::from_secs(60);

/// Counts what became of a posted map; late ones were counted where they were found late.
pub(crate) fn count(app: &App, transport: Transport, result: &Result<Response, Problem>) {
    let outcomes = app.metrics.of(transport);
    match result {
        Ok(_) => {
            outcomes.ok.inc();
        }
        Err(problem) if problem.code == ErrorCode::Late => {}
        Err(_) => {
            outcomes.error.inc();
        }
    }
}

/// A map that came out of the pool in time.
pub(crate) struct Rendered {
    pub(crate) bytes: BytesMut,
    pub(crate) scale: f32,
    pub(crate) timings: Timings,
}

/// What a client may want to know beside the map.
#[derive(Clone, Copy)]
pub(crate) struct Timings {
    /// In the queue, in the network, from receipt until now.
    times: [Duration; 3],
    /// Bits of [`papilla_proto::flags`].
    flags: u8,
    /// What the map is likely to err.
    sed_error: LikelyError,
}

/// Renders one posted map. The caller holds a place, which bounds the queue.
///
/// # Errors
/// It was late, which is counted, or failed.
pub(crate) async fn through_pool(
    app: &App,
    job: Job,
    transport: Transport,
    client: Option<&Key>,
) -> Result<Rendered, Problem> {
    let late = |stage| {
        app.metrics.late(transport, stage);
        problem::late()
    };
    if job.is_late() {
        return Err(late(Stage::Admission));
    }
    let done = submit(app, job, client).await?;
    match done.outcome {
        Outcome::Failed(problem) => Err(problem),
        Outcome::Late(stage) => Err(late(stage)),
        // Whoever reads this has not left.
        Outcome::Gone => Err(problem::internal("the pool dropped the map", &"no client")),
        Outcome::Map { .. } if is_past(done.deadline) => Err(late(Stage::Sending)),
        Outcome::Map { bytes, scale } => {
            let total = done.received.elapsed();
            app.metrics.tier(done.tier).total.observe(total);
            let times = [done.times.queue, done.times.infer, total];
            telemetry::rendered(&app.tier_name(done.tier), times);
            let sed_error = done.meta.errors.sed;
            let timings = Timings { times, flags: done.meta.flags, sed_error };
            Ok(Rendered { bytes, scale, timings })
        }
    }
}

async fn submit(app: &App, job: Job, client: Option<&Key>) -> Result<Done, Problem> {
    let (sink, mut answers) = mpsc::channel(1);
    let slot = Slot::new(Recycler::default(), Arc::new(sink), app.posters.account(client));
    if app.pool.submit(&Arc::new(slot), job).is_err() {
        return Err(problem::shutting_down());
    }
    match timeout(POOL_WAIT_MAX, answers.recv()).await {
        Ok(Some(done)) => Ok(done),
        Ok(None) => Err(problem::internal("the pool dropped the map", &"no answer")),
        Err(_) => Err(problem::internal("the pool did not answer", &"timeout")),
    }
}

impl Timings {
    /// Says it in headers, with the tier that rendered.
    pub(crate) fn label(self, headers: &mut HeaderMap, tier: &str) {
        if let Ok(tier) = HeaderValue::from_str(tier) {
            headers.insert("x-papilla-tier", tier);
        }
        let names = ["x-papilla-queue-us", "x-papilla-infer-us", "x-papilla-total-us"];
        for (name, time) in names.into_iter().zip(self.times) {
            let us = u64::try_from(time.as_micros()).unwrap_or(u64::MAX);
            headers.insert(HeaderName::from_static(name), HeaderValue::from(us));
        }
        if self.sed_error.is_stated() {
            let LikelyError { median, p90 } = self.sed_error;
            let names = ["x-papilla-sed-error-median", "x-papilla-sed-error-p90"];
            for (name, error) in names.into_iter().zip([median, p90]) {
                if let Ok(error) = HeaderValue::from_str(&error.to_string()) {
                    headers.insert(HeaderName::from_static(name), error);
                }
            }
        }
        for (_, name) in flags::NAMED.into_iter().filter(|(bit, _)| self.flags & bit != 0) {
            headers.append("x-papilla-flags", HeaderValue::from_static(name));
        }
    }
}
