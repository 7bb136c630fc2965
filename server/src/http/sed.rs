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
use papilla_proto::{ErrorCode, Problem};
use tokio::time::timeout;

use super::{Answer, Shared, answer, body, refuse};
use crate::{
    app::App,
    codec::Output,
    metrics::Transport,
    negotiate::{self, Query},
    pool::{Done, Job, Outcome, Slot, Stage, is_past},
    problem,
};

/// Longest wait for the pool; only a fault of our own can take so long.
const POOL_PATIENCE: Duration = Duration::from_secs(60);

pub(super) async fn post(State(app): Shared, uri: Uri, headers: HeaderMap, body: Body) -> Answer {
    match render(&app, &uri, &headers, body).await {
        Ok(response) => {
            app.metrics.of(Transport::Http).ok.inc();
            Ok(response)
        }
        Err(problem) => {
            if problem.code != ErrorCode::Late {
                app.metrics.of(Transport::Http).error.inc();
            }
            refuse(&app, problem)
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
    let payload = body::read(body, app.timeouts.io).await?;
    let received = Instant::now();
    let query = Query::parse(uri.query().unwrap_or_default())?;
    let input = negotiate::input(headers, &query, &payload)?;
    let output = negotiate::output(headers)?;
    let tier = match &query.tier {
        Some(name) => app.tier_named(name)?,
        None => app.catalogue.choose(query.budget(), &[]).unwrap_or(app.catalogue.default),
    };
    let deadline = query.budget().map(|us| received + Duration::from_micros(us.into()));
    let job = Job { tier, payload, input, output, frame: None, received, deadline };
    let done = through_pool(app, job).await?;
    let total = received.elapsed();
    match done.outcome {
        Outcome::Failed(problem) => Err(problem),
        Outcome::Late(stage) => Err(late(app, stage)),
        Outcome::Map { .. } if is_past(done.deadline) => Err(late(app, Stage::Sending)),
        Outcome::Map { bytes, scale } => {
            app.metrics.tiers[tier].total.observe(total);
            let mut response = answer(output.content_type(), bytes.freeze());
            let name = &app.catalogue.tiers[tier].name;
            label(&mut response, name, output, scale, [done.times.queue, done.times.infer, total]);
            Ok(response)
        }
    }
}

fn late(app: &App, stage: Stage) -> Problem {
    app.metrics.late(Transport::Http, stage);
    problem::late()
}

async fn through_pool(app: &App, job: Job) -> Result<Done, Problem> {
    // Held until the answer is there: it bounds the queue.
    let _place = app.admit_request()?;
    if job.is_late() {
        return Err(late(app, Stage::Admission));
    }
    let (slot, mut answers) = Slot::new();
    if app.entrance.submit(&Arc::new(slot), job).is_err() {
        return Err(problem::shutting_down());
    }
    match timeout(POOL_PATIENCE, answers.recv()).await {
        Ok(Some(done)) => Ok(done),
        Ok(None) => Err(problem::internal("the pool dropped the map", &"no answer")),
        Err(_) => Err(problem::internal("the pool did not answer", &"timeout")),
    }
}

/// What a client may want to know beside the map.
fn label(response: &mut Response, tier: &str, output: Output, scale: f32, times: [Duration; 3]) {
    let headers = response.headers_mut();
    if let Ok(tier) = HeaderValue::from_str(tier) {
        headers.insert("x-papilla-tier", tier);
    }
    let names = ["x-papilla-queue-us", "x-papilla-infer-us", "x-papilla-total-us"];
    for (name, time) in names.into_iter().zip(times) {
        let us = u64::try_from(time.as_micros()).unwrap_or(u64::MAX);
        headers.insert(HeaderName::from_static(name), HeaderValue::from(us));
    }
    if let (Output::Png, Ok(white)) = (output, HeaderValue::from_str(&scale.to_string())) {
        headers.insert("x-sed-max-j-per-m3", white);
    }
}
