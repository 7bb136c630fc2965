//! The Open Inference Protocol, version 2, over HTTP: existing clients work unmodified.
//!
//! `papilla-oip` reads requests and writes answers. Every tier is a model of version 1; the
//! parameter `finger` of an address says of which finger, as on all other routes.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use axum::{
    body::Body,
    extract::{Extension, State},
    http::{HeaderMap, HeaderValue, Uri},
    response::Response,
};
use bytes::Bytes;
use papilla_codec::{Input, Output};
use papilla_metrics::Transport;
use papilla_oip::{DATATYPE, HEAD_LEN, Request, SHAPE, VERSION, head_len};
use papilla_proto::{ErrorCode, INPUT_NAME, OUTPUT_NAME, Problem, SampleType, error::shortened};
use serde_json::json;
use tokio::task::spawn_blocking;

use crate::{
    core::{
        catalogue::Catalogue,
        scheduler::{Job, JobOptions},
    },
    problem,
    transport::{
        answer::{
            self, Shared, body, json_answer,
            refusal::OipProblem,
            render::{Rendered, count, through_pool},
        },
        app::App,
        first_use,
        gate::Principal,
        http::finger,
    },
};

type Answer = Result<Response, OipProblem>;

fn refuse(app: &App, problem: Problem) -> Answer {
    app.metrics.error(problem.code);
    Err(OipProblem(problem))
}

pub(crate) async fn server() -> Response {
    json_answer(&json!({
        "name": "papilla",
        "version": env!("CARGO_PKG_VERSION"),
        "extensions": ["binary_tensor_data"],
    }))
}

pub(crate) async fn live() -> Response {
    json_answer(&json!({"live": true}))
}

pub(crate) async fn ready(State(app): Shared) -> Answer {
    if app.is_draining() {
        return refuse(&app, problem::shutting_down());
    }
    match app.progress.left() {
        Some(left) => refuse(&app, left.problem()),
        None => Ok(json_answer(&json!({"ready": true}))),
    }
}

pub(crate) async fn model(
    State(app): Shared,
    Extension(caller): Extension<Principal>,
    uri: Uri,
) -> Answer {
    let (catalogue, place) = match named(&app, &caller, &uri).await {
        Ok(named) => named,
        Err(problem) => return refuse(&app, problem),
    };
    let tier = &catalogue.tiers[place];
    let tensor = |name| json!([{"name": name, "datatype": DATATYPE, "shape": SHAPE}]);
    Ok(json_answer(&json!({
        "name": tier.name,
        "versions": [VERSION],
        "platform": "onnx",
        "inputs": tensor(INPUT_NAME),
        "outputs": tensor(OUTPUT_NAME),
    })))
}

pub(crate) async fn model_ready(
    State(app): Shared,
    Extension(caller): Extension<Principal>,
    uri: Uri,
) -> Answer {
    match named(&app, &caller, &uri).await {
        Ok(_) if app.is_draining() => refuse(&app, problem::shutting_down()),
        Ok(_) => Ok(json_answer(&json!({"ready": true}))),
        Err(problem) => refuse(&app, problem),
    }
}

/// The tier that `/v2/models/{model}[/versions/{version}]` names, with `?finger=` of that finger:
/// its place in the finger's catalogue.
async fn named(
    app: &Arc<App>,
    caller: &Principal,
    uri: &Uri,
) -> Result<(Arc<Catalogue>, usize), Problem> {
    let catalogue = finger::asked(app, caller, uri).await?.catalogue;
    let mut parts = uri.path().split('/').skip(3);
    let model = parts.next().unwrap_or_default();
    let place = catalogue.tier_named(model)?;
    match (parts.next(), parts.next()) {
        (Some("versions"), Some(version)) if version != VERSION => {
            let version = shortened(version);
            let message = format!("model {model} has no version '{version}', only {VERSION}");
            Err(Problem::new(ErrorCode::UnknownTier, message).at("version"))
        }
        _ => Ok((catalogue, place)),
    }
}

pub(crate) async fn infer(
    State(app): Shared,
    Extension(principal): Extension<Principal>,
    uri: Uri,
    headers: HeaderMap,
    body: Body,
) -> Answer {
    let result = answer(&app, &principal, &uri, &headers, body).await;
    count(&app, Transport::Oip, &result);
    result.or_else(|problem| refuse(&app, problem))
}

async fn answer(
    app: &Arc<App>,
    principal: &Principal,
    uri: &Uri,
    headers: &HeaderMap,
    body: Body,
) -> Result<Response, Problem> {
    // The body first: a client that is still sending would not read our answer.
    let body = body::read(headers, body, app.body_max, app.timeouts.io).await?;
    body::require_plain(headers)?;
    let received = Instant::now();
    let (catalogue, place) = named(app, principal, uri).await?;
    let tier = catalogue.tier_number(place);
    first_use::wait(app, tier, principal.client.as_ref(), app.timeouts.io).await?;
    // Held until the answer is written: it bounds the work below as well.
    let _place = app.admit_request()?;
    let head_len = head_len(headers.get(HEAD_LEN).map(HeaderValue::as_bytes), body.len())?;
    let mut request = read(body, head_len).await?;
    let deadline = request.timeout_us.map(|us| received + Duration::from_micros(us));
    let job = Job {
        tier,
        payload: std::mem::take(&mut request.pressure_pa),
        input: Input::Samples { sample_type: SampleType::F32, scale: 1.0 },
        output: Output::Samples(SampleType::F32),
        received,
        deadline,
        options: JobOptions::default(),
    };
    let client = principal.client.as_ref();
    let Rendered { bytes, timings, .. } = through_pool(app, job, Transport::Oip, client).await?;
    let name = catalogue.tiers[place].name.clone();
    let mut response = encode(name.clone(), request, bytes.freeze()).await?;
    timings.label(response.headers_mut(), &name);
    Ok(response)
}

async fn encode(model: String, request: Request, sed_j_per_m3: Bytes) -> Result<Response, Problem> {
    let failed =
        |error: &dyn std::fmt::Display| problem::internal("the answer was not written", error);
    let is_binary = request.is_binary_wanted;
    let encode = move || papilla_oip::Answer { model: &model, request, sed_j_per_m3 }.encode();
    let encoded = if is_binary {
        encode()
    } else {
        // Fifty thousand numbers in digits: not for a thread that moves bytes.
        spawn_blocking(encode).await.map_err(|error| failed(&error))?
    };
    let body = encoded.map_err(|error| failed(&error))?;
    let Some(head_len) = body.head_len else {
        return Ok(answer::answer("application/json", body.bytes));
    };
    let mut response = answer::answer("application/octet-stream", body.bytes);
    response.headers_mut().insert(HEAD_LEN, HeaderValue::from(head_len));
    Ok(response)
}

/// Reads the request; long JSON elsewhere than on a thread that moves bytes.
async fn read(body: Bytes, head_len: Option<usize>) -> Result<Request, Problem> {
    const SHORT: usize = 4096;
    if head_len.unwrap_or(body.len()) <= SHORT {
        return Request::read(&body, head_len);
    }
    spawn_blocking(move || Request::read(&body, head_len))
        .await
        .map_err(|error| problem::internal("the request was not read", &error))?
}
