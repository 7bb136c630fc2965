//! `POST /v1/sed`: one pressure map in, one SED map out.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use axum::{
    body::Body,
    extract::State,
    http::{HeaderMap, HeaderName, HeaderValue, Uri},
    response::Response,
};
use bytes::BytesMut;
use papilla_proto::{ErrorCode, Problem, flags};
use tokio::{sync::mpsc, time::timeout};

use super::{Answer, Shared, answer, body, refuse};
use crate::{
    codec::Output,
    core::{
        metrics::Transport,
        scheduler::{Done, Job, Outcome, Recycler, Slot, Stage, is_past},
    },
    problem, telemetry,
    transport::{
        app::App,
        negotiate::{self, Query},
    },
};

/// Longest wait for the pool; only a fault of our own can take so long.
const POOL_PATIENCE: Duration = Duration::from_secs(60);

pub(super) async fn post(State(app): Shared, uri: Uri, headers: HeaderMap, body: Body) -> Answer {
    let result = render(&app, &uri, &headers, body).await;
    count(&app, Transport::Http, &result);
    result.or_else(|problem| refuse(&app, problem))
}

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

async fn render(
    app: &App,
    uri: &Uri,
    headers: &HeaderMap,
    body: Body,
) -> Result<Response, Problem> {
    // The body first: a client that is still sending would not read our answer.
    let payload = body::read(body, app.body_max, app.timeouts.io).await?;
    let received = Instant::now();
    body::require_plain(headers)?;
    let query = Query::parse(uri.query().unwrap_or_default())?;
    let input = negotiate::input(headers, &query, &payload)?;
    let output = negotiate::output(headers)?;
    let catalogue = app.catalogue();
    let tier = match &query.tier {
        Some(name) => catalogue.tier_named(name)?,
        None => catalogue.choose(query.budget(), &[]).unwrap_or(catalogue.default),
    };
    let deadline = query.budget().map(|us| received + Duration::from_micros(us.into()));
    let job = Job { tier, payload, input, output, frame: None, received, deadline };
    // Held until the answer is there: it bounds the queue.
    let _place = app.admit_request()?;
    let Rendered { bytes, scale, fared } = through_pool(app, job, Transport::Http).await?;
    let mut response = answer(output.content_type(), bytes.freeze());
    let headers = response.headers_mut();
    fared.label(headers, &catalogue.tiers[tier].name);
    if let (Output::Png, Ok(white)) = (output, HeaderValue::from_str(&scale.to_string())) {
        headers.insert("x-sed-max-j-per-m3", white);
    }
    Ok(response)
}

/// A map that came out of the pool in time.
pub(crate) struct Rendered {
    pub(crate) bytes: BytesMut,
    pub(crate) scale: f32,
    pub(crate) fared: Fared,
}

/// What a client may want to know beside the map.
#[derive(Clone, Copy)]
pub(crate) struct Fared {
    /// In the queue, in the network, from receipt until now.
    times: [Duration; 3],
    /// Bits of [`papilla_proto::flags`].
    flags: u8,
}

/// Renders one posted map. The caller holds a place, which bounds the queue.
///
/// # Errors
/// It was late, which is counted, or failed.
pub(crate) async fn through_pool(
    app: &App,
    job: Job,
    transport: Transport,
) -> Result<Rendered, Problem> {
    let late = |stage| {
        app.metrics.late(transport, stage);
        problem::late()
    };
    if job.is_late() {
        return Err(late(Stage::Admission));
    }
    let done = submit(app, job).await?;
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
            telemetry::rendered(&app.catalogue().tiers[done.tier].name, times);
            Ok(Rendered { bytes, scale, fared: Fared { times, flags: done.drawn.flags } })
        }
    }
}

async fn submit(app: &App, job: Job) -> Result<Done, Problem> {
    let (sink, mut answers) = mpsc::channel(1);
    let slot = Slot::new(Recycler::default(), Arc::new(sink));
    if app.entrance.submit(&Arc::new(slot), job).is_err() {
        return Err(problem::shutting_down());
    }
    match timeout(POOL_PATIENCE, answers.recv()).await {
        Ok(Some(done)) => Ok(done),
        Ok(None) => Err(problem::internal("the pool dropped the map", &"no answer")),
        Err(_) => Err(problem::internal("the pool did not answer", &"timeout")),
    }
}

impl Fared {
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
        for (_, name) in flags::NAMED.into_iter().filter(|(bit, _)| self.flags & bit != 0) {
            headers.append("x-papilla-flags", HeaderValue::from_static(name));
        }
    }
}
